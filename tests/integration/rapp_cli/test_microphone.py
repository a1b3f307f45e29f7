"""Recording with arecord from a source of sound that needs no sound card: ALSA's file and null plug-ins."""

import asyncio
from pathlib import Path

import numpy as np
import pytest

from rapp_cli.errors import CommandError
from rapp_cli.home.microphone import hear
from rapp_nao_sim.sound.samples import RATE
from rapp_nao_sim.sound.synthesis import speak

DEVICE = """pcm.talker {{ type file slave.pcm "null" file "/dev/null" infile "{}" format "raw" }}"""


@pytest.fixture
def talker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> np.ndarray:
    """A device that gives somebody's voice; their voice."""
    voice = speak("please bring some water", "en-us+m3", 150)
    noise = np.random.default_rng(3).normal(0, 0.001, len(voice) + 5 * RATE)
    noise[RATE : RATE + len(voice)] += 0.5 * voice / np.abs(voice).max()
    (tmp_path / "talk.raw").write_bytes((noise * 32767).astype("<i2").tobytes())
    (tmp_path / ".asoundrc").write_text(DEVICE.format(tmp_path / "talk.raw"))
    monkeypatch.setenv("HOME", str(tmp_path))
    return np.asarray(voice)


def test_what_is_said_into_the_microphone_is_heard_whole(talker: np.ndarray) -> None:
    heard = asyncio.run(hear("talker"))
    assert len(talker) <= len(heard) < len(talker) + 3 * RATE
    loud = np.abs(heard) > 3000
    voice = 0.5 * 32767 * talker / np.abs(talker).max()
    assert loud.sum() == pytest.approx((np.abs(voice) > 3000).sum(), rel=0.02)


def test_a_device_that_is_not_there_is_named_with_the_next_step(talker: np.ndarray) -> None:
    with pytest.raises(CommandError, match=r"cannot record from nowhere: .*arecord -l"):
        asyncio.run(hear("nowhere"))


def test_a_computer_without_arecord_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(CommandError, match="alsa-utils"):
        asyncio.run(hear("default"))
