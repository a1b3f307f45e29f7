"""Finding what was said in what a microphone gives."""

import numpy as np
import pytest

from rapp_cli.errors import CommandError
from rapp_cli.home.microphone import LONGEST, PATIENCE, _Speech
from rapp_nao_sim.sound.room import BLOCK, Block
from rapp_nao_sim.sound.samples import RATE

RANDOM = np.random.default_rng(7)


def sound(*parts: tuple[float, float]) -> Block:
    """Noise: seconds and level of each part."""
    return np.concatenate([RANDOM.normal(0, level, round(seconds * RATE)) for seconds, level in parts]).astype("<i2")


def heard(samples: Block) -> Block | None:
    speech = _Speech()
    for start in range(0, len(samples) - BLOCK, BLOCK):
        if speech.take(samples[start : start + BLOCK]):
            return speech.samples()
    return None


def test_pauses_within_a_sentence_do_not_end_it() -> None:
    found = heard(sound((1, 30), (0.7, 3000), (0.9, 30), (0.7, 3000), (3, 30)))
    assert found is not None
    assert 2.3 < len(found) / RATE < 5


def test_who_is_still_speaking_is_not_cut_off() -> None:
    assert heard(sound((1, 30), (3, 3000))) is None


def test_who_never_stops_is_cut_off() -> None:
    waves = [(0.5, 30), *[(0.5, 3000), (0.2, 30)] * 100]
    found = heard(sound(*waves))
    assert found is not None
    assert LONGEST <= len(found) / RATE < LONGEST + 1


def test_quiet_is_said() -> None:
    with pytest.raises(CommandError, match="quiet"):
        heard(sound((PATIENCE + 1, 30)))
