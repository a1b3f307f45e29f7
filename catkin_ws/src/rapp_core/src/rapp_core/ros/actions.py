"""The motions that take time as actions (rapp_msgs/action), beside the services of the same names: any actionlib client may ask.

Who asks is known as with the services: by the field rapp_channel in the TCPROS header of the connection over which a goal or a
cancel comes. A newer goal ends whatever moves the same limbs.
"""

import logging
import threading
import time
from typing import Any

import rapp_msgs.msg
from actionlib import ActionServer
from actionlib_msgs.msg import GoalStatus

from rapp_core.errors import CoreError, Refused
from rapp_core.launcher.lease import Grant, Lease
from rapp_core.ros.conversions import fields, fill
from rapp_core.ros.services import allow, fail
from rapp_core.services.calls import Call
from rapp_core.services.executor import TAKEN_OVER, Executor
from rapp_core.services.table import CORE_SERVICES, CoreService
from rapp_core.trace import Trace

_log = logging.getLogger(__name__)
MOST_GOALS = 8  # of one action under way; more than one only while the older make way
MOST_KNOWN = 40  # goals of one action whose ends are still told on its status topic
REJECTION = 0.1  # s between two strangers who are told that they are not served; more of them are a flood
CANCELLED = "cancelled"
_OVER = (
    GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.REJECTED, GoalStatus.RECALLED, GoalStatus.RECALLING,
)  # fmt: skip


class RosActions:
    """Offers all actions; they are withdrawn when the node leaves."""

    def __init__(self, executor: Executor, lease: Lease, trace: Trace) -> None:
        for row in CORE_SERVICES:
            if row.action:
                _Action(row, executor, lease, trace).start()


class _Action(ActionServer):  # type: ignore[misc]  # actionlib carries no types
    def __init__(self, row: CoreService, executor: Executor, lease: Lease, trace: Trace) -> None:
        super().__init__(row.name, getattr(rapp_msgs.msg, f"{row.srv}Action"), self._take, self._end, auto_start=False)
        self._row = row
        self._executor = executor
        self._lease = lease
        self._trace = trace
        self._calls: dict[str, Call] = {}  # under way, by the goal's id
        self._next_rejection = 0.0

    def internal_goal_callback(self, goal: Any) -> None:
        """What comes over the wire; a flood of it neither fills the list of goals nor is answered one by one."""
        try:
            self._lease.check(goal._connection_header.get("rapp_channel"))
        except Refused as error:
            now = time.monotonic()
            if now < self._next_rejection:
                return
            self._next_rejection = now + REJECTION
            _log.warning("%s: a goal is refused: %s", self._row.name, error)
        with self.lock:
            over = [each for each in self.status_list if each.status.status in _OVER]
            for each in over[: max(0, len(over) - MOST_KNOWN)]:
                self.status_list.remove(each)
            super().internal_goal_callback(goal)

    def internal_cancel_callback(self, goal_id: Any) -> None:
        """What comes over the wire is heeded only when it is the lease's holder that cancels."""
        try:
            self._lease.check(goal_id._connection_header.get("rapp_channel"))
        except Refused as error:
            _log.warning("%s: cannot cancel: %s", self._row.name, error)
            return
        super().internal_cancel_callback(goal_id)

    def _take(self, handle: Any) -> None:
        """A goal has come: called by actionlib one at a time, from a thread that must not wait."""
        name = self._row.name
        try:
            grant = self._lease.check(handle.status_tracker.goal._connection_header.get("rapp_channel"))
            allow(grant, name)
            if len(self._calls) >= MOST_GOALS:
                raise Refused(f"cannot run {name}: {MOST_GOALS} goals wait already; let one end")
        except Refused as error:
            handle.set_rejected(fail(name, self.ActionResultType(), error), str(error))
            return
        handle.set_accepted()
        feedback = self.ActionFeedback().feedback
        call = Call(lambda values: handle.publish_feedback(fill(type(feedback)(), values)), tuple(self._calls.values()))
        self._calls[handle.get_goal_id().id] = call
        threading.Thread(target=self._execute, args=(handle, grant, call), name=name, daemon=True).start()

    def _end(self, handle: Any) -> None:
        """The client cancels a goal."""
        call = self._calls.get(handle.get_goal_id().id)
        if call is not None:
            call.end(CANCELLED)

    def _execute(self, handle: Any, grant: Grant, call: Call) -> None:
        name, result = self._row.name, self.ActionResultType()
        self._trace.call("dynamic", "core", f"{name} (goal)")
        try:
            with self._executor.counted():
                fill(result, self._executor.run_for(grant, name, call=call, preempt=True, **fields(handle.get_goal())))
            result.success = True
            handle.set_succeeded(result)
            reply = name
        except CoreError as error:
            cancelled = handle.get_goal_status().status == GoalStatus.PREEMPTING or TAKEN_OVER in str(error)
            finish = handle.set_canceled if cancelled else handle.set_aborted
            finish(fail(name, result, error), str(error))
            reply = f"{name}: {error.kind}"
        finally:
            del self._calls[handle.get_goal_id().id]
            if handle.get_goal_status().status in (GoalStatus.ACTIVE, GoalStatus.PREEMPTING):
                handle.set_aborted(result, f"cannot finish {name}: the core agent has a fault; report it with its log")
        self._trace.reply("core", "dynamic", f"{reply} (goal)")
