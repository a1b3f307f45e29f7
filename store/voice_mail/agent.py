"""Voice-mail, the paper's exemplary application (section V, Fig. 8): asks for a recipient, records a message, sends it."""

from typing import Any

from rapp_api import Behaviour, DynamicAgent, Edge, Machine, RappError, Refused, Subsystem, Unreachable, cloud
from rapp_api.communication import EMPTY, rapp_recognize, rapp_record, rapp_say

TRIES = 3  # how often the recipient's name is asked for
MESSAGE_SECONDS = 8.0  # s, unless package.json says otherwise


def _saying(name: str, text: str) -> Behaviour:
    return Behaviour(name, lambda _share: rapp_say(text), label=f"say: {text}")


class VoiceMail(DynamicAgent):
    """The dynamic agent; its task is the FSM of Fig. 8."""

    def __init__(self, parameters: dict[str, Any] | None = None) -> None:
        super().__init__(parameters)
        self._contacts: dict[str, str] = {}
        self._sender = ""
        self._tries = 0

    def initialise(self) -> None:
        """Get the person's contacts from their profile in the cloud."""
        profile = cloud.call_wait("profile")
        self._sender = profile["name"]
        self._contacts = {contact["name"]: contact["address"] for contact in profile["contacts"]}
        if not self._contacts:
            rapp_say("you have no contacts in your profile yet")
            raise RappError("cannot send a voice-mail: the profile has no contacts; add some")

    def task(self) -> Machine:
        """s31 to s36; a recipient who is not understood is asked for again, three times in all."""
        states = {
            "s31": _saying("s31", "starting word recognition"),
            "s32": Behaviour("s32", self._recipient, label="get e-mail address based on the recognised word"),
            "s33": _saying("s33", "recording message"),
            "s34": Behaviour("s34", self._record, label="record message content"),
            "s35": _saying("s35", "sending e-mail"),
            "s36": Behaviour("s36", self._send, label="send the e-mail"),
            "again": Behaviour("again", self._again, label="say: again, or give up"),
            "end": Behaviour("end", self._end, label="say how it ended"),
        }
        edges = [
            Edge("s31", "s32"),
            Edge("s32", "s33", lambda share: share.memory.get("address") is not None, "recognised"),
            Edge("s32", "again", label="not recognised"),
            Edge("again", "s32", lambda _share: self._tries < TRIES, "again"),
            Edge("again", "end", label="three times"),
            Edge("s33", "s34"),
            Edge("s34", "s35"),
            Edge("s35", "s36"),
            Edge("s36", "end"),
        ]
        return Machine("voice_mail", states, "s31", edges, ["end"], label="execute")

    def _recipient(self, share: Subsystem) -> None:
        self._tries += 1
        name = rapp_recognize(list(self._contacts))
        share.memory["recipient"] = name
        share.memory["address"] = None if name == EMPTY else self._contacts[name]

    def _again(self, _share: Subsystem) -> None:
        if self._tries < TRIES:
            rapp_say("I did not understand the name, please say it again")

    def _record(self, share: Subsystem) -> None:
        share.memory["recording"] = rapp_record(float(self.parameters.get("message_seconds", MESSAGE_SECONDS)))

    def _send(self, share: Subsystem) -> None:
        subject = f"Voice message from {self._sender}"
        body = f"{self._sender} has recorded a voice message for you; it is attached.\n"
        try:
            sent = cloud.send_mail_wait([str(share.memory["address"])], subject, body, str(share.memory["recording"]))
        except Refused as error:
            sent = "refused" if str(error).startswith(cloud.SERVER_REFUSES) else "not taken"
            share.memory["why"] = str(error).partition(" (")[0]  # without what is for those who mend it
        except Unreachable:
            sent = "lost"
        share.memory["sent"] = sent

    def _end(self, share: Subsystem) -> None:
        endings = {
            "delivered": f"I have finished, your message to {share.memory['recipient']} is sent",
            "kept": "I cannot reach the mail server, I keep your message and send it later",
            "locked": "the mail server does not let me in, I keep your message and send it when it does",
            "refused": f"the mail server refuses your message to {share.memory['recipient']}, I cannot send it",
            "not taken": f"I am sorry, I could not send your message: I {share.memory.get('why')}",
            "unknown": f"I do not know whether your message to {share.memory['recipient']} is sent, it may still be sent",
            "lost": "I am sorry, I could not send your message, please try again later",
            None: "I am sorry, I do not know to whom I should write",
        }
        rapp_say(endings[share.memory.get("sent")])  # type: ignore[index]
