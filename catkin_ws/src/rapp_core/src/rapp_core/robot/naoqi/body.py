"""Virtual effector e_body on ALMotion."""

from rapp_core.robot.naoqi.connection import Connection

RESTING = 15.0  # s; the robot sits down before its motors are switched off


class NaoqiBody:
    """Stops motion and releases the robot; commanding motion comes with the navigation services."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def stop(self) -> None:
        """See `ports.Body`."""
        self._connection.call("ALMotion", "stopMove")

    def release(self) -> None:
        """See `ports.Body`."""
        self._connection.call("ALMotion", "rest", timeout=RESTING)
