"""Virtual effector e_body on ALMotion."""

from rapp_core.robot.naoqi.connection import Connection

MOMENT = 1.0  # s that are waited for the robot to rest; it goes on sitting down when nobody waits


class NaoqiBody:
    """Stops motion and releases the robot; commanding motion comes with the navigation services."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def stop(self) -> None:
        """See `ports.Body`."""
        self._connection.call("ALMotion", "stopMove")

    def release(self) -> None:
        """See `ports.Body`."""
        self._connection.start("ALMotion", "rest").wait(round(MOMENT * 1000))
