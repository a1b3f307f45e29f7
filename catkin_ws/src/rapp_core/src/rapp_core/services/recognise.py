"""rapp_recognize: wordSpotting of the deliverable, paper Fig. 6."""

from rapp_agent import Behaviour, Edge, Machine, Subsystem
from rapp_core.errors import Invalid
from rapp_core.ports import Word
from rapp_core.services.context import Context, reply, request

EMPTY = "Empty"
RECOGNISER = "ALSpeechRecognition"
MOST = 100  # words
LONGEST = 300.0  # s of listening


class _Recognition:
    """The transition functions and conditions of the sub-FSM, over receptor r_mic."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._ears = context.robot.ears
        self._trace = context.trace

    def set_vocabulary(self, share: Subsystem) -> None:
        words = request(share, "dictionary")
        if not 1 <= len(words) <= MOST or not all(w.strip() for w in words):
            raise Invalid(f"cannot listen: a dictionary of 1 to {MOST} words is needed")
        self._trace.call("core", RECOGNISER, "setVocabulary")
        self._ears.set_vocabulary(words)
        self._trace.reply(RECOGNISER, "core", "setVocabulary")

    def subscribe(self, share: Subsystem) -> None:
        heard = share.inputs["heard"]
        self._trace.call("core", RECOGNISER, "subscribe")
        share.memory["undo"] = self._unsubscribe
        self._ears.subscribe(lambda item: heard.put(item) if isinstance(item, Word) else None)
        self._trace.reply(RECOGNISER, "core", "subscribe")
        wish = request(share, "timeout")
        timeout = min(wish, LONGEST) if wish > 0 else self._context.config.recognise_timeout
        share.memory["until"] = self._context.now() + timeout

    def _unsubscribe(self) -> None:
        self._trace.call("core", RECOGNISER, "unsubscribe")
        self._ears.unsubscribe()
        self._trace.reply(RECOGNISER, "core", "unsubscribe")

    def take(self, share: Subsystem) -> None:
        word = share.inputs["heard"].take()
        share.memory["word"] = word
        if word is not None:
            self._trace.send("ALMemory", "core", "WordRecognized")

    def heard_or_late(self, share: Subsystem) -> bool:
        return share.memory["word"] is not None or self._context.now() >= float(str(share.memory["until"]))

    def threshold(self, share: Subsystem) -> None:
        word = share.memory["word"]
        share.memory["accepted"] = isinstance(word, Word) and word.probability >= self._context.config.threshold

    def again(self, share: Subsystem) -> bool:
        """A word below the threshold counts as unrecognised; until the time is up there may be another."""
        return share.memory["word"] is not None and not share.memory["accepted"]

    def answer(self, share: Subsystem) -> None:
        word = share.memory["word"]
        if share.memory["accepted"] and isinstance(word, Word):
            self._trace.heard(word.text)
            reply(share, word=word.text, probability=word.probability)
        else:
            reply(share, word=EMPTY, probability=0.0)


def machine(context: Context) -> Machine:
    """Sub-FSM: setVocabulary, subscribe, await an event of ALMemory, threshold, reply."""
    do = _Recognition(context)
    return Machine(
        "rapp_recognize",
        {
            "vocabulary": Behaviour("vocabulary", do.set_vocabulary, label="setVocabulary"),
            "subscribe": Behaviour("subscribe", do.subscribe, label="subscribe"),
            "await": Behaviour("await", do.take, do.heard_or_late, label="await WordRecognized"),
            "threshold": Behaviour("threshold", do.threshold, label="compare with the threshold"),
            "reply": Behaviour("reply", do.answer, label="reply"),
        },
        "vocabulary",
        [
            Edge("vocabulary", "subscribe"),
            Edge("subscribe", "await"),
            Edge("await", "threshold"),
            Edge("threshold", "await", do.again, "below the threshold"),
            Edge("threshold", "reply"),
        ],
        ["reply"],
    )
