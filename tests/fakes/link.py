"""The link, the platform and the mail server behind it, in memory."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from rapp_core.errors import CoreError, Refused, Unreachable
from rapp_core.ports import Undelivered


class FakeLink:
    """Implements `ports.Hop`: packages lie in `shelf` by name; `away` makes it unreachable; `errors` fail one service.

    `answers` has results of services by name, or functions of the arguments; `kept` the runs that were said to live.
    """

    def __init__(self, shelf: Mapping[str, Path] | None = None, catalogue: list[dict[str, Any]] | None = None) -> None:
        self.shelf = dict(shelf or {})
        self.catalogue = catalogue or []
        self.away = False
        self.errors: dict[str, CoreError] = {}
        self.answers: dict[str, Any] = {}
        self.asked: list[tuple[str, dict[str, Any]]] = []
        self.kept: list[str] = []
        self.undelivered: Undelivered | None = None

    @property
    def present(self) -> bool:
        return not self.away

    def names(self) -> list[str]:
        return [name for name, _ in self.asked]

    def keep(self, run: str) -> None:
        self.kept.append(run)

    def request(self, name: str, arguments: Mapping[str, Any], timeout: float, cut: Callable[[], bool] = lambda: False) -> Any:
        self.asked.append((name, dict(arguments)))
        if self.away:
            raise Unreachable("cannot reach the link: it is away")
        if name in self.errors:
            raise self.errors[name]
        if name in self.answers:
            answer = self.answers[name]
            result = answer(arguments) if callable(answer) else answer
            if cut():
                raise Refused("cannot finish: it was stopped")
            return result
        if name == "install":
            return self._install(arguments["name"])
        catalogue = {"rapps": self.catalogue}
        return {"register": {"registered": True, "lease": 30}, "list_rapps": catalogue, "mail_told": {"told": True}}[name]

    def _install(self, name: str) -> dict[str, Any]:
        if name not in self.shelf:
            raise Refused(f"cannot install {name}: the store does not have it")
        return {"name": name, "version": "1.0.0", "path": str(self.shelf[name]), "installed": True}
