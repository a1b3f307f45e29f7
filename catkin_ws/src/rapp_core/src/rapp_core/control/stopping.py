"""How a person stops the robot: a hand on the middle of its head, or a word (`words.STOP`); from s4 to s10 and in s12."""

import logging
import threading

from rapp_core.control.attention import Attention
from rapp_core.errors import CoreError, Unreachable
from rapp_core.ports import Robot
from rapp_core.services.calls import Call
from rapp_core.trace import Trace

PERIOD = 0.1  # s between two looks at the head
RETRY = 1.0  # s until a robot that is away is asked again
BY_PERSON = "the person has stopped it"

_log = logging.getLogger(__name__)


class Stopping:
    """Feels and hears in threads of its own, for NAOqi may take its time, and the lease is to be watched meanwhile.

    The head is looked at rather than subscribed to: each look shows, too, that the robot is there, and after the loss of the
    session the ears, which are subscribed, are asked for anew.
    """

    def __init__(self, robot: Robot, attention: Attention, trace: Trace) -> None:
        self._robot = robot
        self._attention = attention
        self._trace = trace
        self._lock = threading.Lock()
        self._over = threading.Event()
        self.call = Call()
        """Ends when the person stops the robot: for services that the core agent itself executes meanwhile."""

    def given(self) -> bool:
        """Whether the person has stopped the robot since `begin`."""
        return self.call.ended

    def begin(self) -> None:
        """The robot begins to do something for a person: feel and listen from now on."""
        self.end()
        with self._lock:
            self._over, self.call = threading.Event(), Call()
            threading.Thread(target=self._feel, args=(self.call, self._over), name="stopping", daemon=True).start()

    def end(self) -> None:
        """It has ended; no error when it had not begun."""
        self._over.set()  # before the lock, which is held while the robot is asked
        with self._lock:
            self._attention.ignore()

    def _feel(self, call: Call, over: threading.Event) -> None:
        attends, feels = False, True
        while not over.is_set():
            try:
                if feels and self._robot.feeling.touched() and not over.is_set():
                    self._end(call)
                    self._robot.voice.hush()
                    return
                if not over.wait(PERIOD):
                    attends = attends or self._attend(call, over)
            except Unreachable as error:
                _log.info("%s", error)
                attends = False
                over.wait(RETRY)
            except CoreError as error:
                _log.info("only a word stops the robot: %s", error)
                feels = False

    def _attend(self, call: Call, over: threading.Event) -> bool:
        """Listen for the word; what this robot cannot hear is not asked for again. Raises Unreachable."""
        with self._lock:
            if not over.is_set():
                try:
                    self._attention.attend(lambda word: self._called(call, word))
                except Unreachable:
                    raise
                except CoreError as error:
                    _log.warning("only a hand on its head stops the robot: %s", error)
        return True

    def _called(self, call: Call, word: str) -> None:
        if not call.ended:
            self._trace.heard(word)
            self._end(call)

    def _end(self, call: Call) -> None:
        self._trace.note(BY_PERSON)
        call.end(BY_PERSON)
