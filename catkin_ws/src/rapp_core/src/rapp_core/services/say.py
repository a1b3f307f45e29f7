"""rapp_say: textToSpeech of the deliverable, paper Fig. 5."""

from rapp_agent import Behaviour, Machine, Subsystem
from rapp_core.errors import Invalid
from rapp_core.services.context import Context, request

LONGEST = 4000  # characters


def machine(context: Context) -> Machine:
    """Sub-FSM: delegate the text to e_ls, which says it synchronously."""

    def say(share: Subsystem) -> None:
        text = request(share, "text")
        if not text.strip() or len(text) > LONGEST:
            raise Invalid(f"cannot say that: a text of 1 to {LONGEST} characters is needed")
        context.trace.call("core", "ALTextToSpeech", "say")
        context.trace.said(text)
        context.robot.voice.say(text, request(share, "language") or context.config.language)
        context.trace.reply("ALTextToSpeech", "core", "say")

    return Machine("rapp_say", {"say": Behaviour("say", say, label="delegate to e_ls")}, "say", [], ["say"])
