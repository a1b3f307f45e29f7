"""Persons of a home with their contacts, and whom each robot serves."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"

_NAME = sa.String(100)


def upgrade() -> None:
    """Make the tables; `People.adopt` fills them from the files of before."""
    op.create_table(
        "people",
        sa.Column("person", _NAME, primary_key=True),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("language", sa.String(16), nullable=False),
    )
    op.create_table(
        "contacts",
        sa.Column("person", _NAME, sa.ForeignKey("people.person", ondelete="CASCADE"), primary_key=True),
        sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("address", sa.String(320), nullable=False),
    )
    op.create_table(
        "served",
        sa.Column("robot", _NAME, primary_key=True),
        sa.Column("person", _NAME, sa.ForeignKey("people.person", ondelete="CASCADE"), primary_key=True),
        sa.Column("number", sa.Integer, nullable=False),
    )
