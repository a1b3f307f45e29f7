"""The core agent over ROS: persistent connections to its services."""

import json
import re
import select
import socket
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

import genpy
import rapp_msgs.msg
import rapp_msgs.srv
import rospy
from rospy.exceptions import ROSInternalException

from rapp_api.core_agent import activity
from rapp_api.errors import KINDS, Invalid, Refused, Unreachable
from rapp_api.files import sorted_out
from rapp_api.ros_body import RosBody

CONNECT_TIMEOUT = 5.0  # s for the service to appear at the ROS master
ANSWER_TIMEOUT = 3600.0  # s; longer than any service takes: recording and listening end after 300 s
PAUSE_STEP = 0.2  # s
REFUSAL = re.compile(r"remote error reported: refused: (.*)", re.DOTALL)  # the gate's, as rospy puts it


class RosCoreAgent(RosBody):
    """See `core_agent.CoreAgent`.

    A dynamic agent holds no secret: its gate knows who it is, and adds the lease's. Without a gate `token` is that secret.
    """

    def __init__(self, token: str = "", answer_timeout: float = ANSWER_TIMEOUT) -> None:
        self._header = {"rapp_channel": token} if token else {}
        self._answer_timeout = answer_timeout
        self._idle: dict[str, list[Any]] = {}
        self._lock = threading.Lock()

    def say(self, text: str, language: str) -> None:
        """See `CoreAgent`."""
        self._call("rapp_say", "Say", text=text, language=language)

    def recognize(self, dictionary: Sequence[str], timeout: float) -> str:
        """See `CoreAgent`."""
        return str(self._call("rapp_recognize", "Recognize", dictionary=list(dictionary), timeout=timeout).word)

    def record(self, duration: float) -> str:
        """See `CoreAgent`."""
        return str(self._call("rapp_record", "Record", duration=duration).path)

    def record_until_silence(self, path: str, waiting_time: float, microphone_energy: int) -> str:
        """See `CoreAgent`."""
        fields = {"path": path, "waiting_time": waiting_time, "microphone_energy": microphone_energy}
        return str(self._call("rapp_record_until_silence", "RecordUntilSilence", **fields).path)

    def play_audio(self, path: str, position: float, volume: float, balance: float, loop: bool) -> None:
        """See `CoreAgent`."""
        fields = {"path": path, "position": position, "volume": volume, "balance": balance, "loop": loop}
        self._call("rapp_play_audio", "PlayAudio", **fields)

    def cloud_call(self, service: str, arguments: dict[str, Any], timeout: float, agent: bool) -> Any:
        """See `CoreAgent`."""
        values, files = sorted_out(service, arguments)
        try:
            text = json.dumps(values, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise Invalid(f"cannot call {service}: its arguments are not JSON: {error}; give texts, numbers, lists") from error
        sent = [rapp_msgs.msg.CallFile(parameter=name, name=path.name, data=data) for name, (path, data) in files.items()]
        fields = {"service": service, "arguments": text, "timeout": timeout, "agent": agent, "files": sent}
        return json.loads(self._call("rapp_cloud_call", "CloudCall", **fields).result)

    def stop_cloud_agent(self) -> bool:
        """See `CoreAgent`."""
        return bool(self._call("rapp_stop_cloud_agent", "StopCloudAgent").stopped)

    def send_mail(self, recipients: Sequence[str], subject: str, body: str, attachment: str) -> str:
        """See `CoreAgent`."""
        fields = {"recipients": list(recipients), "subject": subject, "body": body, "attachment": attachment}
        return str(self._call("rapp_send_mail", "SendMail", **fields).state)

    def keep(self, name: str, data: bytes) -> str:
        """See `CoreAgent`."""
        return str(self._call("rapp_keep", "Keep", name=name, data=data).path)

    def pause(self, seconds: float) -> None:
        """See `CoreAgent`."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            time.sleep(min(left, PAUSE_STEP))
            activity.moved()

    def _call(self, name: str, srv: str, /, **fields: Any) -> Any:
        with _translated(name), activity.waiting():
            response = self._answer(name, getattr(rapp_msgs.srv, srv), fields)
        if not response.success:
            raise KINDS.get(getattr(response, "error", ""), Refused)(response.message)
        return response

    def _answer(self, name: str, cls: Any, fields: dict[str, Any]) -> Any:
        """Call over a connection of this call's own; afterwards it is free for the next, unless the call has failed.

        What is asked is asked once: a mail must not be sent twice because its answer was lost.
        """
        proxy = self._free(name)
        if proxy is None:
            rospy.wait_for_service(name, CONNECT_TIMEOUT)
            proxy = rospy.ServiceProxy(name, cls, persistent=True, headers=dict(self._header))
        bound = threading.Timer(self._answer_timeout, _break, [proxy])
        bound.daemon = True
        bound.start()
        try:
            response = proxy(**fields)
        except BaseException:
            proxy.close()
            raise
        finally:
            bound.cancel()
        with self._lock:
            self._idle.setdefault(name, []).append(proxy)
        return response

    def _free(self, name: str) -> Any:
        """An idle connection that still stands; None when there is none, and one must be made."""
        with self._lock:
            idle = self._idle.get(name, [])
            while idle:
                proxy = idle.pop()
                if not select.select([proxy.transport.socket], [], [], 0)[0]:
                    return proxy
                proxy.close()  # only its end can be there to read: a service speaks when it is asked
        return None


def _break(proxy: Any) -> None:
    """Wake the thread that waits for the answer."""
    transport = proxy.transport
    if transport is not None:
        with suppress(OSError):
            transport.socket.shutdown(socket.SHUT_RDWR)


@contextmanager
def _translated(name: str) -> Iterator[None]:
    """rospy's errors in our words."""
    try:
        yield
    except (TypeError, OverflowError, UnicodeError, genpy.SerializationError, rospy.ROSSerializationException) as error:
        raise Invalid(f"cannot call {name}: {error}; give values of the types its description names") from error
    except (rospy.ServiceException, rospy.ROSException, ROSInternalException, OSError) as error:
        refusal = REFUSAL.search(str(error))
        if refusal is not None:
            raise Refused(refusal[1]) from error
        raise Unreachable(f"cannot reach the core agent's service {name}: {error}; try again later") from error
