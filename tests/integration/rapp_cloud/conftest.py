"""What tests of the platform share: each of its two databases."""

import itertools
from collections.abc import Iterator
from pathlib import Path

import pytest

from fakes import postgres as pg
from rapp_cloud.database.engine import Database

_number = itertools.count(1)


@pytest.fixture(scope="session")
def postgres() -> Iterator[str]:
    with pg.postgres() as server:
        yield server


@pytest.fixture(params=["sqlite", "postgresql"])
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path / 'platform.sqlite'}"
        return
    with pg.database(request.getfixturevalue("postgres"), f"test_{next(_number)}") as url:
        yield url


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    database = Database(database_url)
    database.migrate()
    yield database
    database.close()
