"""The port Hop on ROS: services rapp_hop/*, answered by the link over rosbridge (deliverable Fig. 10)."""

import contextlib
import json
import queue
import threading
import time
import uuid
from collections.abc import Callable, Mapping
from typing import Any

import rospy
from rapp_msgs.msg import HopEvent
from rapp_msgs.srv import HopRequest
from std_msgs.msg import String

from rapp_core.control.telling import Telling
from rapp_core.errors import KINDS, NOT_KNOWN, Bug, CoreError, Refused, Unreachable
from rapp_core.ports import Undelivered
from rapp_core.trace import Trace

SILENCE = 0.9  # s without a sign of life of the link after which it is gone
ASKING = 3.0  # s for the link to accept a job
STEP = 0.05  # s
GONE = "cannot reach the link: it is not running, or rosbridge is away"

Cut = Callable[[], bool]


class _Cut(Refused):
    """Whoever has asked does not want the answer any more."""


def _check(cut: Cut) -> None:
    if cut():
        raise _Cut("cannot finish: it was stopped")


class RosHop:
    """Each request is a job: accepted at once, ended by an event, by its time-out, or by the loss of the link."""

    def __init__(self, stop: threading.Event, trace: Trace) -> None:
        """All waiting ends as Unreachable when `stop` is set."""
        self._stop = stop
        self._trace = trace
        self._lock = threading.Lock()
        self._jobs: dict[str, queue.Queue[Any]] = {}
        self._alive = float("-inf")
        self._boot = ""  # of the link's process
        self._undelivered: Undelivered | None = None
        self._cancel = rospy.Publisher("rapp_hop/cancel", String, queue_size=10)
        self._runs = rospy.Publisher("rapp_hop/runs", String, queue_size=10)
        self._events = rospy.Subscriber("rapp_hop/events", HopEvent, self._take, queue_size=1000, tcp_nodelay=True)
        rospy.Subscriber("rapp_hop/alive", String, self._sign_of_life, queue_size=10, tcp_nodelay=True)

    @property
    def present(self) -> bool:
        """See `ports.Hop`."""
        return time.monotonic() - self._alive < SILENCE

    @property
    def undelivered(self) -> Undelivered | None:
        """See `ports.Hop`."""
        return self._undelivered if self.present else None

    def _reachable(self) -> bool:
        """Whether the link is there and its events would arrive: each topic is connected by itself."""
        return self.present and self._events.get_num_connections() > 0

    def keep(self, run: str) -> None:
        """See `ports.Hop`."""
        self._runs.publish(run)

    def request(self, name: str, arguments: Mapping[str, Any], timeout: float, cut: Cut = lambda: False) -> Any:
        """See `ports.Hop`."""
        deadline = time.monotonic() + timeout
        self._wait_present(min(deadline, time.monotonic() + 2 * SILENCE), cut)
        job = uuid.uuid4().hex
        events: queue.Queue[Any] = queue.Queue(maxsize=1000)
        with self._lock:
            self._jobs[job] = events
        tell = Telling(self._trace, name, arguments)
        try:
            tell.asked()
            boot = self._boot
            self._ask(name, job, json.dumps(arguments), timeout)
            return self._wait(name, events, deadline, tell, boot, cut)
        except _Cut:
            tell.cut()
            self._cancel.publish(job)
            raise
        except Unreachable as error:
            self._cancel.publish(job)
            error.reason = error.reason or NOT_KNOWN
            raise
        finally:
            with self._lock:
                del self._jobs[job]

    def _wait_present(self, until: float, cut: Cut) -> None:
        while not self._reachable():
            _check(cut)
            if time.monotonic() > until or self._stop.wait(STEP):
                raise Unreachable(GONE)

    def _ask(self, name: str, job: str, arguments: str, timeout: float) -> None:
        """Call the link's service in a thread of its own: rospy knows no time-out of a call.

        Not to be cut: the link knows nothing yet of the job, so a cancel would come before it.
        """
        answer: queue.Queue[Any] = queue.Queue(maxsize=1)

        def call() -> None:
            try:
                answer.put(rospy.ServiceProxy(f"rapp_hop/{name}", HopRequest)(job=job, arguments=arguments, timeout=timeout))
            except (rospy.ServiceException, rospy.ROSException, OSError) as error:
                answer.put(error)

        threading.Thread(target=call, name=f"hop {name}", daemon=True).start()
        until = time.monotonic() + ASKING
        outcome: Any = None
        while outcome is None:
            with contextlib.suppress(queue.Empty):
                outcome = answer.get(timeout=STEP)
            if outcome is None and time.monotonic() > until:
                raise Unreachable(f"{GONE} ({name} was not accepted in {ASKING:g} s)")
        if isinstance(outcome, Exception):
            raise Unreachable(f"{GONE} ({outcome})") from outcome
        if not outcome.accepted:
            raise Refused(outcome.message or f"cannot {name}: the link does not accept it")

    def _wait(self, name: str, events: "queue.Queue[Any]", deadline: float, tell: Telling, boot: str, cut: Cut) -> Any:
        while True:
            _check(cut)
            try:
                event = events.get(timeout=STEP)
            except queue.Empty:
                # A link that was started anew within its silence knows nothing of the job.
                if self._stop.is_set() or not self.present or self._boot != boot:
                    raise Unreachable(f"cannot {name}: the link was lost; try again later") from None
                if time.monotonic() > deadline:
                    raise Unreachable(f"cannot {name}: no answer in time; try again later") from None
                continue
            if event.kind == HopEvent.PROGRESS:
                tell.progress(event.phase)
            elif event.kind == HopEvent.FAILED:
                tell.failed(event.error)
                raise _error(event)
            else:
                return tell.answered(_result(name, event.result))

    def _take(self, event: Any) -> None:
        if event.kind == HopEvent.MESSAGE:
            self._trace.message("link", event.message)
            return
        with self._lock:
            events = self._jobs.get(event.job)
        if events is not None and not events.full():
            events.put_nowait(event)

    def _sign_of_life(self, message: Any) -> None:
        with contextlib.suppress(ValueError, TypeError, KeyError):
            sign = json.loads(message.data)
            self._boot = str(sign["boot"])
            mail = sign.get("undelivered")
            self._undelivered = Undelivered(str(mail["message_id"]), tuple(map(str, mail["recipients"]))) if mail else None
        self._alive = time.monotonic()


def _error(event: Any) -> CoreError:
    error = KINDS.get(event.error, Bug)(event.message)
    with contextlib.suppress(ValueError, TypeError, KeyError):
        error.reason = str(json.loads(event.result)["reason"])
    return error


def _result(name: str, text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError as error:
        raise Bug(f"cannot {name}: the link answered with what is no JSON ({error})") from error
