"""The core agent as a RApp sees it (port), and which one this process talks to."""

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol

from rapp_api.errors import Bug
from rapp_api.poses import Pose


class CoreAgent(Protocol):
    """The core agent's services (deliverable section 4.5). Calls suspend the caller until the reply (paper Figs 9 to 12)."""

    def say(self, text: str, language: str) -> None:
        """Say a text; language is a code such as "en"."""

    def recognize(self, dictionary: Sequence[str], timeout: float) -> str:
        """Recognise one word of the dictionary; "Empty" when none was. `timeout` in s, 0 for the core agent's own."""

    def record(self, duration: float) -> str:
        """Record for `duration` s; gives the path of the Ogg file."""

    def record_until_silence(self, path: str, waiting_time: float, microphone_energy: int) -> str:
        """Record until it was quieter than `microphone_energy` for `waiting_time` s; gives the path of the Ogg file."""

    def play_audio(self, path: str, position: float, volume: float, balance: float, loop: bool) -> None:
        """Play a file."""

    def move_to(self, x: float, y: float, theta: float) -> None:
        """Walk to a pose in the frame of the start, m, m, rad."""

    def move_vel(self, x: float, y: float, theta: float) -> str:
        """Begin to walk with a velocity, m/s, m/s, rad/s; gives why the last such walk has ended by itself."""

    def move_stop(self) -> str:
        """Stop all motion; gives why the last walk with a velocity has ended by itself."""

    def move_joint(self, joints: Sequence[str], angles: Sequence[float], speed: float) -> None:
        """Move joints to angles, rad; `speed` is a share, 0 for the core agent's own."""

    def take_posture(self, posture: str, speed: float) -> None:
        """Take a posture; `speed` is a share, 0 for the core agent's own."""

    def look_at_point(self, x: float, y: float, z: float) -> None:
        """Look at a point in base_link, m."""

    def rest(self, posture: str) -> None:
        """Rest in a posture; "" for the core agent's own."""

    def move_along_path(self, path: Sequence[Pose]) -> None:
        """Walk along poses."""

    def set_global_pose(self, pose: Pose) -> None:
        """Tell where the robot is in the map."""

    def get_robot_pose(self) -> Pose:
        """Where the robot is in the map."""

    def get_transform(self, name: str, space: int) -> Sequence[float]:
        """The matrix of a part in a space (0 torso, 1 world, 2 robot), row by row."""

    def capture_image(self, camera: str, resolution: int) -> tuple[int, int, bytes]:
        """Width, height and BGR data of a picture."""

    def set_camera_param(self, camera: int, parameter: int, value: int) -> None:
        """Set a parameter of a camera."""

    def set_camera_params(self, camera: int, parameters: Sequence[int], values: Sequence[int]) -> list[bool]:
        """Set parameters of a camera; whether each was taken."""

    def action_client(self, name: str) -> Any:
        """A client of the action of that name, as actionlib.SimpleActionClient."""

    def cloud_call(self, service: str, arguments: dict[str, Any], timeout: float, agent: bool) -> Any:
        """Call a HOP service of the repository agent, or of this RApp's cloud agent; gives its JSON result.

        A `Path` among the arguments is sent as a file.
        """

    def stop_cloud_agent(self) -> bool:
        """Have this RApp's cloud agent stopped; whether there was one."""

    def send_mail(self, recipients: Sequence[str], subject: str, body: str, attachment: str) -> str:
        """Send a mail; gives "delivered", "kept", "locked" or "unknown" (see `rapp_api.cloud.send_mail_wait`)."""

    def keep(self, name: str, data: bytes) -> str:
        """Keep a file beyond this run; gives where."""

    def pause(self, seconds: float) -> None:
        """Let time pass; the core agent is told that the dynamic agent means to wait."""


class Activity:
    """What the dynamic agent's own loop does; the heartbeat carries it, so that a standstill is seen.

    Only the loop's own thread counts: a thread beside it must not hide that the loop hangs.
    """

    def __init__(self) -> None:
        self.count = 0
        self.waits = False
        """Whether the loop waits for a core service to answer."""
        self._loop: int | None = None

    def begin(self) -> None:
        """Let the calling thread be the loop."""
        self._loop = threading.get_ident()

    def moved(self) -> None:
        """Count one step of the loop, or one call it has finished."""
        if self._is_loop():
            self.count += 1

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Around a call of a core service."""
        self.waits = self.waits or self._is_loop()
        try:
            yield
        finally:
            if self._is_loop():
                self.waits = False
            self.moved()

    def _is_loop(self) -> bool:
        return threading.get_ident() == self._loop


activity = Activity()
"""The count of this process."""

_current: list[CoreAgent] = []


def use(core: CoreAgent) -> Callable[[], None]:
    """Let this process talk to `core`; gives the function that ends that."""
    _current.append(core)
    return lambda: _current.remove(core)


def current() -> CoreAgent:
    """The core agent of this process; raises Bug outside a RApp's run."""
    if not _current:
        raise Bug("cannot reach a core agent: this program was not started by one; use rapp_api.testing to try it by itself")
    return _current[-1]
