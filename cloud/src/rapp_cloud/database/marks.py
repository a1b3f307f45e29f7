"""Numbers that grow with every change of something, so that other processes see it cheaply."""

import sqlalchemy as sa

from rapp_cloud.database.tables import marks


def mark_of(connection: sa.Connection, name: str) -> int | None:
    """Return a mark, or None when nothing has ever changed."""
    found: int | None = connection.execute(sa.select(marks.c.value).where(marks.c.name == name)).scalar()
    return found


def raise_mark(connection: sa.Connection, name: str) -> None:
    """Let others see a change, once the transaction is done."""
    if not connection.execute(sa.update(marks).where(marks.c.name == name).values(value=marks.c.value + 1)).rowcount:
        connection.execute(sa.insert(marks).values(name=name, value=1))
