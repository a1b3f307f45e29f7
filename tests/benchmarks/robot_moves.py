"""How well the robot goes where it is sent, stops when it is told to, and knows where its parts are."""

import math
import random
import statistics
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from stage import Matrix, Pose, Result, Stage, angle, matrix, settle

from rapp_api import RappError, navigation
from rapp_nao_sim.world.model import JOINTS

FAR = 0.05  # m, aim of a walk's end
ASKEW = 3.0  # degrees
PLACE, TURN = 0.001, 0.1  # m and degrees, aim of getTransform
AIM_STOP = 0.3  # s
STILL = (0.004, math.radians(1.0))  # m of torso and soles, and rad: a robot nearer than this to where it stays is still
POSTURES = (
    ("Stand", {}),
    ("StandInit", {"HeadYaw": 0.8, "HeadPitch": -0.3}),
    ("StandInit", {"LShoulderPitch": 0.2, "LElbowRoll": -1.0, "RShoulderRoll": -0.6, "RElbowYaw": 0.5}),
    ("StandZero", {}),
)


def walks(stage: Stage, rounds: int) -> list[Result]:
    """Squares of 1 m: each side and each corner is one walk."""
    navigation.take_predefined_posture("StandInit")
    ends: dict[str, list[tuple[float, float]]] = {"moveTo 1 m ahead": [], "moveTo 90° on the spot": []}
    clocks = stage.robot.room("getTime"), time.monotonic()
    for _ in range(rounds):
        ends["moveTo 1 m ahead"].append(end_of_walk(stage, 1.0, 0.0, 0.0))
        ends["moveTo 90° on the spot"].append(end_of_walk(stage, 0.0, 0.0, math.pi / 2))
    pace = (stage.robot.room("getTime") - clocks[0]) / (time.monotonic() - clocks[1])
    results = [
        Result(
            f"{what}: end pose, worst of {rounds}",
            f"{max(far for far, _ in found) * 100:.1f} cm, {max(askew for _, askew in found):.1f}°",
            f"≤ {FAR * 100:.0f} cm, {ASKEW:.0f}°",
            kept=all(far <= FAR and askew <= ASKEW for far, askew in found),
        )
        for what, found in ends.items()
    ]
    steady = Result("simulated s per s, while the robot walks", f"{pace:.3f}", "0.98 to 1.02", kept=0.98 <= pace <= 1.02)
    return [*results, steady]


def end_of_walk(stage: Stage, x: float, y: float, theta: float) -> tuple[float, float]:
    """How far from its goal, m, and how much askew, degrees, a walk has ended."""
    goal = matrix(stage.pose()) @ matrix((x, y, theta))
    try:
        navigation.move_to(x, y, theta)
    except RappError as error:
        print(f"bench robot: {error}", file=sys.stderr)
    settle()
    missed = np.linalg.inv(goal) @ matrix(stage.pose())
    return float(np.linalg.norm(missed[:2, 3])), angle(missed[:3, :3])


def transforms(stage: Stage) -> list[Result]:
    """All joints' frames in all spaces, in several postures, against the true ones. Before any walk: odometry drifts."""
    worst = dict.fromkeys(("torso", "world", "robot"), (0.0, 0.0))
    for posture, turned in POSTURES:
        navigation.take_predefined_posture(posture)
        if turned:
            navigation.move_joint(list(turned), list(turned.values()))
        settle()
        for joint in JOINTS:
            for number, space in enumerate(worst):
                missed = _missed(stage, joint, number, _space(stage, space))
                worst[space] = max(worst[space][0], missed[0]), max(worst[space][1], missed[1])
    return [
        Result(
            f"getTransform in the {space}'s frame, worst of {len(JOINTS) * len(POSTURES)}",
            f"{far * 1000:.2f} mm, {turn:.3f}°",
            f"≤ {PLACE * 1000:.0f} mm, {TURN:g}°",
            kept=far <= PLACE and turn <= TURN,
        )
        for space, (far, turn) in worst.items()
    ]


def _space(stage: Stage, space: str) -> Matrix:
    if space == "torso":
        return stage.link("torso")
    return matrix(stage.start if space == "world" else stage.pose())


def _missed(stage: Stage, joint: str, number: int, space: Matrix) -> tuple[float, float]:
    told = navigation.get_transform(joint, number)
    true = np.linalg.inv(space) @ stage.link(JOINTS[joint].child)
    return float(np.linalg.norm(told[:3, 3] - true[:3, 3])), angle(told[:3, :3].T @ true[:3, :3])


def stops(stage: Stage, rounds: int) -> list[Result]:
    """Walks ahead and back, each stopped after another while."""
    navigation.take_predefined_posture("StandInit")
    took = []
    chance = random.Random(4)
    for number in range(rounds):
        took.append(stop_of_walk(stage, 1.5 if number % 2 == 0 else -1.5, chance.uniform(2.0, 4.0)))
        settle()
    words = f"{max(took):.2f} s (median {statistics.median(took):.2f})"
    return [
        Result(
            f"moveStop in a walk: from request to still, worst of {rounds}", words, f"≤ {AIM_STOP} s", kept=max(took) <= AIM_STOP
        )
    ]


def stop_of_walk(stage: Stage, x: float, after: float) -> float:
    """Seconds from the request until the robot moved no more."""
    walk = threading.Thread(target=_walk, args=(x,), name="walk", daemon=True)
    walk.start()
    time.sleep(after)
    with _watched(stage) as seen:
        asked = time.monotonic()
        navigation.move_stop()
        walk.join(10)
        time.sleep(1.0)
    last = seen[-1][1:]
    moving = [at for at, *place in seen if not _near(place, last)]
    return max([asked, *moving]) - asked


def _walk(x: float) -> None:
    try:
        navigation.move_to(x, 0.0, 0.0)
    except RappError as error:
        if "stopped" not in str(error):
            print(f"bench robot: {error}", file=sys.stderr)


Sight = tuple[float, Pose, tuple[float, ...]]


@contextmanager
def _watched(stage: Stage) -> Iterator[list[Sight]]:
    """What is seen of soles and torso meanwhile, and when; complete afterwards."""
    seen: list[Sight] = []
    enough = threading.Event()

    def watch() -> None:
        while not enough.wait(0.005):
            at = time.monotonic()
            seen.append((at, stage.pose(), tuple(stage.link("torso")[:3, 3])))

    watcher = threading.Thread(target=watch, name="watch", daemon=True)
    watcher.start()
    try:
        yield seen
    finally:
        enough.set()
        watcher.join(5)


def _near(place: list[tuple[float, ...]], last: tuple[tuple[float, ...], ...]) -> bool:
    soles, torso = place
    far = max(math.dist(soles[:2], last[0][:2]), math.dist(torso, last[1]))
    return far < STILL[0] and abs(soles[2] - last[0][2]) < STILL[1]
