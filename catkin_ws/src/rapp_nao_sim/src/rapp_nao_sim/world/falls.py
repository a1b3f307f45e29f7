"""Tells when the robot falls from its feet, and when it lies. Pure; rad, s."""

FALLING = 0.6  # of the torso's tilt: more than in any posture on the feet, and than it comes back from
_UPRIGHT = 0.35
_RECENT = 2.0  # s since it was upright on its feet
_REST = 0.3  # s of lying still
_LONGEST = 4.0  # s of a fall


class Falls:
    """Told of each moment; gives "falling" and "fallen" once each in a fall."""

    def __init__(self) -> None:
        self._upright = -_RECENT  # when it was
        self._began: float | None = None
        self._moved = 0.0  # when it moved last

    def watch(self, now: float, tilt: float, standing: bool, still: bool) -> str | None:
        """`standing`: on its feet; `still`: nothing moves."""
        if not still:
            self._moved = now
        if self._began is not None:
            if now - self._moved < _REST and now - self._began < _LONGEST:
                return None
            self._began = None
            return "fallen"
        if standing and tilt < _UPRIGHT:
            self._upright = now
        elif tilt > FALLING and now - self._upright < _RECENT:
            self._began, self._upright = now, -_RECENT
            return "falling"
        return None
