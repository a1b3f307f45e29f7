"""The path the robot has walked, as it measured it: asked for while it walks."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from rapp_api import Pose, RappError, navigation

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
        follower = threading.Thread(target=self._follow, args=(over,), daemon=True)
        follower.start()
        try:
            yield
        finally:
            over.set()
            follower.join()

    def _follow(self, over: threading.Event) -> None:
        while not over.wait(EVERY):
            try:
                self.note()
            except RappError:
                return  # who walks hears of it, too
