"""ALBroker: this program's place beside a robot, where the robot finds its modules."""

import contextlib
from typing import TYPE_CHECKING, Any

from naoqi import sessions

if TYPE_CHECKING:
    from naoqi.module import ALModule

_HERE = ("127.0.0.1", "localhost")
_ANYWHERE = ("", "0.0.0.0")


class ALBroker:
    """`ALBroker(name, ip, port, parent_ip, parent_port)`: listens at ip:port (0: any) for the robot at the parent's address.

    With a robot on this computer "0.0.0.0" means 127.0.0.1. Raises RuntimeError.
    """

    def __init__(self, name: str, ip: str, port: int, parent_ip: str, parent_port: int) -> None:
        self._name, self._parent = name, (parent_ip, parent_port)
        self._modules: list[ALModule] = []
        address = "127.0.0.1" if ip in _ANYWHERE and parent_ip in _HERE else ip or "0.0.0.0"
        try:
            self.session: Any = sessions.fresh(f"tcp://{parent_ip}:{parent_port}")
            self.session.listen(f"tcp://{address}:{port}")
        except RuntimeError as error:
            raise RuntimeError(f"ALBroker::createBroker\n\tcannot join {parent_ip}:{parent_port}: {error}") from error
        sessions.enter(self)

    def getName(self) -> str:  # noqa: N802 - NAOqi's spelling
        """The broker's name."""
        return self._name

    def getParentIP(self) -> str:  # noqa: N802
        """Where the robot is."""
        return self._parent[0]

    def getParentPort(self) -> int:  # noqa: N802
        """The robot's port."""
        return self._parent[1]

    def add(self, module: "ALModule") -> None:
        """Take note of a module."""
        self._modules.append(module)

    def remove(self, module: "ALModule") -> None:
        """Forget a module."""
        if module in self._modules:
            self._modules.remove(module)

    def shutdown(self) -> None:
        """Take all modules away and leave the robot; no effect a second time."""
        for module in list(self._modules):
            with contextlib.suppress(RuntimeError):  # the robot may be gone already
                module.exit()
        sessions.leave(self)
        self.session.close()
