"""The tables, as the newest migration leaves them; a test holds the two against each other. Times are UTC, seconds since 1970."""

from sqlalchemy import Column, Double, ForeignKey, Index, Integer, MetaData, String, Table, Text

NAME = String(100)
HASH = String(64)  # SHA-256, hexadecimal

metadata = MetaData()

accounts = Table(
    "accounts",
    metadata,
    Column("name", NAME, primary_key=True),
    Column("role", String(16), nullable=False),
    Column("password", Text),
    Column("created", Double, nullable=False),
)
"""Users, publishers and robots; the password as Argon2 hash, robots have none."""

tokens = Table(
    "tokens",
    metadata,
    Column("hash", HASH, primary_key=True),
    Column("name", NAME, nullable=False),
    Column("created", Double, nullable=False),
    Column("scopes", Text, nullable=False),
    Column("expires", Double),
    Column("revoked", Double),
    Column("rate", Double),
    Column("quota", Integer),
)
"""Who may call, what (scopes, blank between), until when, how many calls in a second and in a day. Only hashes are kept."""

codes = Table(
    "codes",
    metadata,
    Column("hash", HASH, primary_key=True),
    Column("robot", NAME, nullable=False),
    Column("expires", Double, nullable=False),
    Column("used", Double),
)
"""One-time codes, by which a robot gets its first token."""

people = Table(
    "people",
    metadata,
    Column("person", NAME, primary_key=True),
    Column("name", String(100), nullable=False),
    Column("language", String(16), nullable=False),
)
"""The persons of a home: by the name of their account, what they are called and speak."""

contacts = Table(
    "contacts",
    metadata,
    Column("person", NAME, ForeignKey("people.person", ondelete="CASCADE"), primary_key=True),
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("name", String(100), nullable=False),
    Column("address", String(320), nullable=False),
)
"""Whom a person writes to, in their order."""

served = Table(
    "served",
    metadata,
    Column("robot", NAME, primary_key=True),
    Column("person", NAME, ForeignKey("people.person", ondelete="CASCADE"), primary_key=True),
    Column("number", Integer, nullable=False),
)
"""Whom a robot serves; the lowest number is the one it takes to be present."""

calls = Table(
    "calls",
    metadata,
    Column("token", String(12), primary_key=True),
    Column("day", Integer, primary_key=True, autoincrement=False),
    Column("calls", Integer, nullable=False),
)
"""How often a token with a quota (by its id) has called on a day (since 1970, UTC)."""

marks = Table("marks", metadata, Column("name", NAME, primary_key=True), Column("value", Integer, nullable=False))
"""Numbers that grow with every change of something, so that other processes see it cheaply."""

robots = Table(
    "robots",
    metadata,
    Column("name", NAME, primary_key=True),
    Column("kind", NAME, nullable=False),
    Column("api_version", String(32), nullable=False),
    Column("until", Double, nullable=False),
)
"""Robots that have registered, and until when their lease holds."""

runs = Table(
    "runs",
    metadata,
    Column("robot", NAME, primary_key=True),
    Column("run", NAME, primary_key=True),
    Column("received", Double, nullable=False),
    Column("report", Text, nullable=False),
    Index("runs_by_time", "robot", "received"),
)
"""What robots told of their runs; the report is JSON."""

audit = Table(
    "audit",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("at", Double, nullable=False),
    Column("who", NAME, nullable=False),
    Column("deed", NAME, nullable=False),
    Column("subject", String(200), nullable=False),
    Column("detail", Text, nullable=False),
    Column("seal", HASH, nullable=False),
)
"""Who did what. Triggers refuse to change or delete a row; see `rapp_cloud.audit` for the seal."""
