"""ALVideoDevice: the pictures of the two cameras, and their settings, after NAOqi 2.1."""

import math
import time
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import qi

from rapp_nao_sim.modules.video_clients import Client, Clients, Dials
from rapp_nao_sim.naoqi import Module, NaoqiError, quick, working
from rapp_nao_sim.world import cameras
from rapp_nao_sim.world.cameras import CAMERAS, FASTEST, HIGH, LAYERS, PARAMETERS, SIZES, WIDE, Settings
from rapp_nao_sim.world.views import Shot

_MT9M114 = 2  # NAOqi's number of the camera's model
# Width, height, layers, colour space, seconds, microseconds, bytes, camera, angles of the left, top, right, bottom edge. A tuple
# where a robot gives a list: bytes pass only where their type is declared.
_IMAGE = "+(iiiiiiriffff)"


class World(Protocol):
    """What the cameras need of WorldClient."""

    def shot(self, camera: int, resolution: int, settings: Settings, colour: int) -> Shot: ...  # noqa: D102 - as WorldClient


def _giving_image(method: Callable[..., Any]) -> Callable[..., Any]:
    bound: Callable[..., Any] = qi.bind(_IMAGE, ["s"], method.__name__)(working(method))
    return bound


@qi.multiThreaded()
class ALVideoDevice(Module):
    """Cameras 0 (top) and 1 (bottom). Subscribe, get pictures by the handle, unsubscribe.

    As NAOqi: a subscription that cannot be has an empty handle, a picture for an unknown handle is None, a parameter that cannot be
    set gives false. A picture asked for sooner than the subscription's rate allows is waited for.
    """

    def __init__(self, world: World, dials: Mapping[int, Dials]) -> None:
        """`dials` of each camera, which others use too."""
        self.__world = world
        self.__clients = Clients()
        self.__dials = dials
        self.__active = 0

    def subscribeCamera(self, name: str, camera: int, resolution: int, colour: int, rate: int) -> str:  # noqa: N802
        """Begin to use a camera; gives the handle: name_0, or the next free one to name_7."""
        return self.__clients.add(name, camera, resolution, colour, rate)

    def subscribe(self, name: str, resolution: int, colour: int, rate: int) -> str:
        """As subscribeCamera, with the active camera."""
        return self.__clients.add(name, self.__active, resolution, colour, rate)

    def unsubscribe(self, handle: str) -> bool:
        """End a subscription; gives whether there was one."""
        return self.__clients.remove(handle)

    def unsubscribeAllInstances(self, name: str) -> bool:  # noqa: N802
        """End all subscriptions with a name."""
        return self.__clients.remove_all(name)

    def getSubscribers(self) -> list[str]:  # noqa: N802
        """All handles."""
        return self.__clients.handles()

    @_giving_image
    def getImageRemote(self, handle: str) -> tuple[Any, ...] | None:  # noqa: N802
        """The next picture: width, height, layers, colour space, s, us, bytes, camera, angles of left, top, right, bottom edge."""
        client = self.__clients.find(handle)
        if client is None:
            return None
        time.sleep(self.__clients.wait(client))
        camera, resolution, colour = client.camera, client.resolution, client.colour
        dials = self.__dials[camera]
        shot = self.__world.shot(camera, resolution, dials.settings(), colour)
        dials.exposure = round(shot.exposure * PARAMETERS[cameras.EXPOSURE].default)
        when = (int(shot.when), int(shot.when % 1 * 1e6))
        edges = (WIDE / 2, HIGH / 2, -WIDE / 2, -HIGH / 2)
        return (*SIZES[resolution], LAYERS[colour], colour, *when, shot.data, camera, *edges)

    def releaseImage(self, handle: str) -> bool:  # noqa: N802
        """Give a picture back; gives whether there is such a subscription."""
        return self.__clients.find(handle) is not None

    def getCameraIndexes(self) -> list[int]:  # noqa: N802
        """The numbers of the cameras."""
        return list(CAMERAS)

    @quick
    def getCameraName(self, camera: int) -> str:  # noqa: N802
        """CameraTop or CameraBottom."""
        return CAMERAS[self.__camera(camera)].name

    @quick
    def getCameraModel(self, camera: int) -> int:  # noqa: N802
        """2: MT9M114."""
        return _MT9M114 if self.__camera(camera) in CAMERAS else 0

    @quick
    def getActiveCamera(self, *handle: str) -> int:  # noqa: N802
        """The camera of a subscription; without a handle, that of subscriptions which name none."""
        return self.__client(handle[0]).camera if handle else self.__active

    @quick
    def setActiveCamera(self, *args: Any) -> bool:  # noqa: N802
        """(camera) or (handle, camera): switch; false for an unknown camera."""
        if args[-1] not in CAMERAS:
            return False
        if len(args) > 1:
            self.__client(args[0]).camera = args[-1]
        else:
            self.__active = args[-1]
        return True

    @quick
    def getResolution(self, handle: str) -> int:  # noqa: N802
        """Of a subscription."""
        return self.__client(handle).resolution

    @quick
    def setResolution(self, handle: str, resolution: int) -> bool:  # noqa: N802
        """Of a subscription; false for an unknown one."""
        client = self.__client(handle)
        if resolution in SIZES:
            client.resolution = resolution
        return resolution in SIZES

    @quick
    def getColorSpace(self, handle: str) -> int:  # noqa: N802
        """Of a subscription."""
        return self.__client(handle).colour

    @quick
    def setColorSpace(self, handle: str, colour: int) -> bool:  # noqa: N802
        """Of a subscription; false for an unknown one."""
        client = self.__client(handle)
        if colour in LAYERS:
            client.colour = colour
        return colour in LAYERS

    @quick
    def getFrameRate(self, which: str | int) -> int:  # noqa: N802
        """Pictures per second of a subscription, or of a camera: that of its fastest subscription."""
        return self.__client(which).rate if isinstance(which, str) else self.__used(which, cameras.RATE)

    @quick
    def setFrameRate(self, handle: str, rate: int) -> bool:  # noqa: N802
        """Of a subscription; false beyond 1 to 30."""
        client = self.__client(handle)
        if not isinstance(rate, int) or not 1 <= rate <= FASTEST:
            return False
        client.rate = rate
        return True

    @quick
    def getParameter(self, camera: int, number: int) -> int:  # noqa: N802
        """The value of a camera's parameter."""
        return self.__get(self.__camera(camera), number)

    @quick
    def setParameter(self, camera: int, number: int, value: int) -> bool:  # noqa: N802
        """Set a camera's parameter; gives whether it is set."""
        return self.__set(self.__camera(camera), number, value)

    @quick
    def getParameterRange(self, camera: int, number: int) -> list[int]:  # noqa: N802
        """Least, greatest and first value."""
        parameter = self.__parameter(self.__camera(camera), number)
        return [parameter.least, parameter.most, parameter.default]

    @quick
    def setParameterToDefault(self, camera: int, number: int) -> bool:  # noqa: N802
        """Set a parameter back."""
        return self.__dials[self.__camera(camera)].reset(number)

    @quick
    def setAllParametersToDefault(self, camera: int) -> bool:  # noqa: N802
        """Set all of a camera's parameters back."""
        return self.__dials[self.__camera(camera)].reset()

    @quick
    def getCameraParameter(self, handle: str, number: int) -> int:  # noqa: N802
        """As getParameter, of a subscription's camera."""
        return self.__get(self.__client(handle).camera, number)

    @quick
    def setCameraParameter(self, handle: str, number: int, value: int) -> bool:  # noqa: N802
        """As setParameter, of a subscription's camera."""
        return self.__set(self.__client(handle).camera, number, value)

    @quick
    def getCameraParameterRange(self, handle: str, number: int) -> list[int]:  # noqa: N802
        """As getParameterRange, of a subscription's camera."""
        parameter = self.__parameter(self.__client(handle).camera, number)
        return [parameter.least, parameter.most, parameter.default]

    @quick
    def setCameraParameterToDefault(self, handle: str, number: int) -> bool:  # noqa: N802
        """As setParameterToDefault, of a subscription's camera."""
        return self.__dials[self.__client(handle).camera].reset(number)

    @quick
    def setAllCameraParametersToDefault(self, handle: str) -> bool:  # noqa: N802
        """As setAllParametersToDefault, of a subscription's camera."""
        return self.__dials[self.__client(handle).camera].reset()

    @quick
    def getParam(self, number: int, *camera: int) -> int:  # noqa: N802
        """Old form of getParameter; without a camera, of the active one."""
        return self.__get(self.__camera(camera[0] if camera else self.__active), number)

    @quick
    def setParam(self, number: int, value: int, *camera: int) -> bool:  # noqa: N802
        """Old form of setParameter; without a camera, of the active one."""
        return self.__set(self.__camera(camera[0] if camera else self.__active), number, value)

    @quick
    def getHorizontalFOV(self, camera: int) -> float:  # noqa: N802
        """Rad, from the left to the right edge."""
        return WIDE if self.__camera(camera) in CAMERAS else 0.0

    @quick
    def getVerticalFOV(self, camera: int) -> float:  # noqa: N802
        """Rad, from the upper to the lower edge."""
        return HIGH if self.__camera(camera) in CAMERAS else 0.0

    @quick
    def getAngularPositionFromImagePosition(self, camera: int, place: list[float]) -> list[float]:  # noqa: N802
        """Angles (to the left, down) of a place in the picture (0 to 1 from the left, from above)."""
        self.__camera(camera)
        x, y = place
        return [math.atan(math.tan(WIDE / 2) * (1 - 2 * x)), math.atan(math.tan(HIGH / 2) * (2 * y - 1))]

    @quick
    def getImagePositionFromAngularPosition(self, camera: int, angles: list[float]) -> list[float]:  # noqa: N802
        """The reverse of getAngularPositionFromImagePosition."""
        self.__camera(camera)
        left, down = angles
        return [0.5 - math.tan(left) / math.tan(WIDE / 2) / 2, 0.5 + math.tan(down) / math.tan(HIGH / 2) / 2]

    @quick
    def resolutionToSizes(self, resolution: int) -> list[int]:  # noqa: N802
        """Width and height of a resolution, [-1, -1] for an unknown one."""
        return list(SIZES.get(resolution, (-1, -1)))

    def sizesToResolution(self, width: int, height: int) -> int:  # noqa: N802
        """The resolution with a width and height, -1 for an unknown one."""
        return next((number for number, size in SIZES.items() if size == (width, height)), -1)

    def __client(self, handle: str) -> Client:
        client = self.__clients.find(handle)
        if client is None:
            raise NaoqiError(f"cannot find the subscription {handle!r}; subscribed are {self.__clients.handles()}")
        return client

    def __camera(self, camera: int) -> int:
        if camera not in CAMERAS:
            raise NaoqiError(f"cannot find camera {camera!r}: known are 0 (top) and 1 (bottom)")
        return camera

    def __parameter(self, camera: int, number: int) -> cameras.Parameter:
        if number not in PARAMETERS:
            known = ", ".join(f"{key} {parameter.name}" for key, parameter in PARAMETERS.items())
            raise NaoqiError(f"cannot find parameter {number!r} of camera {camera}: known are {known}")
        return PARAMETERS[number]

    def __get(self, camera: int, number: int) -> int:
        self.__parameter(camera, number)
        if number == cameras.SELECT:
            return self.__active
        return self.__used(camera, number) if number in (cameras.RATE, cameras.RESOLUTION) else self.__dials[camera].get(number)

    def __set(self, camera: int, number: int, value: int) -> bool:
        done = self.__dials[camera].set(number, value)
        if done and number == cameras.SELECT:
            self.__active = value
        return self.__dials[camera].reset() if done and number == cameras.RESET and value else done

    def __used(self, camera: int, number: int) -> int:
        """Rate or resolution: the greatest that a subscription to the camera uses."""
        clients = self.__clients.of(self.__camera(camera))
        values = [client.rate if number == cameras.RATE else client.resolution for client in clients]
        return max(values, default=PARAMETERS[number].default)
