"""The services of rosapi: one table of names, types and functions. Nothing in them waits for a dead node."""

from collections.abc import Callable, Coroutine
from typing import Any

import orjson
import rospy

from rapp_bridge.access import Access
from rapp_bridge.blocking import Blocking
from rapp_bridge.clock import now
from rapp_bridge.errors import BridgeError, Invalid, Refused, Unreachable
from rapp_bridge.graph import Graph
from rapp_bridge.local import Local, Locals
from rapp_bridge.master import Master
from rapp_bridge.rostypes import service_class
from rapp_bridge.typedefs import full_text, message_typedefs, request_typedefs, response_typedefs

Fields = dict[str, Any]
INTEGERS = range(-(1 << 31), 1 << 31)  # of the parameter server's XML-RPC
UNSPEAKABLE = {*map(chr, range(32)), "\ufffe", "\uffff"} - {"\t", "\n", "\r"}  # in XML 1.0
DEPTH = 32  # of a parameter's lists and objects


class Rosapi:
    """Provides all services; each takes its request's fields and the caller's access and gives its response's fields."""

    def __init__(self, graph: Graph, master: Master, blocking: Blocking) -> None:
        self._graph = graph
        self._master = master
        self._blocking = blocking

    async def offer(self, own: Locals) -> None:
        """Register all of them."""
        for name, (kind, provide) in self._table().items():
            await own.add(f"/rosapi/{name}", Local(service_class(f"rosapi/{kind}"), provide))

    def _table(self) -> dict[str, tuple[str, Callable[[Fields, Access], Coroutine[Any, Any, Fields]]]]:
        return {
            "topics": ("Topics", self._topics),
            "topics_for_type": ("TopicsForType", self._topics_for_type),
            "topics_and_raw_types": ("TopicsAndRawTypes", self._topics_and_raw_types),
            "topic_type": ("TopicType", self._topic_type),
            "publishers": ("Publishers", self._publishers),
            "subscribers": ("Subscribers", self._subscribers),
            "services": ("Services", self._services),
            "services_for_type": ("ServicesForType", self._services_for_type),
            "service_type": ("ServiceType", self._service_type),
            "service_providers": ("ServiceProviders", self._service_providers),
            "service_node": ("ServiceNode", self._service_node),
            "service_host": ("ServiceHost", self._service_host),
            "nodes": ("Nodes", self._nodes),
            "node_details": ("NodeDetails", self._node_details),
            "action_servers": ("GetActionServers", self._action_servers),
            "message_details": ("MessageDetails", _typedefs(message_typedefs)),
            "service_request_details": ("ServiceRequestDetails", _typedefs(request_typedefs)),
            "service_response_details": ("ServiceResponseDetails", _typedefs(response_typedefs)),
            "set_param": ("SetParam", self._set_param),
            "get_param": ("GetParam", self._get_param),
            "has_param": ("HasParam", self._has_param),
            "search_param": ("SearchParam", self._search_param),
            "delete_param": ("DeleteParam", self._delete_param),
            "get_param_names": ("GetParamNames", self._get_param_names),
            "get_time": ("GetTime", _get_time),
        }

    async def _topics(self, _: Fields, access: Access) -> Fields:
        found = sorted((await self._graph.topics(access)).items())
        return {"topics": [name for name, _ in found], "types": [kind for _, kind in found]}

    async def _topics_for_type(self, request: Fields, access: Access) -> Fields:
        found = await self._graph.topics(access)
        return {"topics": sorted(name for name, kind in found.items() if kind == request["type"])}

    async def _topics_and_raw_types(self, request: Fields, access: Access) -> Fields:
        found = await self._topics(request, access)
        return {**found, "typedefs_full_text": [_text(kind) for kind in found["types"]]}

    async def _topic_type(self, request: Fields, access: Access) -> Fields:
        return {"type": (await self._graph.topics(access)).get(rospy.resolve_name(request["topic"]), "")}

    async def _publishers(self, request: Fields, access: Access) -> Fields:
        return {"publishers": await self._graph.publishers(rospy.resolve_name(request["topic"]), access)}

    async def _subscribers(self, request: Fields, access: Access) -> Fields:
        return {"subscribers": await self._graph.subscribers(rospy.resolve_name(request["topic"]), access)}

    async def _services(self, _: Fields, access: Access) -> Fields:
        return {"services": sorted(await self._graph.services(access))}

    async def _services_for_type(self, request: Fields, access: Access) -> Fields:
        return {"services": sorted(await self._graph.services_of_type(request["type"], access))}

    async def _service_type(self, request: Fields, access: Access) -> Fields:
        name = rospy.resolve_name(request["service"])
        access.service(name)
        return {"type": await self._graph.service_type(name)}

    async def _service_providers(self, request: Fields, access: Access) -> Fields:
        found = await self._graph.services_of_type(request["service"], access)  # it is a type, whatever the field is called
        return {"providers": sorted({node for nodes in found.values() for node in nodes})}

    async def _service_node(self, request: Fields, access: Access) -> Fields:
        nodes = await self._graph.service_nodes(rospy.resolve_name(request["service"]), access)
        return {"node": nodes[0] if nodes else ""}

    async def _service_host(self, request: Fields, access: Access) -> Fields:
        name = rospy.resolve_name(request["service"])
        access.service(name)
        try:
            return {"host": (await self._blocking.run(self._master.service_address, name))[0]}
        except Unreachable:
            return {"host": ""}

    async def _nodes(self, _: Fields, _access: Access) -> Fields:
        return {"nodes": await self._graph.nodes()}

    async def _node_details(self, request: Fields, access: Access) -> Fields:
        published, subscribed, services = await self._graph.held_by(rospy.resolve_name(request["node"]), access)
        return {"subscribing": sorted(subscribed), "publishing": sorted(published), "services": sorted(services)}

    async def _action_servers(self, _: Fields, access: Access) -> Fields:
        return {"action_servers": await self._graph.action_servers(access)}

    async def _set_param(self, request: Fields, access: Access) -> Fields:
        value = _parameter(request["value"])
        ok, _ = await self._param("setParam", request, access, value)
        if not ok:
            raise Invalid(f"cannot set the parameter {request['name'][:100]!r}: the ROS master does not take it; check the name")
        return {}

    async def _get_param(self, request: Fields, access: Access) -> Fields:
        ok, value = await self._param("getParam", request, access)
        if not ok:
            return {"value": _default(request["default"])}
        try:
            return {"value": orjson.dumps(value, default=str).decode()}
        except orjson.JSONEncodeError as error:
            raise Refused(f"cannot give the parameter {request['name'][:100]!r} as JSON: {error}") from error

    async def _has_param(self, request: Fields, access: Access) -> Fields:
        return {"exists": bool((await self._param("hasParam", request, access))[1])}

    async def _search_param(self, request: Fields, access: Access) -> Fields:
        ok, found = await self._blocking.run(self._master.param, "searchParam", request["name"])
        if ok:
            access.param(found)
        return {"global_name": found if ok else ""}

    async def _delete_param(self, request: Fields, access: Access) -> Fields:
        await self._param("deleteParam", request, access)
        return {}

    async def _get_param_names(self, _: Fields, access: Access) -> Fields:
        found = (await self._blocking.run(self._master.param, "getParamNames"))[1]
        return {"names": sorted(name for name in found if _may(access, name))}

    async def _param(self, question: str, request: Fields, access: Access, *values: Any) -> tuple[bool, Any]:
        name = rospy.resolve_name(request["name"])
        access.param(name)
        return await self._blocking.run(self._master.param, question, name, *values)


def _typedefs(describe: Callable[[str], list[Fields]]) -> Callable[[Fields, Access], Coroutine[Any, Any, Fields]]:
    async def provide(request: Fields, _: Access) -> Fields:
        return {"typedefs": describe(request["type"])}

    return provide


async def _get_time(_: Fields, _access: Access) -> Fields:
    secs, nsecs = now()
    return {"time": {"secs": secs, "nsecs": nsecs}}


def _text(kind: str) -> str:
    try:
        return full_text(kind)
    except BridgeError:
        return ""


def _may(access: Access, name: str) -> bool:
    try:
        access.param(name)
    except BridgeError:
        return False
    return True


def _parameter(text: str) -> Any:
    """The value of a parameter's JSON text, as far as XML-RPC can carry it; raises Invalid."""
    try:
        value = orjson.loads(text)
    except orjson.JSONDecodeError as error:
        raise Invalid(f"cannot set the parameter: its value is no JSON text: {error}") from error
    _check_parameter(value, DEPTH)
    return value


def _check_parameter(value: Any, depth: int) -> None:
    if value is None or (type(value) is int and value not in INTEGERS):
        raise Invalid("cannot set the parameter: ROS parameters hold no null and only integers of 32 bits")
    if depth == 0:
        raise Invalid(f"cannot set the parameter: it is nested more than {DEPTH} deep")
    if isinstance(value, dict):
        value = [*value, *value.values()]
    if isinstance(value, str) and not UNSPEAKABLE.isdisjoint(value):
        raise Invalid("cannot set the parameter: XML, which carries it, has no control characters")
    for part in value if isinstance(value, list) else ():
        _check_parameter(part, depth - 1)


def _default(text: str) -> str:
    """The answer when there is no such parameter: the default as JSON, "null" when there is none."""
    if not text:
        return "null"
    try:
        orjson.loads(text)
    except orjson.JSONDecodeError:  # upstream takes plain text too
        return orjson.dumps(text).decode()
    return text
