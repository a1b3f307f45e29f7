"""Modules, their memory and the room, as a client written for a real NAO calls them."""

import time

import pytest


@pytest.mark.parametrize(
    "name",
    [
        "ALMemory", "ALTextToSpeech", "ALSpeechRecognition", "ALSoundDetection", "ALAudioRecorder", "ALAudioDevice",
        "ALAudioPlayer", "SimWorld",
    ],
)  # fmt: skip
def test_every_module_answers(texted, name):
    module = texted.service(name)
    assert module.ping() is True
    assert module.version().startswith("2.1")
    assert module.getBrokerName() == "nao_sim"


def test_every_module_tells_its_methods(texted, failing):
    for name in ("ALMemory", "ALSpeechRecognition", "SimWorld"):
        module = texted.service(name)
        methods = module.getMethodList()
        assert {"ping", "getMethodHelp"} <= set(methods)
        assert not [method for method in methods if method.startswith("_")]
        assert [module.getMethodHelp(method)[0] for method in methods] == methods
        assert module.getModuleHelp()[0]
    memory = texted.service("ALMemory")
    name, does, parameters, _, gives = memory.getMethodHelp("getData")
    assert (name, parameters, gives) == ("getData", [["key", "str"]], "Any")
    assert does.startswith("The value of a key")
    assert memory.getUsage("insertData").startswith("insertData(key: str, value: Any) -> None\nSet a key")
    for question in ("getMethodHelp", "getUsage"):
        with failing(f"ALMemory::{question}", "cannot find method 'fly'"):
            getattr(memory, question)("fly")


def test_what_is_not_there_is_said(texted):
    with pytest.raises(RuntimeError, match="Cannot find service 'ALMotion'"):
        texted.service("ALMotion")
    with pytest.raises(AttributeError):
        _ = texted.service("ALMemory").noSuchMethod


@pytest.mark.parametrize("value", [1, 0.5, True, "text", [1, ["two", 3.0]], {"a": [1]}])
def test_memory_keeps_values(memory, value):
    memory.insertData("kept", value)
    assert memory.getData("kept") == value
    assert "kept" in memory.getDataListName()
    memory.removeData("kept")
    assert "kept" not in memory.getDataListName()


def test_memory_does_not_invent_data(memory, failing):
    with failing("ALMemory::getData", "data not found: none"):
        memory.getData("none")
    with failing("ALMemory::getData", "missing 1 required"):
        memory.getData()


def test_memory_knows_when_a_key_was_set_and_what_it_is(memory, failing):
    before = time.time()
    memory.insertData("dated", 5)
    value, seconds, micros = memory.getTimestamp("dated")
    assert value == 5
    assert before - 1e-5 <= seconds + micros / 1e6 <= time.time()
    assert memory.getType("dated") == "Data"
    memory.raiseEvent("dated", 6)
    assert memory.getTimestamp("dated")[0] == 6
    assert memory.getTimestamp("dated")[1:] > [seconds, micros]
    assert memory.getType("dated") == "Event"
    for question in ("getTimestamp", "getType"):
        with failing(f"ALMemory::{question}", "data not found: none"):
            getattr(memory, question)("none")


def test_each_event_reaches_its_subscribers_and_insertions_do_not(memory, events, wait_for):
    """In what order is a matter of the threads with which the client's libqi calls back."""
    raised = events("count")
    memory.insertData("count", -1)
    for number in range(50):
        memory.raiseEvent("count", number)
    wait_for(lambda: len(raised) == 50)
    assert sorted(value for _key, value in raised) == list(range(50))
    assert memory.getData("count") == 49


def test_events_call_a_clients_module_as_naoqi_did(texted, memory, failing, wait_for):
    class Listener:
        def __init__(self):
            self.heard = []

        def onEvent(self, key, value, identifier):  # noqa: N802 - as clients spell it
            self.heard.append((key, value, identifier))

    listener = Listener()
    number = texted.session.registerService("Listener", listener)
    try:
        memory.subscribeToEvent("bell", "Listener", "onEvent")
        assert memory.getSubscribers("bell") == ["Listener"]
        memory.raiseEvent("bell", "rings")
        wait_for(lambda: listener.heard == [("bell", "rings", "")])
        memory.unsubscribeToEvent("bell", "Listener")
        assert memory.getSubscribers("bell") == []
        with failing("ALMemory::unsubscribeToEvent", "Listener is not subscribed to bell"):
            memory.unsubscribeToEvent("bell", "Listener")
    finally:
        texted.session.unregisterService(number)


def test_a_world_that_is_not_there_is_said(texted, failing, folder):
    world = texted.service("SimWorld")
    with failing("SimWorld::getRobotPose", "--no-world"):
        world.getRobotPose()
    with failing("SimWorld::photograph", "--no-world"):
        world.photograph(str(folder / "room.png"))


@pytest.mark.parametrize(
    ("method", "arguments", "reason"),
    [
        ("personSay", ("hello", "nobody"), "nobody"),
        ("personSay", ("hello", "en-us", {"speed": "fast"}), "invalid literal"),
        ("personPlay", ("/none.wav",), "there is no such file"),
        ("setNoise", (-1.0,), "its level is from 0"),
        ("setNoise", ("loud",), "could not convert"),
    ],
)
def test_a_person_who_cannot_be_is_an_error(texted, failing, method, arguments, reason):
    with failing(f"SimWorld::{method}", reason):
        getattr(texted.service("SimWorld"), method)(*arguments)


def test_noise_is_set_and_measured(texted, device, wait_for):
    world = texted.service("SimWorld")
    quiet = world.getNoise()
    world.setNoise(1000.0)
    wait_for(lambda: device.getFrontMicEnergy() > 5000)
    world.setNoise(quiet)
    wait_for(lambda: device.getFrontMicEnergy() < 1700)
