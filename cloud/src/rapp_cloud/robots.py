"""Which robots are here: a registration is a lease that heartbeats renew. Pure but for the clock handed in."""

from collections.abc import Callable
from dataclasses import dataclass

from rapp_cloud.catalogue import RobotKind
from rapp_hop.errors import Refused

LEASE = 15.0  # seconds without a heartbeat after which a robot counts as gone


@dataclass(frozen=True)
class Lease:
    """One robot's."""

    kind: RobotKind
    until: float  # seconds of the clock


class Robots:
    """The registered robots of one platform."""

    def __init__(self, clock: Callable[[], float], lease: float = LEASE) -> None:
        """Begin with none.

        :param clock: seconds, never going back
        :param lease: seconds
        """
        self._clock = clock
        self.lease = lease
        self._robots: dict[str, Lease] = {}

    def register(self, robot: str, kind: RobotKind) -> None:
        """Note that a robot is here and what it is; again is fine."""
        self._robots[robot] = Lease(kind, self._clock() + self.lease)

    def heartbeat(self, robot: str) -> bool:
        """Renew a lease; false when there is none to renew, so that the robot registers again."""
        found = self._alive(robot)
        if found is None:
            return False
        self.register(robot, found.kind)
        return True

    def is_here(self, robot: str) -> bool:
        """Tell whether a robot's lease holds."""
        return self._alive(robot) is not None

    def kind_of(self, robot: str) -> RobotKind:
        """Return what a robot is.

        :raises Refused: when it is not registered now
        """
        found = self._alive(robot)
        if found is None:
            raise Refused(f"cannot serve {robot}: it is not registered, call register first")
        return found.kind

    def now(self) -> float:
        """Return the time of the clock by which leases run."""
        return self._clock()

    def leases(self) -> dict[str, Lease]:
        """Return all of them, those that have just ended too."""
        return dict(self._robots)

    def count(self) -> int:
        """Return how many are here."""
        now = self._clock()
        return sum(lease.until > now for lease in dict(self._robots).values())

    def resume(self, robot: str, kind: RobotKind, left: float) -> None:
        """Let a robot be here that another process has registered.

        :param left: seconds of its lease
        """
        self._robots[robot] = Lease(kind, self._clock() + min(left, self.lease))

    def _alive(self, robot: str) -> Lease | None:
        found = self._robots.get(robot)
        if found is not None and found.until <= self._clock():
            del self._robots[robot]
            return None
        return found
