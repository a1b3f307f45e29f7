"""The core services as sub-FSMs: order of messages (paper Figs 5 to 7), thresholds, refusals, tidying up."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fakes.bench import Bench
from rapp_core.errors import CoreError, Invalid, Refused, Unreachable
from rapp_core.launcher.lease import Grant


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def test_say_is_one_synchronous_call_then_the_reply(bench: Bench) -> None:
    bench.call("rapp_say", text="good morning", language="")
    assert bench.messages() == ["core->ALTextToSpeech say", "ALTextToSpeech->core reply say"]
    assert bench.fake.journal == ["say good morning"]
    assert [each.detail for each in bench.happenings if each.kind == "said"] == ["good morning"]


def test_an_unknown_language_is_refused_by_name(bench: Bench) -> None:
    with pytest.raises(Refused, match="'tlh'"):
        bench.call("rapp_say", text="nuqneH", language="tlh")
    assert bench.fake.journal == []


@pytest.mark.parametrize("text", ["", "  ", "x" * 4001])
def test_a_text_of_no_use_is_invalid(bench: Bench, text: str) -> None:
    with pytest.raises(Invalid):
        bench.call("rapp_say", text=text, language="en")


def test_recognise_follows_figure_6(bench: Bench) -> None:
    bench.fake.person_says_at(1.0, "Elizabeth", probability=0.8)
    reply = bench.call("rapp_recognize", dictionary=["Margaret", "Elizabeth"], timeout=0.0)
    assert reply == {"word": "Elizabeth", "probability": 0.8}
    assert bench.fake.journal == ["setVocabulary", "subscribe", "unsubscribe"]
    assert bench.states() == ["/vocabulary", "/subscribe", "/await", "/threshold", "/reply"]
    assert bench.messages() == [
        "core->ALSpeechRecognition setVocabulary", "ALSpeechRecognition->core reply setVocabulary",
        "core->ALSpeechRecognition subscribe", "ALSpeechRecognition->core reply subscribe",
        "ALMemory->core WordRecognized (asynchronous)",
        "core->ALSpeechRecognition unsubscribe", "ALSpeechRecognition->core reply unsubscribe",
    ]  # fmt: skip


def test_v04_a_word_below_the_threshold_is_treated_as_unrecognised(bench: Bench) -> None:
    bench.fake.person_says_at(1.0, "Margaret", probability=0.39)
    assert bench.call("rapp_recognize", dictionary=["Margaret"], timeout=3.0)["word"] == "Empty"
    assert bench.clock.time == pytest.approx(3.0, abs=0.1)


def test_after_an_unrecognised_word_the_next_one_counts(bench: Bench) -> None:
    bench.fake.person_says_at(1.0, "Margaret", probability=0.2)
    bench.fake.person_says_at(3.0, "Elizabeth", probability=0.4)
    assert bench.call("rapp_recognize", dictionary=["Margaret", "Elizabeth"], timeout=0.0)["word"] == "Elizabeth"


def test_silence_gives_empty_after_the_core_agent_s_own_time(bench: Bench) -> None:
    assert bench.call("rapp_recognize", dictionary=["Margaret"], timeout=0.0)["word"] == "Empty"
    assert bench.clock.time == pytest.approx(8.0, abs=0.1)


@pytest.mark.parametrize("words", [[], [""], ["a", " "], ["word"] * 101])
def test_a_dictionary_of_no_use_is_invalid(bench: Bench, words: list[str]) -> None:
    with pytest.raises(Invalid):
        bench.call("rapp_recognize", dictionary=words, timeout=0.0)
    assert "subscribe" not in bench.fake.journal


def test_record_follows_figure_7(bench: Bench) -> None:
    reply = bench.call("rapp_record", duration=2.5)
    assert bench.fake.journal == ["startMicrophonesRecording", "stopMicrophonesRecording"]
    assert bench.clock.time == pytest.approx(2.5, abs=0.05)
    path = Path(reply["path"])
    assert path.read_bytes() == b"OggS"
    assert path.parent == bench.agent.recordings
    assert bench.call("rapp_record", duration=0.1)["path"] != str(path)


@pytest.mark.parametrize("duration", [0.0, 0.05, -1.0, 300.1, math.nan, math.inf])
def test_a_duration_of_no_use_is_invalid(bench: Bench, duration: float) -> None:
    with pytest.raises(Invalid):
        bench.call("rapp_record", duration=duration)
    assert bench.fake.journal == []


def until_silence(bench: Bench, path: str = "", waiting: float = 1.0, limit: int = 1700) -> dict[str, Any]:
    return bench.call("rapp_record_until_silence", path=path, waiting_time=waiting, microphone_energy=limit)


def test_recording_until_silence_waits_for_the_end_of_speech(bench: Bench) -> None:
    bench.fake.body.energy = 4000.0
    bench.clock.at(5.0, lambda: setattr(bench.fake.body, "energy", 300.0))
    path = until_silence(bench, "letter.ogg")["path"]
    assert bench.clock.time == pytest.approx(6.0, abs=0.1)
    assert path == str(bench.agent.recordings / "letter.ogg")


def test_a_short_pause_is_no_silence(bench: Bench) -> None:
    bench.fake.body.energy = 4000.0
    for time, energy in ((2.0, 300.0), (2.9, 4000.0), (4.0, 300.0)):
        bench.clock.at(time, lambda energy=energy: setattr(bench.fake.body, "energy", energy))
    until_silence(bench)
    assert bench.clock.time == pytest.approx(5.0, abs=0.1)


def test_endless_noise_ends_at_the_longest_recording(bench: Bench) -> None:
    bench.fake.body.energy = 4000.0
    until_silence(bench)
    assert bench.clock.time == pytest.approx(300.0, abs=0.1)


@pytest.mark.parametrize("path", ["../letter.ogg", "/etc/letter.ogg", "letter.txt", "a/../../b.ogg"])
def test_recordings_stay_in_their_folder(bench: Bench, path: str) -> None:
    with pytest.raises(Invalid):
        until_silence(bench, path)
    assert bench.fake.journal == []


def play(bench: Bench, path: str, **fields: Any) -> None:
    bench.call("rapp_play_audio", **{"path": path, "position": 0.0, "volume": 1.0, "balance": 0.0, "loop": False, **fields})


def test_playing_a_file_of_the_package_and_a_recording(bench: Bench) -> None:
    (bench.agent.package / "bell.ogg").write_bytes(b"OggS")
    recording = bench.call("rapp_record", duration=0.1)["path"]
    bench.fake.journal.clear()
    play(bench, "/rapp/package/bell.ogg", position=1.5, volume=0.5, balance=-1.0)
    play(bench, recording)
    assert bench.fake.journal == [
        "stop playing", "play bell.ogg 1.5 0.5 -1", "stop playing", f"play {Path(recording).name} 0 1 0",
    ]  # fmt: skip


def test_a_loop_returns_at_once(bench: Bench) -> None:
    (bench.agent.package / "bell.ogg").write_bytes(b"OggS")
    play(bench, "/rapp/package/bell.ogg", loop=True)
    assert bench.fake.body.looping == bench.agent.package / "bell.ogg"


def test_files_that_are_not_the_rapp_s_own_are_not_played(bench: Bench, tmp_path: Path) -> None:
    secret = tmp_path / "secret.ogg"
    secret.write_bytes(b"OggS")
    (bench.agent.package / "link.ogg").symlink_to(secret)
    for path in (str(secret), "/rapp/package/link.ogg", "/rapp/package/../secret.ogg", "/rapp/package/none.ogg", "bell.ogg"):
        with pytest.raises(Invalid):
            play(bench, path)


@pytest.mark.parametrize("wrong", [{"volume": 1.1}, {"volume": math.nan}, {"balance": -2.0}, {"position": -1.0}])
def test_settings_out_of_range_are_not_played(bench: Bench, wrong: dict[str, float]) -> None:
    (bench.agent.package / "bell.ogg").write_bytes(b"OggS")
    with pytest.raises(Invalid):
        play(bench, "/rapp/package/bell.ogg", **wrong)


CALLS: dict[str, dict[str, Any]] = {
    "rapp_recognize": {"dictionary": ["word"], "timeout": 60.0},
    "rapp_record": {"duration": 60.0},
    "rapp_record_until_silence": {"path": "", "waiting_time": 60.0, "microphone_energy": 1700},
}


@pytest.mark.parametrize("name", CALLS)
def test_the_end_of_the_lease_ends_a_service_and_tidies_up(bench: Bench, name: str) -> None:
    bench.clock.at(2.0, bench.cut.set)
    with pytest.raises(Refused, match="lease"):
        bench.call(name, **CALLS[name])
    assert bench.clock.time < 2.1
    assert bench.fake.body.listener is None
    assert bench.fake.body.recording is None


@pytest.mark.parametrize(
    ("part", "method"), [("recorder", "start"), ("recorder", "energy"), ("ears", "subscribe"), ("voice", "say")]
)
def test_r07_a_microphone_that_is_gone_or_a_loudspeaker_that_is_taken_is_told_and_works_when_it_is_back(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, part: str, method: str
) -> None:
    def gone(*_args: Any) -> None:
        raise Refused("cannot do that: the device is away")

    device = {"start": "rapp_record", "energy": "rapp_record_until_silence", "subscribe": "rapp_recognize", "say": "rapp_say"}
    name = device[method]
    request_ = {**CALLS, "rapp_record": {"duration": 0.1}, "rapp_say": {"text": "hello", "language": "en"}}[name]
    with monkeypatch.context() as away:
        away.setattr(getattr(bench.fake.robot, part), method, gone)
        with pytest.raises(Refused, match="away"):
            bench.call(name, **request_)
    assert bench.fake.body.recording is None
    assert bench.fake.body.listener is None
    bench.call(name, **request_)


@pytest.mark.parametrize("name", CALLS)
def test_after_a_service_failed_the_next_one_works(bench: Bench, name: str) -> None:
    bench.fake.body.here = False
    with pytest.raises(Unreachable):
        bench.call(name, **CALLS[name])
    bench.fake.body.here = True
    bench.call("rapp_record", duration=0.1)


def test_one_service_at_a_time_has_a_device(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rapp_core.services.executor.PATIENCE", 0.0)
    outcomes: list[str] = []

    def second(name: str, **request: Any) -> Callable[[], None]:
        def call() -> None:
            try:
                bench.executor.run_for(Grant(bench.agent, bench.clock.event()), name, **request)
                outcomes.append("done")
            except CoreError as error:
                outcomes.append(str(error))

        return call

    bench.clock.at(0.5, second("rapp_record", duration=0.1))
    bench.clock.at(0.6, second("rapp_say", text="meanwhile", language="en"))
    bench.call("rapp_record", duration=1.0)
    assert outcomes == ["cannot run rapp_record: the recorder is in use; wait for the other call", "done"]
