"""A core agent for hazard_detection's tests: at once where it walks; what it sees is rendered from where it then truly stands."""

import asyncio
import importlib.util
import json
import math
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from fakes.rendered_room import RenderedRoom
from rapp_api import Pose
from rapp_api.fake_body import Image, _compose
from rapp_api.testing import FakeCoreAgent
from rapp_cloud.services import sight

STORE = Path(__file__).parents[2] / "store" / "hazard_detection"


class SeeingRobot(FakeCoreAgent):
    """`door` is in degrees, `lamp` from 0 to 1; where the robot truly is is `true`, where it believes to be `pose`."""

    def __init__(self, room: RenderedRoom, start: Pose, door: float, lamp: float, **wishes: Any) -> None:
        super().__init__(package=STORE / "dynamic", agent_services=cloud_agent_services(), **wishes)
        self.room, self.door, self.lamp = room, door, lamp
        self._origin = start  # where the origin of its map truly is
        self._head = (0.0, 0.0)
        self.views: list[tuple[Pose, tuple[float, float]]] = []

    @property
    def true(self) -> Pose:
        """Where it is in the room."""
        return _compose(self._origin, self.pose)

    def set_global_pose(self, pose: Pose) -> None:
        """Its map moves, it does not."""
        true = self.true
        super().set_global_pose(pose)
        turn = true.theta - pose.theta
        cos, sin = math.cos(turn), math.sin(turn)
        self._origin = Pose(true.x - cos * pose.x + sin * pose.y, true.y - sin * pose.x - cos * pose.y, turn)

    def move_joint(self, joints: Any, angles: Any, speed: float) -> None:
        """Turn the head too."""
        super().move_joint(joints, angles, speed)
        self._head = (self.joints["HeadYaw"], self.joints["HeadPitch"])

    def look_at_point(self, x: float, y: float, z: float) -> None:
        """Turn the head too."""
        super().look_at_point(x, y, z)
        self._head = self.room.gaze((0.0, 0.0, 0.0), (x, y, z))

    def get_transform(self, name: str, space: int) -> Any:
        """That of the camera."""
        super().get_transform(name, space)
        return self.room.camera(self._head).ravel().tolist()

    def capture_image(self, camera: str, resolution: int) -> tuple[int, int, bytes]:
        """What is to be seen."""
        super().capture_image(camera, resolution)
        self.views.append((self.true, self._head))
        picture = self.view(self.true, self._head, resolution)
        return picture.shape[1], picture.shape[0], picture.tobytes()

    def view(self, true: Pose, head: tuple[float, float], resolution: int) -> Image:
        """What is seen from somewhere."""
        stand = (true.x, true.y, true.theta)
        return self.room.picture(stand, None, math.radians(self.door), self.lamp, resolution, head)


class Repository:
    """The repository agent, called as a cloud agent does; it looks at the pictures with the platform's own services."""

    async def call(self, name: str, args: Mapping[str, Any], timeout: float = 30.0) -> Any:
        """Call one of those that the cloud agent's package names."""
        del timeout
        assert name in json.loads((STORE / "cloud" / "package.json").read_text())["rapp"]["permissions"]["cloud"]
        found = {item.name: item for item in sight.sight_services()}[name]
        return await asyncio.to_thread(found.function, **args)


def cloud_agent() -> ModuleType:
    """The cloud agent's program, with the repository agent above."""
    spec = importlib.util.spec_from_file_location("hazard_detection_cloud_agent", STORE / "cloud" / "agent.py")
    assert spec is not None and spec.loader is not None
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)
    program.repository = Repository()
    return program


def cloud_agent_services() -> dict[str, Any]:
    """What it offers, as a FakeCoreAgent wants it."""
    program = cloud_agent()
    return {
        name: lambda args, name=name: json.loads(json.dumps(asyncio.run(getattr(program, name).function(**args))))
        for name in ("find_codes", "check")
    }
