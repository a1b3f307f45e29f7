"""The path the robot has walked, as it measured it: asked for while it walks; and what else is done meanwhile."""

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rapp_api import Pose, RappError, navigation

_log = logging.getLogger(__name__)
EVERY = 0.5  # s between two poses


class Track:
    """Poses in the map, in their order."""

    def __init__(self) -> None:
        self.poses: list[Pose] = []

    def note(self) -> Pose:
        """Ask where the robot is, and remember it."""
        pose = navigation.get_robot_pose()
        self.poses.append(pose)
        return pose

    @contextmanager
    def followed(self) -> Iterator[None]:
        """While the robot walks."""
        over = threading.Event()

        def follow() -> None:
            while not over.wait(EVERY):
                self.note()

        with beside(follow):
            try:
                yield
            finally:
                over.set()


@contextmanager
def beside(work: Callable[[], object]) -> Iterator[None]:
    """Have something done meanwhile, and wait for it at the end; what goes wrong with it is logged."""

    def do() -> None:
        try:
            work()
        except RappError as error:
            _log.warning("%s", error)

    thread = threading.Thread(target=do, daemon=True)
    thread.start()
    try:
        yield
    finally:
        thread.join()
