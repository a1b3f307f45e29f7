"""What of the room the robot touches, but for the floor: known to the room, felt by the robot only where it has sensors."""

from collections.abc import Callable, Mapping

from rapp_nao_sim.world.body import Body


class Touching:
    """Looks at each moment; `names` gives what the room's solid bodies are called."""

    def __init__(self, body: Body, names: Callable[[], Mapping[int, str]]) -> None:
        self._body = body
        self._names = names
        self._touched: set[str] = set()

    def tick(self) -> None:
        """Look."""
        pressed = self._body.pressed()
        if pressed:
            names = self._names()
            self._touched |= {names[other] for other in pressed if other in names}

    def take(self) -> list[str]:
        """What it has touched since this was asked the last time."""
        touched, self._touched = self._touched, set()
        return sorted(touched)
