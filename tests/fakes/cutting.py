"""Cuts work on a disk off at every step: power gone (SIGKILL), or disk full from there on. A step is a call that changes the disk.

Each try is a process of its own; whoever uses this must have no threads.
"""

import builtins
import errno
import io
import json
import os
import shutil
import signal
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

TAKES_SPACE = ("mkdir", "open", "fsync", "rename", "replace", "symlink", "write", "utime", "chmod")
GIVES_SPACE = ("unlink", "rmdir")
Cut = Callable[[str], None]  # called before each step with its name


class Cutting:
    """A file that is written step by step."""

    def __init__(self, file: Any, cut: Cut) -> None:
        self._file, self._cut = file, cut

    def write(self, data: bytes) -> int:
        self._cut("write")
        return int(self._file.write(data))

    def __enter__(self) -> "Cutting":
        return self

    def __exit__(self, *error: object) -> None:
        self._file.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


def put_in(cut: Cut) -> None:
    """Have `cut` called before every step, in this process."""

    def before(name: str, work: Callable[..., Any], wanted: Callable[..., bool]) -> Callable[..., Any]:
        def cut_or_do(*words: Any, **more: Any) -> Any:
            if wanted(*words, **more):
                cut(name)
            return work(*words, **more)

        return cut_or_do

    for name in (*TAKES_SPACE[:1], *TAKES_SPACE[2:], *GIVES_SPACE):
        if name != "write":
            setattr(os, name, before(name, getattr(os, name), lambda *_, **__: True))
    os.open = before("open", os.open, lambda _path, flags, *_, **__: bool(flags & os.O_CREAT))
    writing = before("open", io.open, lambda _file, mode="r", *_, **__: isinstance(mode, str) and not mode.startswith("r"))
    io.open = builtins.open = writing
    plain = os.fdopen
    os.fdopen = lambda *words, **more: Cutting(plain(*words, **more), cut)  # type: ignore[assignment]


def cutter(how: str, step: int, seen: list[str]) -> Cut:
    """Cut at the step of this number; `how` is "killed" or "full"."""

    def cut(name: str) -> None:
        seen.append(name)
        if len(seen) <= step:
            return
        if how == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        elif name in TAKES_SPACE:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    return cut


def in_child(work: Callable[[], dict[str, Any]]) -> dict[str, Any] | None:
    """What `work` gives in a process of its own; None when that was killed."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        try:
            told = work()
        except BaseException:  # noqa: BLE001 (told to the test)
            told = {"fault": traceback.format_exc()}
        os.write(writing, json.dumps(told).encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        text = pipe.read()
    os.waitpid(child, 0)
    return dict(json.loads(text)) if text else None


def one_try(step: int, tried: Callable[[], dict[str, Any]], recovered: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """What came of a try cut off at a step, and of starting again after it, each in a process of its own."""
    came = in_child(tried)
    return {"step": step, "killed": came is None, **(came or {}), **(in_child(recovered) or {"fault": "killed twice"})}


def every_step(begin: Path, work: Path, cut_off: Callable[[int], dict[str, Any]]) -> None:
    """Cut off at one step after the other, each time in a copy of `begin`, until it comes to its end; prints what came of each."""
    step = 0
    while True:
        shutil.copytree(begin, work, symlinks=True)
        told = cut_off(step)
        shutil.rmtree(work)
        print(json.dumps(told), flush=True)
        if "fault" in told or (not told["killed"] and told["steps"] <= step):
            return
        step += 1
