"""The simulated person: what the room refuses is told in words."""

import asyncio
from pathlib import Path
from typing import Any

import pytest

from rapp_cli.errors import CommandError
from rapp_cli.person import Person

ROOM = "tcp://127.0.0.1:9559"


class Refusing:
    """A room whose methods fail, as libqi tells it."""

    def __getattr__(self, name: str) -> Any:
        def method(*_values: Any, _async: bool) -> "Refusing":
            return self

        def value(_timeout: int) -> None:
            raise RuntimeError("SimWorld::personSay\n\tcannot speak: espeak-ng failed")

        return value if name == "value" else method


@pytest.mark.parametrize(("act", "value"), [("say", "hello"), ("play", Path("hello.wav")), ("ask_room", "getDoor")])
def test_what_the_room_refuses_is_told_in_a_line(act: str, value: Any) -> None:
    person = Person(ROOM, "nonsense")
    person._world = Refusing()
    with pytest.raises(CommandError, match=f"cannot go on in the simulated room at {ROOM}: .* cannot speak: espeak-ng failed;"):
        asyncio.run(getattr(person, act)(value))
