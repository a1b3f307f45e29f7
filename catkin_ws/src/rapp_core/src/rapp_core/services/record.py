"""rapp_record and rapp_record_until_silence: both forms of captureAudio of the deliverable, paper Fig. 7."""

import itertools
from pathlib import Path

from rapp_agent import Behaviour, Edge, Machine, Subsystem
from rapp_agent.behaviour import Condition, Transition
from rapp_core.errors import Invalid
from rapp_core.services.context import Context, reply, request

LONGEST = 300.0  # s of one recording
_numbers = itertools.count(1)


def machine(context: Context) -> Machine:
    """Sub-FSM: start asynchronously, let the time pass, stop asynchronously, reply with the path."""

    def check(share: Subsystem) -> None:
        duration = request(share, "duration")
        if not 0.1 <= duration <= LONGEST:
            raise Invalid(f"cannot record for {duration:g} s: 0.1 to {LONGEST:g} s are possible")
        share.memory["path"] = _new_path(context.recordings, "")

    def over(share: Subsystem) -> bool:
        return context.now() - _begun(share) >= float(request(share, "duration"))

    return _machine("rapp_record", context, check, lambda _share: None, over)


def until_silence_machine(context: Context) -> Machine:
    """Sub-FSM: as `machine`, but the recording ends when it has been quiet for the waiting time."""

    def check(share: Subsystem) -> None:
        waiting, limit = request(share, "waiting_time"), request(share, "microphone_energy")
        if not 0.1 <= waiting <= 60 or limit <= 0:
            raise Invalid("cannot record: a waiting time of 0.1 to 60 s and an energy above 0 are needed")
        share.memory["path"] = _new_path(context.recordings, request(share, "path"))

    def listen(share: Subsystem) -> None:
        if context.robot.recorder.energy() > request(share, "microphone_energy"):
            share.memory["loud"] = context.now()

    def quiet(share: Subsystem) -> bool:
        now, loud = context.now(), share.memory.get("loud", _begun(share))
        return now - float(str(loud)) >= request(share, "waiting_time") or now - _begun(share) >= LONGEST

    return _machine("rapp_record_until_silence", context, check, listen, quiet)


def _machine(name: str, context: Context, check: Transition, during: Transition, over: Condition) -> Machine:
    recorder, trace = context.robot.recorder, context.trace

    def start(share: Subsystem) -> None:
        check(share)
        path = Path(str(share.memory["path"]))
        trace.send("core", "ALAudioRecorder", "startMicrophonesRecording")
        share.memory["undo"] = recorder.stop
        recorder.start(path)
        share.memory["begun"] = context.now()

    def record(share: Subsystem) -> None:
        recorder.check()
        during(share)

    def stop(share: Subsystem) -> None:
        trace.send("core", "ALAudioRecorder", "stopMicrophonesRecording")
        recorder.stop()
        share.memory["undo"] = None

    def answer(share: Subsystem) -> None:
        reply(share, path=str(share.memory["path"]))

    return Machine(
        name,
        {
            "start": Behaviour("start", start, label="start recording"),
            "record": Behaviour("record", record, over, label="the time passes"),
            "stop": Behaviour("stop", stop, label="stop recording"),
            "reply": Behaviour("reply", answer, label="reply with the path"),
        },
        "start",
        [Edge("start", "record"), Edge("record", "stop"), Edge("stop", "reply")],
        ["reply"],
    )


def _begun(share: Subsystem) -> float:
    return float(str(share.memory["begun"]))


def _new_path(folder: Path, wish: str) -> Path:
    """A path in the recordings folder; a wished name must lie below it."""
    folder.mkdir(parents=True, exist_ok=True)
    path = (folder / (wish or f"recording-{next(_numbers)}.ogg")).resolve()
    if not path.is_relative_to(folder.resolve()) or path.suffix != ".ogg":
        raise Invalid(f"cannot record into {wish}: give a name ending in .ogg below {folder}")
    return path
