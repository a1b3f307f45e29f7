"""Tokens, robots and their leases, runs, audit log."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None

_NAME = sa.String(100)
_HASH = sa.String(64)


def upgrade() -> None:
    """Make the tables."""
    op.create_table(
        "tokens",
        sa.Column("hash", _HASH, primary_key=True),
        sa.Column("robot", _NAME, nullable=False),
        sa.Column("created", sa.Double, nullable=False),
    )
    op.create_table("marks", sa.Column("name", _NAME, primary_key=True), sa.Column("value", sa.Integer, nullable=False))
    op.create_table(
        "robots",
        sa.Column("name", _NAME, primary_key=True),
        sa.Column("kind", _NAME, nullable=False),
        sa.Column("api_version", sa.String(32), nullable=False),
        sa.Column("until", sa.Double, nullable=False),
    )
    op.create_table(
        "runs",
        sa.Column("robot", _NAME, primary_key=True),
        sa.Column("run", _NAME, primary_key=True),
        sa.Column("received", sa.Double, nullable=False),
        sa.Column("report", sa.Text, nullable=False),
    )
    op.create_index("runs_by_time", "runs", ["robot", "received"])
    _audit()


def _audit() -> None:
    op.create_table(
        "audit",
        sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
        sa.Column("at", sa.Double, nullable=False),
        sa.Column("who", _NAME, nullable=False),
        sa.Column("deed", _NAME, nullable=False),
        sa.Column("subject", sa.String(200), nullable=False),
        sa.Column("detail", sa.Text, nullable=False),
        sa.Column("seal", _HASH, nullable=False),
    )
    if op.get_bind().dialect.name == "sqlite":
        for deed in ("UPDATE", "DELETE"):
            op.execute(
                f"CREATE TRIGGER audit_no_{deed.lower()} BEFORE {deed} ON audit "
                "BEGIN SELECT RAISE(ABORT, 'the audit log is only added to'); END"
            )
        return
    op.execute(
        "CREATE FUNCTION audit_is_only_added_to() RETURNS trigger LANGUAGE plpgsql AS "
        "$$ BEGIN RAISE EXCEPTION 'the audit log is only added to'; END $$"
    )
    for deed, level in (("UPDATE OR DELETE", "ROW"), ("TRUNCATE", "STATEMENT")):
        name = f"audit_no_{deed.split()[0].lower()}"
        op.execute(f"CREATE TRIGGER {name} BEFORE {deed} ON audit FOR EACH {level} EXECUTE FUNCTION audit_is_only_added_to()")
