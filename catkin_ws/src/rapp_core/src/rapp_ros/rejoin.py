"""Surviving a restart of the ROS master: a new one knows no node, and rospy registers only once."""

import logging
import threading

import rosgraph
import rospy
from rospy.impl.registration import Registration, get_registration_listeners, get_service_manager, get_topic_manager

from rapp_ros.master import MasterAwayError, ask

_log = logging.getLogger(__name__)
PERIOD = 0.5  # s between questions
PATIENCE = 2.0  # s for an answer


class Rejoining:
    """Asks the master whether it knows this node, and registers everything again when it does not. Ended by `close`."""

    def __init__(self) -> None:
        """Start to watch; the node has joined, and has registered at least one topic or service."""
        self._stop = threading.Event()
        self._away = False
        self._pid: int | None = None
        threading.Thread(target=self._watch, name="rejoining", daemon=True).start()

    def close(self) -> None:
        """End the watch; its thread is not waited for, as it may be waiting for the master."""
        self._stop.set()

    def _watch(self) -> None:
        while not self._stop.wait(PERIOD):
            try:
                forgotten = self._forgotten()
            except MasterAwayError as error:
                self._note(str(error), away=True)
                continue
            self._note("the ROS master answers again", away=False)
            if forgotten:
                _log.warning("the ROS master is a new one: registering again")
                _register_again()

    def _forgotten(self) -> bool:
        """Whether the master is another one than before, or does not know this node."""
        name, uri = rospy.get_name(), rosgraph.get_master_uri()
        _, _, pid = ask(uri, PATIENCE, "getPid", name)
        before, self._pid = self._pid, int(pid)
        return before not in (None, self._pid) or ask(uri, PATIENCE, "lookupNode", name, name)[0] != 1

    def _note(self, text: str, *, away: bool) -> None:
        if away != self._away:
            _log.warning("%s", text)
        self._away = away


def _register_again() -> None:
    """Tell rospy's registration thread of all topics and services as if they were new; it asks the master itself."""
    listeners = get_registration_listeners()
    for topic, kind in get_topic_manager().get_publications():
        listeners.notify_added(topic, kind, Registration.PUB)
    for topic, kind in get_topic_manager().get_subscriptions():
        listeners.notify_added(topic, kind, Registration.SUB)
    for service, uri in get_service_manager().get_services():
        listeners.notify_added(service, uri, Registration.SRV)
