"""What cannot be done in the simulated robot; texts begin "cannot" and say the next step where there is one."""


class SimError(Exception):
    """Root of the simulator's errors, but for those of the world's processes (`world.errors`)."""


class StartError(SimError):
    """The simulator cannot start or go on: its process ends with the text."""
