"""How well long commands are interpreted from their sound: right / wrong RApp / not understood.

Judged on sentences of `interpret_sentences.json` that no catalogue holds, spoken by espeak-ng voices in pink noise, through
`rapp_cloud.interpreter` as the platform runs it (recording written as ogg, read again). Exit status 1 when more than 2 %
of all answers name a wrong RApp (for a foreign sentence: any). `--part development` runs the sentences that the settings
were chosen with.
"""

import argparse
import hashlib
import io
import json
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import soundfile
from numpy.typing import NDArray

from rapp_cloud.interpreter.hearing import interpret_recording

SENTENCES = Path(__file__).with_name("interpret_sentences.json")
NOISES = (20, 10, 5, 0)  # dB, speech to noise over the speech
ALLOWED_WRONG = 0.02  # of all answers
RATE = 22050  # Hz, espeak-ng's own
SPEED = 150  # words a minute
BEFORE, AFTER = 0.4, 0.6  # seconds of noise around the speech
QUICK_STEP = 5  # --quick takes every fifth utterance
HEAD = (
    f"{'':<22}{'commands':^27}   |{'foreign sentences':^19}   |{'all':^16}\n"
    f"{'':<22}{'right':>8}{'wrong':>9}{'not und.':>10}   |{'refused':>10}{'wrong':>9}   |{'wrong':>9}{'count':>7}"
)


@dataclass(frozen=True)
class Utterance:
    """One sentence as it is said."""

    text: str
    meant: str | None
    voice: str
    noise: int


@dataclass(frozen=True)
class Answer:
    """What came of it."""

    utterance: Utterance
    named: str | None
    confidence: float
    heard: str

    @property
    def verdict(self) -> str:
        if self.named == self.utterance.meant:
            return "right"
        return "not understood" if self.named is None else "wrong"


def utterances(part: dict) -> list[Utterance]:
    said = [(text, name) for name, texts in part["said"].items() for text in texts]
    said += [(text, None) for text in part["foreign"]]
    return [Utterance(text, meant, voice, noise) for text, meant in said for voice in part["voices"] for noise in NOISES]


def speak(text: str, voice: str) -> NDArray[np.float64]:
    words = ["espeak-ng", "--stdout", "-v", voice, "-s", str(SPEED), "--", text]
    sound = subprocess.run(words, stdout=subprocess.PIPE, check=True, timeout=20).stdout
    samples, rate = soundfile.read(io.BytesIO(sound), dtype="float64")
    assert rate == RATE
    return samples * 0.5


def pink(count: int, random: np.random.Generator) -> NDArray[np.float64]:
    """Noise of RMS 1 whose power falls as 1/f above 20 Hz."""
    spectrum = np.fft.rfft(random.standard_normal(count))
    frequencies = np.fft.rfftfreq(count, 1 / RATE)
    noise = np.fft.irfft(spectrum / np.sqrt(np.maximum(frequencies, 20)), count)
    return noise / np.sqrt(np.mean(noise**2))


def record(utterance: Utterance, file: Path) -> None:
    """The utterance in its noise as an ogg file, the same in every run."""
    seed = hashlib.sha256(repr(utterance).encode()).digest()[:8]
    random = np.random.default_rng(int.from_bytes(seed, "big"))
    speech = speak(utterance.text, utterance.voice)
    level = np.sqrt(np.mean(speech**2)) * 10 ** (-utterance.noise / 20)
    sound = np.concatenate([np.zeros(int(BEFORE * RATE)), speech, np.zeros(int(AFTER * RATE))])
    sound = np.clip(sound + level * pink(len(sound), random), -1, 1)
    soundfile.write(file, sound, RATE, format="OGG", subtype="VORBIS")


def judge(utterance: Utterance, commands: dict[str, list[str]]) -> Answer:
    with tempfile.TemporaryDirectory(prefix="rapp-interpret-") as folder:
        file = Path(folder) / "command.ogg"
        record(utterance, file)
        found = interpret_recording(file, commands)
    return Answer(utterance, found.rapp, found.confidence, found.text)


def line(title: str, answers: Iterable[Answer]) -> str:
    """One line of the table: commands, then foreign sentences, then wrong among all."""
    answers = list(answers)
    commands = Counter(a.verdict for a in answers if a.utterance.meant)
    foreign = Counter(a.verdict for a in answers if a.utterance.meant is None)
    all_commands, all_foreign = max(1, commands.total()), max(1, foreign.total())
    return (
        f"{title:<22}{commands['right'] / all_commands:8.1%}{commands['wrong'] / all_commands:9.1%}"
        f"{commands['not understood'] / all_commands:10.1%}   |{foreign['right'] / all_foreign:10.1%}"
        f"{foreign['wrong'] / all_foreign:9.1%}   |{wrong_share(answers):9.1%}{len(answers):7d}"
    )


def wrong_share(answers: list[Answer]) -> float:
    return sum(a.verdict == "wrong" for a in answers) / len(answers)


def table(answers: list[Answer], voices: list[str]) -> str:
    by_voice = [line(f"voice {v}", (a for a in answers if a.utterance.voice == v)) for v in voices]
    by_noise = [line(f"{n} dB", (a for a in answers if a.utterance.noise == n)) for n in NOISES]
    both = [
        line(f"{v} {n} dB", (a for a in answers if a.utterance.voice == v and a.utterance.noise == n))
        for v in voices
        for n in NOISES
    ]
    return "\n".join([HEAD, *both, "", *by_voice, "", *by_noise, "", line("overall", answers)])


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a fifth of the utterances, within a minute")
    parser.add_argument("--part", choices=("judging", "development"), default="judging")
    parser.add_argument("--details", action="store_true", help="list what was wrong or not understood")
    parser.add_argument("--workers", type=int, default=2, help="processes (default 2)")
    return parser.parse_args()


def main() -> int:
    chosen = options()
    part = json.loads(SENTENCES.read_text(encoding="utf-8"))[chosen.part]
    said = utterances(part)[:: QUICK_STEP if chosen.quick else 1]
    with ProcessPoolExecutor(chosen.workers) as pool:
        answers = list(pool.map(judge, said, [part["catalogue"]] * len(said), chunksize=4))
    if chosen.details:
        for a in sorted((a for a in answers if a.verdict != "right"), key=lambda a: (a.verdict, -a.confidence)):
            u = a.utterance
            print(f"{a.verdict:15}{a.named or '-':15}{a.confidence:5.2f} {u.voice} {u.noise} dB: {u.text} > {a.heard}")
    print(f"{len(part['catalogue'])} RApps, sentences not in the catalogue ({chosen.part} set), pink noise\n")
    print(table(answers, part["voices"]))
    wrong = wrong_share(answers)
    print(f"\nwrong RApp: {wrong:.1%} of all answers, allowed {ALLOWED_WRONG:.0%}")
    return 0 if wrong <= ALLOWED_WRONG else 1


if __name__ == "__main__":
    sys.exit(main())
