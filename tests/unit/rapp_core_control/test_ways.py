"""Ways through the core FSM (paper Fig. 2), everything around it in memory."""

import pytest

from fakes.agents import FakeAgent, Script
from fakes.core_home import KEYWORD, LONG, Home, ask
from fakes.rapps import install_rapp
from fakes.robot import FakeVoice
from rapp_core.control.refusals import not_delivered
from rapp_core.errors import Refused
from rapp_core.ports import Undelivered

# from s1 to s3


def test_initialises_registers_says_so_and_listens(home: Home) -> None:
    home.step_until(lambda: home.machine.state == "s3")
    assert home.states() == ["s1", "s2", "s3"]
    assert home.fake.said() == ["I am ready"]
    assert home.fake.journal[:4] == ["prepare", "stop motion", "stop playing", "hush"]
    assert home.link.names() == ["register", "list_rapps"]


def test_without_the_platform_it_listens_all_the_same_and_says_so(home: Home) -> None:
    home.link.away = True
    home.step_until(lambda: home.machine.state == "s3")
    assert home.fake.said() == ["I am ready, but I cannot reach the platform"]


def test_waits_for_a_robot_that_is_off(home: Home) -> None:
    home.fake.body.here = False
    home.clock.at(30.0, lambda: setattr(home.fake.body, "here", True))
    home.step_until(lambda: home.machine.state == "s3")
    assert 30.0 <= home.clock.time < 32.0


# late news


def test_a_mail_that_was_refused_after_it_was_kept_is_told_once_before_it_listens_on(home: Home) -> None:
    home.start()
    mail = Undelivered("<1@nao>", ("e@home.example",))
    home.clock.at(home.clock.time + 1.0, lambda: setattr(home.link, "undelivered", mail))
    told: list[float] = []
    home.link.answers["mail_told"] = lambda _arguments: told.append(home.clock.time)
    home.fake.person_says_at(home.clock.time + 20.0, "what time is it", seconds=1.0)
    assert home.round() == KEYWORD
    assert told[0] < home.config.listening_round, "it does not wait for the end of a quiet round"
    assert ("mail_told", {"message_id": "<1@nao>", "recipients": ["e@home.example"], "late": True}) in home.link.asked
    assert [(each.state, each.detail) for each in home.happenings if each.kind == "said"] == [
        ("s3", not_delivered(mail.recipients))
    ]


def test_of_one_mail_each_recipient_is_told(home: Home) -> None:
    home.start()
    for name in ("e@home.example", "f@home.example"):
        home.link.undelivered = Undelivered("<1@nao>", (name,))
        home.step_until(lambda name=name: home.fake.said()[-1:] == [not_delivered((name,))])  # type: ignore[misc]
    told = [arguments["recipients"] for name, arguments in home.link.asked if name == "mail_told"]
    assert told == [["e@home.example"], ["f@home.example"]]


def test_late_news_that_cannot_be_said_waits_and_the_link_hears_nothing_of_it(home: Home) -> None:
    home.start()
    home.link.undelivered = Undelivered("<1@nao>", ("e@home.example",))
    home.fake.body.here = False
    home.machine.step(home.share)
    assert "mail_told" not in home.link.names()
    home.fake.body.here = True
    home.link.answers["mail_told"] = {"told": True}
    home.step_until(lambda: "mail_told" in home.link.names())
    assert home.fake.said()[-1] == not_delivered(("e@home.example",))


def test_a_robot_that_cannot_say_its_late_news_listens_on(home: Home, monkeypatch: pytest.MonkeyPatch) -> None:
    def say(_voice: FakeVoice, _text: str, _language: str) -> None:
        raise Refused("cannot say it: the loudspeaker is broken")

    home.start()
    monkeypatch.setattr(FakeVoice, "say", say)
    home.link.undelivered = Undelivered("<1@nao>", ("e@home.example",))
    begun = home.clock.time
    for _ in range(3):
        home.machine.step(home.share)
    assert home.clock.time - begun > home.config.listening_round


# ways through


def test_an_isolated_keyword_runs_its_rapp(home: Home) -> None:
    home.start()
    ask(home)
    assert home.round() == KEYWORD
    assert ("install", {"name": "clock"}) in home.link.asked
    assert "interpret" not in home.link.names()
    assert home.fake.said() == []


def test_a_long_command_is_recorded_and_the_platform_names_the_rapp(home: Home) -> None:
    home.link.answers["interpret"] = {
        "rapp": "clock",
        "confidence": 0.9,
        "text": "please tell me how late it is",
        "candidates": [],
    }
    home.start()
    ask(home, "please tell me how late it is", seconds=2.5, probability=0.1)
    assert home.round() == LONG
    recording = home.config.home / "listening" / "command.ogg"
    assert ("interpret", {"recording": str(recording), "language": "en"}) in home.link.asked
    assert recording.exists()
    assert [each.detail for each in home.happenings if each.kind == "heard"] == ["please tell me how late it is"]


def test_dismantling_follows_the_order_of_the_design(home: Home) -> None:
    home.start()
    ask(home)
    home.round()
    told = [m for m in home.messages() if "dynamic" in m]
    assert told == [
        "core->dynamic activate (asynchronous)", "dynamic->core first_word (asynchronous)",
        "dynamic->core terminate (asynchronous)", "core->dynamic dismantle (asynchronous)", "dynamic->core gone (asynchronous)",
        "core: dynamic agent destroyed",
    ]  # fmt: skip
    journal = home.fake.journal
    assert journal.index("dismantle") < journal.index("end") < journal.index("prepare")


def test_the_lease_is_the_run_s_from_activation_to_its_end(home: Home) -> None:
    held: list[bool] = []

    def look(agent: FakeAgent) -> None:
        held.append(home.lease.check(agent.token).run is agent)

    home.agents.script = Script(acts=[(0.05, look), (0.9, look)])
    home.start()
    ask(home)
    home.round()
    assert held == [True, True]
    with pytest.raises(Refused):
        home.lease.check(home.agents.runs[0].token)


def test_an_installed_rapp_runs_without_link_and_without_delay(home: Home) -> None:
    home.link.away = True
    install_rapp(home.config.home, "clock", keywords=("what time is it",))
    home.start()
    asked = len(home.link.asked)
    ask(home)
    assert home.round() == KEYWORD
    assert len(home.link.asked) == asked


def test_a_rapp_that_comes_on_offer_is_listened_for_at_once(home: Home) -> None:
    home.link.away = True
    home.start()

    def come_back() -> None:
        home.link.away = False
        home.platform.attempt()

    home.clock.at(home.clock.time + 2.0, come_back)
    home.fake.person_says_at(home.clock.time + 3.0, "what time is it")
    assert home.round() == KEYWORD
    assert home.clock.time < home.config.listening_round


def test_one_run_after_another(home: Home) -> None:
    home.start()
    for _ in range(3):
        home.happenings[:] = home.happenings[:1]
        ask(home)
        assert home.round() == KEYWORD
    assert not any(run.alive for run in home.agents.runs)
    assert len(home.agents.runs) == 3
