"""The long command: `interpret` (paper §III: the platform interprets the recording and names the RApp)."""

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from rapp_cloud.interpreter.errors import InterpreterError
from rapp_cloud.interpreter.port import Commands, Interpretation
from rapp_cloud.robots import Robots
from rapp_cloud.services import robot_of
from rapp_cloud.views import Views
from rapp_hop.errors import from_wire
from rapp_hop.service import Request, Service, service

MAX_RECORDING = 32 * 2**20  # bytes

Interpret = Callable[[Path, Commands, str], Awaitable[Interpretation]]
"""Runs the interpreter somewhere it does not hold up the loop."""


def voice_services(robots: Robots, views: Views, interpret_in_worker: Interpret) -> list[Service]:
    """Make the services."""

    @service(timeout=60, max_body=MAX_RECORDING)
    async def interpret(request: Request, recording: Path, language: str = "en", robot: str | None = None) -> dict[str, Any]:
        """Name the RApp that a recorded sentence asks for; null when it is not understood, or fits those of `choice`."""
        kind = robots.kind_of(robot_of(request, robot))
        commands = await asyncio.to_thread(views.commands, kind, language)
        try:
            found = await interpret_in_worker(recording, commands, language)
        except InterpreterError as error:
            raise from_wire(error.kind, str(error)) from None
        return {
            "rapp": found.rapp,
            "confidence": found.confidence,
            "text": found.text,
            "candidates": [{"rapp": rapp, "confidence": confidence} for rapp, confidence in found.candidates],
            "choice": list(found.choice),
        }

    return [interpret]
