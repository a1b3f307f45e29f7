"""The core services as ROS services: each call is checked against the lease, then executed as a sub-FSM of s9."""

import logging
from collections.abc import Callable
from typing import Any

import rapp_msgs.srv
import rospy

from rapp_core.errors import CoreError, Refused
from rapp_core.gate.rules import Offered
from rapp_core.launcher.lease import Grant, Lease
from rapp_core.ros.conversions import fields, fill
from rapp_core.services.executor import Executor
from rapp_core.services.keepsakes import Keepsakes
from rapp_core.services.outside import CloudCall, Outside
from rapp_core.services.sendable import CallFile
from rapp_core.services.table import CORE_SERVICES, CoreService
from rapp_core.trace import Trace

_log = logging.getLogger(__name__)
Handler = Callable[[Grant, Any, Any], None]
OUTSIDE = frozenset({"rapp_cloud_call", "rapp_stop_cloud_agent", "rapp_send_mail"})  # allowed call by call, see `services.outside`


class RosServices:
    """Advertises all services; they are withdrawn when the node leaves."""

    def __init__(self, executor: Executor, outside: Outside, keepsakes: Keepsakes, lease: Lease, trace: Trace) -> None:
        self._executor = executor
        self._outside = outside
        self._keepsakes = keepsakes
        self._lease = lease
        self._trace = trace
        for row in CORE_SERVICES:
            self._offer(row.name, row.srv, self._core(row))
        self._offer("rapp_cloud_call", "CloudCall", self._cloud_call)
        self._offer("rapp_stop_cloud_agent", "StopCloudAgent", self._stop_cloud_agent)
        self._offer("rapp_send_mail", "SendMail", self._send_mail)
        self._offer("rapp_keep", "Keep", self._keep)

    def _offer(self, name: str, srv: str, handler: Handler) -> None:
        cls = getattr(rapp_msgs.srv, srv)

        def serve(request: Any) -> Any:
            response = cls._response_class()
            try:
                grant = self._lease.check(request._connection_header.get("rapp_channel"))
            except Refused as error:
                return fail(name, response, error)
            self._trace.call("dynamic", "core", name)
            reply = name
            try:
                with self._executor.counted():
                    allow(grant, name)
                    handler(grant, request, response)
                response.success = True
            except CoreError as error:
                fail(name, response, error)
                reply = f"{name}: {error.kind}"
            self._trace.reply("core", "dynamic", reply)
            return response

        rospy.Service(name, cls, serve)

    def _core(self, row: CoreService) -> Handler:
        def execute(grant: Grant, request: Any, response: Any) -> None:
            fill(response, self._executor.run_for(grant, row.name, **fields(request)))

        return execute

    def _cloud_call(self, grant: Grant, request: Any, response: Any) -> None:
        files = [CallFile(each.parameter, each.name, bytes(each.data)) for each in request.files]
        call = CloudCall(request.service, request.arguments, request.timeout, request.agent, files)
        response.result = self._outside.cloud_call(grant.run, call)

    def _stop_cloud_agent(self, grant: Grant, _request: Any, response: Any) -> None:
        response.stopped = self._outside.stop_cloud_agent(grant.run)

    def _send_mail(self, grant: Grant, request: Any, response: Any) -> None:
        response.state = self._outside.send_mail(grant.run, request.recipients, request.subject, request.body, request.attachment)

    def _keep(self, grant: Grant, request: Any, response: Any) -> None:
        path = self._keepsakes.keep(grant.run, request.name, request.data)
        self._trace.note(f"kept {path}")
        response.path = str(path)


def offered(node: str) -> Offered:
    """What gates may open to RApps; `node`: the core agent's."""
    services = frozenset({row.name for row in CORE_SERVICES} | {"rapp_keep"})
    return Offered(node, services, OUTSIDE, {row.name: row.srv for row in CORE_SERVICES if row.action})


def allow(grant: Grant, name: str) -> None:
    """Raise Refused when the RApp has not said that it uses a service."""
    manifest = grant.run.manifest
    if name not in OUTSIDE and (manifest is None or name not in manifest.core):
        raise Refused(f"cannot call {name}: the RApp's package.json does not name it under permissions.core")


def fail(name: str, message: Any, error: CoreError) -> Any:
    """Tell in a response or a result what went wrong; gives the message."""
    _log.warning("%s: %s", name, error)
    message.message, message.error = str(error), error.kind
    return message
