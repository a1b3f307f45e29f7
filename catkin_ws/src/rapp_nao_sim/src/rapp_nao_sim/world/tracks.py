"""Which joints are on their way, and which requests wait for them to arrive."""

from collections.abc import Callable, Collection, Iterable, Iterator

from rapp_nao_sim.world.moves import Track

Answer = Callable[[int, bool], None]  # number of a request, and whether it has reached what it asked for


class Tracks:
    """A track for each moving joint; `answer(number, reached)` when all joints of a request are there, or one will not be."""

    def __init__(self, answer: Answer) -> None:
        self._answer = answer
        self._tracks: dict[str, Track] = {}
        self._requests: dict[int, set[str]] = {}

    def __contains__(self, joint: object) -> bool:
        return joint in self._tracks

    def __iter__(self) -> Iterator[str]:
        return iter(self._tracks)

    def __len__(self) -> int:
        return len(self._tracks)

    def lead(self, joint: str, track: Track) -> None:
        """Send a joint along a track; who waits for it to end another one waits in vain."""
        self._fail(joint)
        self._tracks[joint] = track

    def expect(self, number: int, joints: Iterable[str]) -> None:
        """Let a request wait for joints to arrive."""
        self._requests[number] = set(joints)

    def expected(self) -> Iterator[tuple[int, Collection[str]]]:
        """The requests that wait, and for which joints."""
        return iter(self._requests.items())

    def stop(self, joint: str) -> None:
        """End a joint's track here."""
        if self._tracks.pop(joint, None) is not None:
            self._fail(joint)

    def angles(self, now: float) -> dict[str, float]:
        """Where the joints on their way shall be."""
        return {joint: track.at(now) for joint, track in self._tracks.items()}

    def arrive(self, now: float) -> None:
        """End the tracks that are over."""
        for joint, track in list(self._tracks.items()):
            if now >= track.end:
                del self._tracks[joint]
                self._arrived(joint)

    def _arrived(self, joint: str) -> None:
        for number, joints in list(self._requests.items()):
            joints.discard(joint)
            if not joints:
                del self._requests[number]
                self._answer(number, True)

    def _fail(self, joint: str) -> None:
        for number, joints in list(self._requests.items()):
            if joint in joints:
                del self._requests[number]
                self._answer(number, False)
