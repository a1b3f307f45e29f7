"""Samples for a client's module: of the right number, as the module declares them, and never more than it takes."""

import numpy
import pytest

from rapp_nao_sim.modules.audio_device import BEHIND, PERIOD, Feed
from rapp_nao_sim.naoqi import NaoqiError
from rapp_nao_sim.sound.room import BLOCK


class Answer:
    def __init__(self):
        self.finished = True

    def isFinished(self):  # noqa: N802 - libqi's spelling
        return self.finished


class ClientModule:
    """A module of a client, as libqi shows it."""

    def __init__(self, signature="(iimr)"):
        self.signature = signature
        self.calls = []
        self.answers = []
        self.gone = False

    def metaObject(self):  # noqa: N802
        method = {"name": "processRemote" if self.signature else "other", "parametersSignature": self.signature}
        return {"methods": {1: {"name": "ping", "parametersSignature": "()"}, 100: method}}

    def call(self, name, *args, _async):
        if self.gone:
            raise RuntimeError("Socket is not connected")
        assert (name, _async) == ("processRemote", True)
        self.calls.append(args)
        self.answers.append(Answer())
        return self.answers[-1]


def give(feed, blocks, start=0):
    samples = numpy.arange(start * BLOCK, (start + blocks) * BLOCK, dtype=numpy.int16)
    for block in samples.reshape(-1, BLOCK):
        feed.feed(block)
    return samples


def test_periods_are_exact_and_nothing_is_lost_between_them():
    module = ClientModule()
    samples = give(Feed(module, "client"), 30)
    assert [(channels, count) for channels, count, _stamp, _raw in module.calls] == [(1, PERIOD)] * (len(samples) // PERIOD)
    joined = numpy.frombuffer(b"".join(raw for *_, raw in module.calls), "<i2")
    assert (joined == samples[: len(joined)]).all()
    seconds, micros = module.calls[0][2]
    assert seconds > 1_600_000_000
    assert 0 <= micros < 1_000_000


def test_a_module_that_declares_no_type_gets_one_character_for_each_byte():
    raw, text = ClientModule(), ClientModule("(mmmm)")
    for module in (raw, text):
        give(Feed(module, "client"), 10)
    assert isinstance(text.calls[0][3], str)
    assert text.calls[0][3].encode("latin-1") == raw.calls[0][3]


def test_a_module_without_the_method_is_refused():
    with pytest.raises(NaoqiError, match="processRemote"):
        Feed(ClientModule(""), "client")


def test_a_module_that_hangs_is_not_swamped_and_goes_on_later():
    module = ClientModule()
    feed = Feed(module, "client")
    give(feed, 9)
    module.answers[0].finished = False
    give(feed, 200)
    assert len(module.calls) == BEHIND
    module.answers[0].finished = True
    give(feed, 9)
    assert len(module.calls) == BEHIND + 1


def test_a_module_that_is_gone_is_called_no_more(caplog):
    module = ClientModule()
    feed = Feed(module, "client")
    module.gone = True
    with caplog.at_level("INFO"):
        give(feed, 100)
    module.gone = False
    give(feed, 100)
    assert module.calls == []
    assert [record.message for record in caplog.records] == ["client gets no more samples: Socket is not connected"]
