"""One call of a service, from the request's bytes to the answer: read in its form, checked, run, written in its form."""

import asyncio
import contextlib
import logging
import secrets
import tempfile
from collections.abc import AsyncGenerator, AsyncIterable
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import quote

from rapp_hop.errors import Bug, HopError
from rapp_hop.fairness import Brake
from rapp_hop.heads import Head
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import Body, Call, Form, WireAnswer
from rapp_hop.registry import ServiceRegistry
from rapp_hop.repeats import Repeats
from rapp_hop.results import ANY_TYPE, File, Stream
from rapp_hop.runner import Runner
from rapp_hop.service import Request, Service
from rapp_hop.spool import bad_disk

_log = logging.getLogger(__name__)


class House(Protocol):
    """What a call needs of its server."""

    registry: ServiceRegistry
    runner: Runner
    repeats: Repeats
    uploads: Path
    brake: Brake


class ServiceJob:
    """See `heads.Job`."""

    def __init__(self, house: House, head: Head, caller: str, service: Service, form: Form) -> None:
        self.max_body = service.max_body
        self._house = house
        self._head = head
        self._caller = caller
        self._service = service
        self._form = form
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._remove: Path | None = None

    async def run(self, body: Body) -> WireAnswer:
        """Answer the call."""
        key = self._head.headers.get("idempotency-key")
        try:
            if key is None:
                return await self._answer(body)
            once = self._house.repeats.once
            return await once(self._caller, self._head.path, key, body, lambda: self._answer(body))
        except HopError as error:
            return self.failed(error)

    def failed(self, error: HopError) -> WireAnswer:
        """Return the answer for an error, and log it."""
        note(self._house.brake, self._head, error)
        return self._form.write_error(error, self._service)

    async def done(self) -> None:
        """Remove the files of the call."""
        folder, self._folder = self._folder, None
        if folder is not None:
            await asyncio.to_thread(folder.cleanup)
        if self._remove is not None:
            await asyncio.to_thread(self._remove.unlink, missing_ok=True)

    async def _answer(self, body: Body) -> WireAnswer:
        try:
            call = self._form.read(self._head.with_body(body), self._service)
            answer = self._written(await self._run(call))
            if isinstance(answer.body, bytes):
                await self.done()  # so that who has the answer knows the files gone
            elif isinstance(answer.body, Path) and not await asyncio.to_thread(answer.body.is_file):
                raise Bug(f"cannot answer for {self._service.name}: the file it made is not there")
            return answer
        except HopError as error:
            return self.failed(error)
        except Exception:  # noqa: BLE001 (whatever a service raises is our fault, and answered so)
            if self._house.brake.allows():
                _log.exception("%s failed", self._service.name)
            return self.failed(Bug("cannot finish the call: the platform has a fault of its own, which is in its log"))

    async def _run(self, call: Call) -> Any:
        head, house, item = self._head, self._house, self._service
        request = Request(self._caller, item.name, head.headers, head.address, head.method, head.path)
        if not call.uploads:
            arguments = item.bind(call.arguments, {}, request)
        else:
            names = {upload.parameter: secrets.token_hex(8) + upload.suffix for upload in call.uploads}
            item.bind(call.arguments, {name: Path(file) for name, file in names.items()}, request)  # before a byte is written
            try:
                self._folder = await asyncio.to_thread(_make_folder, house.uploads)
                files = {name: Path(self._folder.name, file) for name, file in names.items()}
                for upload in call.uploads:
                    await asyncio.to_thread(files[upload.parameter].write_bytes, upload.data)
            except OSError as error:
                raise bad_disk(error) from None
            arguments = item.bind(call.arguments, files, request)
        house.registry.spend(item)
        return await house.runner.run(item, arguments)

    def _written(self, result: Any) -> WireAnswer:
        if isinstance(result, Path):
            result = File(result)
        if isinstance(result, File):
            self._remove = result.path if result.remove else None
            return WireAnswer(200, _one_line(result.content_type), result.path, _offer(result.name or result.path.name))
        if isinstance(result, Stream | AsyncIterable):
            stream = result if isinstance(result, Stream) else Stream(result, ANY_TYPE)
            return WireAnswer(200, _one_line(stream.content_type), _pieces(stream), _offer(stream.name))
        return self._form.write(result, self._service)


class MountJob:
    """See `heads.Job`; hands the request to a mount."""

    def __init__(self, brake: Brake, head: Head, caller: str, mount: Mount, form: Form) -> None:
        self.max_body = mount.max_body
        self._brake = brake
        self._head = head
        self._caller = caller
        self._mount = mount
        self._form = form

    async def run(self, body: Body) -> WireAnswer:
        """Answer the request."""
        rest = self._head.path.removeprefix(self._mount.prefix)
        try:
            return await self._mount.handler(Visit(self._caller, rest, self._head.with_body(body), self._head.address))
        except HopError as error:
            return self.failed(error)
        except Exception:  # noqa: BLE001 (as above)
            if self._brake.allows():
                _log.exception("%s failed", self._mount.prefix)
            return self.failed(Bug("cannot finish the call: the platform has a fault of its own, which is in its log"))

    def failed(self, error: HopError) -> WireAnswer:
        """Return the answer for an error, and log it."""
        note(self._brake, self._head, error)
        return self._form.write_error(error, None)

    async def done(self) -> None:
        """Nothing is left behind."""


def note(brake: Brake, head: Head, error: HopError) -> None:
    """Log an error of a caller in one line, unless there are too many of them."""
    if brake.allows():
        _log.info("%s %s: %s", head.method[:10], head.path[:100], str(error)[:200])


def _make_folder(parent: Path) -> tempfile.TemporaryDirectory[str]:
    parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    return tempfile.TemporaryDirectory(dir=parent)


def _one_line(content_type: str) -> str:
    if not content_type.isprintable() or not content_type.isascii():
        raise Bug("cannot answer: the service gives a content type that is none")
    return content_type


def _offer(name: str) -> tuple[tuple[str, str], ...]:
    return (("Content-Disposition", f"attachment; filename*=UTF-8''{quote(name, safe='')}"),) if name else ()


async def _pieces(stream: Stream) -> AsyncGenerator[bytes, None]:
    pieces = stream.pieces
    if isinstance(pieces, AsyncGenerator):
        async with contextlib.aclosing(pieces):
            async for piece in pieces:
                yield piece
    elif isinstance(pieces, AsyncIterable):
        async for piece in pieces:
            yield piece
    else:
        iterator = iter(pieces)
        while (piece_ := await asyncio.to_thread(next, iterator, None)) is not None:
            yield piece_
