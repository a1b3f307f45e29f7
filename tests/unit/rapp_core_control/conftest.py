"""A core agent in memory."""

from pathlib import Path

import pytest

from fakes.core_home import Home


@pytest.fixture
def home(tmp_path: Path) -> Home:
    home = Home(tmp_path)
    home.platform._thread = object()  # type: ignore[assignment]  # tries in the background are tested on their own
    return home
