"""A screen without a display: Debian's Xvfb, whose picture is in a file."""

import os
import select
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import numpy.typing as npt

READY = 30.0  # s
SIZE = (1024, 768)  # px; that of pybullet's window


class Screen:
    """A running X server; `name` is what DISPLAY is set to."""

    def __init__(self, process: subprocess.Popen[bytes], name: str, picture: Path) -> None:
        self.process = process
        self.name = name
        self._picture = picture

    def look(self) -> npt.NDArray[np.uint8]:
        """What is on the screen: height x width x BGR."""
        content = self._picture.read_bytes()
        fields = np.frombuffer(content, ">u4", 25)  # struct _xwd_file_header, see X11/XWDFile.h
        begin, width, height, line, colours = (int(fields[at]) for at in (0, 4, 5, 12, 19))
        pixels = np.frombuffer(content, np.uint8, line * height, begin + 12 * colours)
        return pixels.reshape(height, line // 4, 4)[:, :width, :3]


@contextmanager
def a_screen(folder: Path) -> Iterator[Screen]:
    """A screen of its own number; its files go to `folder`."""
    reading, writing = os.pipe()
    size = "{}x{}x24".format(*SIZE)
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", size, "-fbdir", str(folder), "-nolisten", "tcp"]
    with (folder / "xvfb.log").open("wb") as log:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, pass_fds=(writing,))
    os.close(writing)
    try:
        with os.fdopen(reading) as number:
            assert select.select([number], [], [], READY)[0], (folder / "xvfb.log").read_text()
            name = number.readline().strip()
        assert name, (folder / "xvfb.log").read_text()
        yield Screen(process, f":{name}", folder / "Xvfb_screen0")
    finally:
        process.terminate()
        try:
            process.wait(READY)
        finally:
            process.kill()
