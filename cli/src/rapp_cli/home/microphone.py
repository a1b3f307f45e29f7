"""This computer's microphone, by arecord (ALSA; PulseAudio and PipeWire offer themselves as its default device)."""

import asyncio
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import numpy as np

from rapp_cli.errors import CommandError
from rapp_nao_sim.sound.endpointer import LEAD, Ended, Endpointer, Started
from rapp_nao_sim.sound.room import BLOCK, Block
from rapp_nao_sim.sound.samples import RATE

SETTLING = 0.3  # s at the start that are left out: microphones click, or give nothing yet
PAUSE = 1.2  # s of quiet after which the person has finished
PATIENCE = 10.0  # s for the person to begin
LONGEST = 60.0  # s of one utterance
SILENT = 2.0  # s without any samples after which the device counts as dead
END = 2.0  # s from SIGTERM to SIGKILL


async def hear(device: str) -> Block:
    """Record until the person has stopped speaking; gives what they said, 16 bit at `RATE`.

    Raises CommandError when there is no microphone, or nothing is said.
    """
    async with _recording(device) as blocks:
        speech = _Speech()
        async for block in blocks:
            if speech.take(block):
                return speech.samples()
    raise AssertionError("a recording has no end")


class _Speech:
    """Finds the utterance in a stream of blocks."""

    def __init__(self) -> None:
        self._endpointer = Endpointer()
        self._blocks: list[Block] = []
        self._begun: int | None = None  # index of the first block
        self._ended: int | None = None  # index of the block after which there was no sound, for now

    def take(self, block: Block) -> bool:
        """Take one block; gives whether the utterance is over. Raises CommandError when there is none."""
        self._blocks.append(block)
        count = len(self._blocks)
        event = self._endpointer.feed(block)
        if isinstance(event, Started):
            self._begun = count - 1 if self._begun is None else self._begun
            self._ended = None
        elif isinstance(event, Ended):
            self._ended = count
        if self._begun is None:
            if count * BLOCK / RATE > PATIENCE:
                raise CommandError(f"cannot hear anybody: {PATIENCE:.0f} s of quiet; see that the microphone is not muted")
            return False
        paused = self._ended is not None and (count - self._ended) * BLOCK / RATE > PAUSE
        return paused or (count - self._begun) * BLOCK / RATE > LONGEST

    def samples(self) -> Block:
        """The utterance, with a little of what was before."""
        assert self._begun is not None
        return np.concatenate(self._blocks[max(0, self._begun - round(LEAD * RATE / BLOCK)) :])


@asynccontextmanager
async def _recording(device: str) -> AsyncIterator[AsyncIterator[Block]]:
    program = shutil.which("arecord")
    if program is None:
        raise CommandError("cannot record: there is no arecord; install the Debian package alsa-utils, or give --file WAV")
    words = ["-q", "-D", device, "-t", "raw", "-f", "S16_LE", "-r", str(RATE), "-c", "1"]
    pipe = asyncio.subprocess.PIPE
    process = await asyncio.create_subprocess_exec(program, *words, stdin=asyncio.subprocess.DEVNULL, stdout=pipe, stderr=pipe)
    try:
        yield _blocks(process, device)
    finally:
        if process.returncode is None:
            process.terminate()
        try:
            await asyncio.wait_for(process.communicate(), END)  # reads what is left: asyncio waits for that too
        except TimeoutError:
            process.kill()
            await process.communicate()


async def _blocks(process: asyncio.subprocess.Process, device: str) -> AsyncIterator[Block]:
    assert process.stdout is not None
    assert process.stderr is not None
    try:
        await asyncio.wait_for(process.stdout.readexactly(2 * round(SETTLING * RATE)), SETTLING + SILENT)
        while True:
            data = await asyncio.wait_for(process.stdout.readexactly(2 * BLOCK), SILENT)
            yield np.frombuffer(data, dtype="<i2")
    except TimeoutError:
        raise CommandError(f"cannot record: the device {device} gives no sound; see arecord -L, or give --file WAV") from None
    except asyncio.IncompleteReadError:
        said = (await process.stderr.read()).decode(errors="replace").strip().splitlines()
        why = said[-1] if said else "arecord has ended"
        raise CommandError(f"cannot record from {device}: {why}; see arecord -l for microphones, or give --file WAV") from None
