"""ALPhotoCapture: pictures of the cameras as files, after NAOqi 2.1."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import qi

from rapp_nao_sim.files import Files, write
from rapp_nao_sim.modules.video_clients import Dials
from rapp_nao_sim.modules.video_device import World
from rapp_nao_sim.naoqi import Module, NaoqiError, quick, working
from rapp_nao_sim.world.cameras import BGR, CAMERAS, LUMA, SIZES

FORMATS = ("bmp", "jpeg", "jpg", "png", "ppm", "tif", "tiff")
COLOURS = {LUMA: "grey", BGR: "coloured"}
MOST = 1000  # pictures of one call


@qi.multiThreaded()
class ALPhotoCapture(Module):
    """Takes pictures with the settings that ALVideoDevice gives the cameras; clients write in the robot's own folders only."""

    def __init__(self, world: World, dials: Mapping[int, Dials], files: Files) -> None:
        self.__world = world
        self.__dials = dials
        self.__files = files
        self.__camera, self.__resolution, self.__colour, self.__format = 0, 1, BGR, "jpg"

    @quick
    def setCameraID(self, camera: int) -> None:  # noqa: N802
        """0 top, 1 bottom."""
        self.__camera = _one_of("camera", camera, CAMERAS)

    @quick
    def setResolution(self, resolution: int) -> None:  # noqa: N802
        """As in ALVideoDevice: 0 QQVGA, 1 QVGA, 2 VGA, 3 4VGA."""
        self.__resolution = _one_of("resolution", resolution, SIZES)

    @quick
    def setColorSpace(self, colour: int) -> None:  # noqa: N802
        """0 grey, 13 coloured (BGR)."""
        self.__colour = _one_of("colour space", colour, COLOURS)

    @quick
    def setPictureFormat(self, name: str) -> None:  # noqa: N802
        """Such as jpg or png."""
        self.__format = _one_of("format", name, FORMATS)

    @working
    def takePicture(self, folder: str, name: str, overwrite: bool = True) -> list[str]:  # noqa: N802
        """One picture into folder/name.FORMAT; gives its path in a list."""
        return [self.__take(Path(folder), name, overwrite)]

    @working
    def takePictures(self, count: int, folder: str, name: str, overwrite: bool = True) -> list[str]:  # noqa: N802
        """Pictures into folder/name_0.FORMAT, name_1.FORMAT, ...; gives their paths."""
        if not 1 <= count <= MOST:
            raise NaoqiError(f"cannot take {count} pictures: 1 to {MOST} are possible")
        return [self.__take(Path(folder), f"{name}_{number}", overwrite) for number in range(count)]

    def __take(self, folder: Path, name: str, overwrite: bool) -> str:
        path = self.__files.writable(str(folder / f"{name}.{self.__format}"))
        if path.exists() and not overwrite:
            raise NaoqiError(f"cannot write {path}: it is there; give another name, or let it be overwritten")
        settings = self.__dials[self.__camera].settings()
        shot = self.__world.shot(self.__camera, self.__resolution, settings, self.__colour)
        width, height = SIZES[self.__resolution]
        picture = np.frombuffer(shot.data, np.uint8).reshape(height, width, -1)
        _, data = cv2.imencode(f".{self.__format}", picture)
        write(path, data.tobytes())
        return str(path)


def _one_of(what: str, value: Any, known: Any) -> Any:
    if value not in known:
        raise NaoqiError(f"cannot use {what} {value!r}: known are {', '.join(map(str, known))}")
    return value
