"""What the core agent knows of the platform: registered or not, and its catalogue; kept up in the background."""

import logging
import threading
from dataclasses import replace
from typing import Any

from rapp_core.config import Config
from rapp_core.control.installed import Known, installed
from rapp_core.errors import CoreError
from rapp_core.ports import Hop

_log = logging.getLogger(__name__)
API_VERSION = "1.0"


class Platform:
    """Registers, and goes on trying while the platform is away; the robot listens meanwhile."""

    def __init__(self, hop: Hop, config: Config) -> None:
        self._hop = hop
        self._config = config
        self._stop = threading.Event()
        self._offered: dict[str, Known] = {}
        self._revoked: dict[str, Known] = {}  # were here; still understood, so that the link's refusal is said aloud
        self.changes = 0  # of what the platform offers
        self._registered = False
        self._thread: threading.Thread | None = None

    def register(self) -> bool:
        """Register and fetch the catalogue once; gives whether it worked. Later tries follow in the background."""
        worked = self.attempt()
        if self._thread is None:
            self._thread = threading.Thread(target=self._keep_up, name="platform", daemon=True)
            self._thread.start()
        return worked

    def close(self) -> None:
        """End the tries."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(1)

    def rapps(self) -> dict[str, Known]:
        """All RApps that can be asked for, by name; the installed form of one, by the words of the offered one too."""
        here, offered = self._installed(), self._offered
        for name in here.keys() & offered.keys():
            words = dict.fromkeys((*offered[name].keywords, *here[name].keywords))
            here[name] = replace(here[name], keywords=tuple(words))
        return {**self._revoked, **offered, **here}

    def runnable(self, name: str) -> Known | None:
        """The installed RApp when the platform offers no other version of it; it can be run without a download."""
        known, offered = self._installed().get(name), self._offered.get(name)
        return known if known is not None and (offered is None or offered.version == known.version) else None

    def attempt(self) -> bool:
        """Register unless that is done, and fetch the catalogue; gives whether it worked."""
        config = self._config
        robot = {"robot": config.name, "kind": config.kind, "api_version": API_VERSION}
        try:
            if not self._registered:
                self._hop.request("register", robot, config.register_timeout)
                self._registered = True
                _log.info("registered with the platform as %s", config.name)
            here = installed(config.home, config.language)
            catalogue = self._hop.request("list_rapps", {}, config.register_timeout)
            known = map(self._known, catalogue["rapps"])
            offered = {entry.name: entry for entry in known if entry is not None}
            revoked = {name: replace(here[name], path=None) for name in catalogue.get("revoked", ()) if name in here}
        except CoreError as error:
            _log.warning("not registered: %s", error)
            self._registered = False
            return False
        except (KeyError, TypeError, AttributeError) as error:
            _log.error("the platform's catalogue cannot be used: %r", error)
            return False
        self._revoked = {name: known for name, known in self._revoked.items() if name not in offered} | revoked
        if offered != self._offered:
            self._offered = offered
            self.changes += 1
        return True

    def _installed(self) -> dict[str, Known]:
        """Without what was revoked, should it still be on the disk."""
        found = installed(self._config.home, self._config.language).items()
        return {name: known for name, known in found if name not in self._revoked or known.version != self._revoked[name].version}

    def _known(self, entry: dict[str, Any]) -> Known | None:
        if not entry.get("compatible", True):
            _log.info("not for this robot: %s (%s)", entry["name"], "; ".join(entry.get("reasons", ())))
            return None
        return Known(entry["name"], entry["version"], tuple(entry["keywords"].get(self._config.language, ())), None)

    def _keep_up(self) -> None:
        while not self._stop.wait(self._pause()):
            self.attempt()

    def _pause(self) -> float:
        return self._config.catalogue_again if self._registered and self._offered else self._config.register_again
