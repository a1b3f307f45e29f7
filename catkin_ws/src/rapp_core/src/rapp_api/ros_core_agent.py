"""The core agent over ROS: persistent connections to its services, which carry the run's secret in their header."""

import json
from collections.abc import Sequence
from typing import Any

import rapp_msgs.srv
import rospy

from rapp_api.core_agent import activity
from rapp_api.errors import KINDS, Bug, Refused, Unreachable

CONNECT_TIMEOUT = 5.0  # s


class RosCoreAgent:
    """See `core_agent.CoreAgent`. The secret came over this process's own channel: no other process can use it."""

    def __init__(self, token: str) -> None:
        self._header = {"rapp_channel": token}
        self._proxies: dict[str, Any] = {}

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

    def cloud_call(self, service: str, arguments: dict[str, Any], timeout: float) -> Any:
        """See `CoreAgent`."""
        fields = {"service": service, "arguments": json.dumps(arguments), "timeout": timeout}
        return json.loads(self._call("rapp_cloud_call", "CloudCall", **fields).result)

    def send_mail(self, recipients: Sequence[str], subject: str, body: str, attachment: str) -> str:
        """See `CoreAgent`."""
        fields = {"recipients": list(recipients), "subject": subject, "body": body, "attachment": attachment}
        return str(self._call("rapp_send_mail", "SendMail", **fields).state)

    def _call(self, name: str, srv: str, **fields: Any) -> Any:
        response = self._answer(name, getattr(rapp_msgs.srv, srv), fields)
        activity.moved()
        if not response.success:
            raise KINDS.get(getattr(response, "error", ""), Refused)(response.message)
        return response

    def _answer(self, name: str, cls: Any, fields: dict[str, Any]) -> Any:
        """Call once; a connection that turns out dead before the call is opened once more."""
        try:
            proxy = self._proxies.get(name)
            if proxy is None:
                rospy.wait_for_service(name, CONNECT_TIMEOUT)
                proxy = self._proxies[name] = rospy.ServiceProxy(name, cls, persistent=True, headers=self._header)
            return proxy(**fields)
        except (rospy.ServiceException, rospy.ROSException, OSError) as error:
            self._proxies.pop(name, None)
            raise Unreachable(f"cannot reach the core agent's service {name}: {error}") from error
        except (TypeError, ValueError, rospy.ROSSerializationException) as error:
            raise Bug(f"cannot call {name}: {error}") from error
