"""The simulated person: hears the robot, speaks into its virtual microphone with a voice of their own (SimWorld)."""

import asyncio
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.setdefault("QI_LOG_LEVEL", "1")  # libqi reads it when loaded, and logs on stdout

import qi

from rapp_cli.errors import CommandError

CALL_TIMEOUT = 60_000  # ms, for a whole spoken message


class Person:
    """Somebody in the robot's room with an espeak-ng voice; `on_speech` is told what they say as they begin."""

    def __init__(self, robot: str, voice: str, on_speech: Callable[[str], None] = lambda _text: None) -> None:
        self._robot = robot
        self._voice = voice
        self._on_speech = on_speech
        self._heard: asyncio.Queue[str] = asyncio.Queue(maxsize=100)
        self._session = qi.Session()
        self._world: qi.Object | None = None

    async def enter(self) -> None:
        """Come into the room: from now on the robot is heard. Raises CommandError when there is no simulator."""
        loop = asyncio.get_running_loop()
        try:
            await asyncio.to_thread(lambda: self._session.connect(self._robot, _async=True).value(5_000))
            self._world = await asyncio.to_thread(lambda: self._session.service("SimWorld"))
        except RuntimeError as error:
            raise CommandError(f"cannot reach the simulated room at {self._robot}: {error}; start nao_sim there") from error
        assert self._world is not None
        self._world.robotSaid.connect(lambda text: loop.call_soon_threadsafe(self._hear, text))

    def _hear(self, text: str) -> None:
        if self._heard.full():
            self._heard.get_nowait()
        self._heard.put_nowait(text)

    async def next_heard(self) -> str:
        """Wait for the next text the robot has finished saying."""
        return await self._heard.get()

    def forget(self) -> None:
        """What was heard until now is answered by nobody."""
        while not self._heard.empty():
            self._heard.get_nowait()

    async def say(self, text: str) -> None:
        """Say a text; returns when it has been spoken. Raises CommandError, for a voice that is not there too."""
        self._on_speech(text)
        await self.ask_room("personSay", text, self._voice)

    async def play(self, recording: Path) -> None:
        """Say what is in a recording; returns when it has been played. Raises CommandError."""
        await self.ask_room("personPlay", str(recording))

    async def ask_room(self, method: str, *values: Any) -> Any:
        """Call a method of SimWorld, such as getRobotPose; gives its result. Raises CommandError."""
        assert self._world is not None
        world = self._world
        try:
            return await asyncio.to_thread(lambda: getattr(world, method)(*values, _async=True).value(CALL_TIMEOUT))
        except RuntimeError as error:
            why = " ".join(str(error).split())
            raise CommandError(f"cannot go on in the simulated room at {self._robot}: {why}; its log says more") from error

    async def leave(self) -> None:
        """Go: the robot is heard no longer."""
        await asyncio.to_thread(self._session.close)
