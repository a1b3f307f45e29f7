"""What stands on both sides of the bridge in tests: a rospy node in a process of its own, and clients that speak by hand."""

import asyncio
import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tornado.websocket import WebSocketClientConnection, websocket_connect

from fakes.told_node import told_node

PATIENCE = 20.0  # s until a test gives up; nothing waits as long when all is well

NODE = """
import json, sys, threading, rospy
from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolResponse
from rapp_msgs.srv import Say, SayResponse

rospy.init_node(sys.argv[1], disable_signals=True)
gate = threading.Event()

def say(request):
    if request.text == "slow": gate.wait(20); gate.clear()
    if request.text == "go": gate.set()
    if request.text == "fail": raise ValueError("no voice")
    if request.text == "die": import os; os._exit(0)
    return SayResponse(success=True, message=request.text)

rospy.Service("say", Say, say)
latched = rospy.Publisher("latched", String, latch=True, queue_size=1); latched.publish("kept")
echo = rospy.Publisher("echoed", String, queue_size=100)
rospy.Subscriber("to_echo", String, echo.publish)
proxies = {}

def answer(name, text):
    try:
        kept = name.endswith("_kept")
        proxy = proxies.get(name) or rospy.ServiceProxy(name, Say, persistent=kept)
        if kept: proxies[name] = proxy
        return proxy(text, "").message
    except (rospy.ServiceException, rospy.ROSException) as error:
        proxies.pop(name, None)
        return "error: %s" % error

def tell(name, text):
    line = json.dumps(answer(name, text)) + "\\n"
    with lock: sys.stdout.write(line); sys.stdout.flush()

lock = threading.Lock()
print("READY {}", flush=True)
for line in sys.stdin:   # calls of services that clients offer, on request
    threading.Thread(target=tell, args=json.loads(line), daemon=True).start()
"""


class Peer:
    """A rospy node in a process of its own, which calls services when told to."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        assert self._line() == "READY {}"

    def call(self, service: str, text: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps([service, text]) + "\n")
        self.process.stdin.flush()

    async def heard(self) -> str:
        """The next answer to a call, or "error: ..."."""
        answer: str = json.loads(await asyncio.wait_for(asyncio.to_thread(self._line), PATIENCE))
        return answer

    def _line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()


@contextmanager
def node(ros_env: dict[str, str], name: str) -> Iterator[Peer]:
    with told_node(ros_env, NODE, name) as process:
        yield Peer(process)


class Socket:
    """A client that speaks the protocol by hand."""

    def __init__(self, connection: WebSocketClientConnection) -> None:
        self.connection = connection

    async def send(self, **fields: Any) -> None:
        await self.connection.write_message(json.dumps(fields))

    async def raw(self, frame: str | bytes) -> None:
        await self.connection.write_message(frame, binary=isinstance(frame, bytes))

    async def receive(self, op: str) -> dict[str, Any]:
        """The next message of this kind; others are passed over."""
        async with asyncio.timeout(PATIENCE):
            while True:
                text = await self.connection.read_message()
                assert text is not None, "the bridge closed the connection"
                message: dict[str, Any] = json.loads(text)
                if message["op"] == op:
                    return message

    async def call(self, service: str, **fields: Any) -> dict[str, Any]:
        await self.send(op="call_service", service=service, **fields)
        return await self.receive("service_response")

    async def settle(self) -> None:
        """Wait until the bridge has served all that was sent before: frames are served in order."""
        await self.send(op="settle")
        while "settle" not in (await self.receive("status"))["msg"]:
            pass

    def leave(self) -> None:
        self.connection.close()


class Clients:
    """Opens clients, and closes them all at the end."""

    def __init__(self, url: str) -> None:
        self._url = url
        self._open: list[Socket] = []

    async def __aenter__(self) -> "Clients":
        return self

    async def __aexit__(self, *_error: object) -> None:
        for socket in self._open:
            socket.leave()

    async def new(self) -> Socket:
        socket = Socket(await websocket_connect(self._url))
        self._open.append(socket)
        return socket
