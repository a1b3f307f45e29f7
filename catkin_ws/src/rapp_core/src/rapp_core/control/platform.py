"""What the core agent knows of the platform: registered or not, and its catalogue; kept up in the background."""

import logging
import threading
from typing import Any

from rapp_core.config import Config
from rapp_core.control.installed import Known, installed
from rapp_core.errors import CoreError
from rapp_core.ports import Hop
from rapp_core.trace import Trace

_log = logging.getLogger(__name__)
API_VERSION = "1.0"


class Platform:
    """Registers, and goes on trying while the platform is away; the robot listens meanwhile."""

    def __init__(self, hop: Hop, config: Config, trace: Trace) -> None:
        self._hop = hop
        self._config = config
        self._trace = trace
        self._stop = threading.Event()
        self._offered: dict[str, Known] = {}
        self._registered = False
        self._thread = threading.Thread(target=self._keep_registered, name="platform", daemon=True)

    def register(self) -> bool:
        """Register and fetch the catalogue once; gives whether it worked. Later tries follow in the background."""
        worked = self._try()
        self._thread.start()
        return worked

    def close(self) -> None:
        """End the tries."""
        self._stop.set()

    def rapps(self) -> dict[str, Known]:
        """All RApps that can be asked for, installed ones first."""
        return {**self._offered, **installed(self._config.home, self._config.language)}

    def _try(self) -> bool:
        config = self._config
        robot = {"robot": config.name, "kind": config.kind, "api_version": API_VERSION}
        try:
            self._trace.message("core->repository register")
            self._hop.request("register", robot, config.register_timeout)
            catalogue = self._hop.request("list_rapps", {}, config.register_timeout)
        except CoreError as error:
            _log.warning("not registered: %s", error)
            return False
        self._offered = {known.name: known for known in map(self._known, catalogue["rapps"]) if known is not None}
        self._registered = True
        return True

    def _known(self, entry: dict[str, Any]) -> Known | None:
        if not entry.get("compatible", True):
            _log.info("not for this robot: %s (%s)", entry["name"], "; ".join(entry.get("reasons", ())))
            return None
        return Known(entry["name"], tuple(entry["keywords"].get(self._config.language, ())), None)

    def _keep_registered(self) -> None:
        while not self._stop.wait(self._config.register_again):
            if not self._registered or not self._offered:
                self._try()
