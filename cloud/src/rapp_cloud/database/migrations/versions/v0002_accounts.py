"""Accounts with roles and passwords; tokens with scopes and an end; one-time codes for robots."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"

_NAME = sa.String(100)


def upgrade() -> None:
    """Make the tables; whoever had a token is a robot."""
    op.create_table(
        "accounts",
        sa.Column("name", _NAME, primary_key=True),
        sa.Column("role", sa.String(16), nullable=False),
        sa.Column("password", sa.Text),
        sa.Column("created", sa.Double, nullable=False),
    )
    op.create_table(
        "codes",
        sa.Column("hash", sa.String(64), primary_key=True),
        sa.Column("robot", _NAME, nullable=False),
        sa.Column("expires", sa.Double, nullable=False),
        sa.Column("used", sa.Double),
    )
    with op.batch_alter_table("tokens") as tokens:
        tokens.alter_column("robot", new_column_name="name", existing_type=_NAME, existing_nullable=False)
        tokens.add_column(sa.Column("scopes", sa.Text, nullable=False, server_default="robot"))
        tokens.add_column(sa.Column("expires", sa.Double))
        tokens.add_column(sa.Column("revoked", sa.Double))
        tokens.add_column(sa.Column("rate", sa.Double))
        tokens.add_column(sa.Column("quota", sa.Integer))
    op.execute("INSERT INTO accounts (name, role, created) SELECT name, 'robot', min(created) FROM tokens GROUP BY name")
