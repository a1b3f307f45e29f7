"""What the core agent's services cost beside NAOqi's own calls, and how fast the simulation can be."""

import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from stage import HALL, Result, Stage

from rapp_api import communication, navigation, vision
from rapp_nao_sim.world import postures, room
from rapp_nao_sim.world.body import Body
from rapp_nao_sim.world.bullet import connect
from rapp_nao_sim.world.furnishing import Furnishing
from rapp_nao_sim.world.motion import Motion
from rapp_nao_sim.world.physics import STEP
from rapp_nao_sim.world.process import WorldClient, WorldConfig

AIM_COST = 0.002  # s
AIM_SPEED = 5.0  # times real time
BRIGHTNESS = 0


def services(stage: Stage, calls: int) -> list[Result]:
    """Calls of services and of NAOqi in turn, so that a busy machine slows both."""
    call = stage.naoqi.call
    pairs: dict[str, tuple[Callable[[], Any], Callable[[], Any]]] = {
        "getTransform": (
            lambda: navigation.get_transform("CameraTop", 0),
            lambda: call("ALMotion", "getTransform", "CameraTop", 0, True),
        ),
        "getRobotPose": (navigation.get_robot_pose, lambda: call("ALMotion", "getRobotPosition", True)),
        "setCameraParam": (
            lambda: vision.set_camera_param(vision.TOP, BRIGHTNESS, 55),
            lambda: call("ALVideoDevice", "setParameter", 0, BRIGHTNESS, 55),
        ),
        "textToSpeech": (
            lambda: communication.text_to_speech("yes"),
            lambda: call("ALTextToSpeech", "say", "yes"),
        ),
    }
    return [_cost(name, *pair, calls) for name, pair in pairs.items()]


def _cost(name: str, service: Callable[[], Any], bare: Callable[[], Any], calls: int) -> Result:
    pairs = [(_took(service), _took(bare)) for _ in range(calls)]
    cost = statistics.median(one for one, _ in pairs) - statistics.median(other for _, other in pairs)
    alone = statistics.median(other for _, other in pairs)
    what = f"{name}: the service above NAOqi's own call, median of {calls}"
    return Result(
        what, f"{cost * 1000:.2f} ms", f"≤ {AIM_COST * 1000:.0f} ms", f"NAOqi alone {alone * 1000:.2f} ms", cost <= AIM_COST
    )


def _took(call: Callable[[], Any]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def speed() -> list[Result]:
    """Simulated seconds per second of a processor, of the whole simulation freely stepped; bare: pybullet's own steps."""
    bare = bare_steps()
    with WorldClient(WorldConfig(room=HALL, pace=0)) as world:
        world.set_posture("StandInit", 1.0)
        standing = _speed(world, lambda: time.sleep(2.0))
        walking = _speed(world, lambda: world.walk_to([(1.0, 0.0, 0.0)], 1.0, 0.02))
    return [
        Result(
            f"simulation stepped freely, {what}",
            f"{of_processor:.1f} times real time ({of_clock:.1f} by this machine's clock)",
            f"≥ {AIM_SPEED:.0f} times",
            f"pybullet alone {bare:.1f}",
            of_processor >= AIM_SPEED,
        )
        for what, (of_processor, of_clock) in {"standing": standing, "walking": walking}.items()
    ]


def _speed(world: WorldClient, pass_time: Callable[[], Any]) -> tuple[float, float]:
    assert world.pid is not None
    begun = world.clock(), _processor(world.pid), time.monotonic()
    pass_time()
    simulated, used, passed = world.clock() - begun[0], _processor(world.pid) - begun[1], time.monotonic() - begun[2]
    return simulated / used, simulated / passed


def _processor(pid: int) -> float:
    """Seconds of a processor that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def bare_steps(seconds: float = 10.0) -> float:
    """The same room and robot, standing, with nothing done but pybullet's steps: simulated seconds per second of a processor."""
    bullet, plan = connect(), room.load(HALL)
    bullet.setGravity(0, 0, -9.81)
    bullet.setTimeStep(STEP)
    body = Body(bullet, looks=False)
    Furnishing(bullet, plan, body.touches, lambda: None)
    Motion(bullet, body, postures.load(), lambda _number, _answer: None).begin("StandInit", (0.0, 0.0), 0.0)
    began = time.process_time()
    for _ in range(round(seconds / STEP)):
        bullet.stepSimulation()
    used = time.process_time() - began
    bullet.disconnect()
    return seconds / used
