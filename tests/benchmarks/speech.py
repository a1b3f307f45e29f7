"""How well the robot's ears spot isolated words, by size of vocabulary, voice and noise; and long commands, more shortly.

    ./rapp bench speech [--quick] [--part development]

Words of `speech_words.json`, names and words that no dictionary has among them, are spoken by espeak-ng voices other than the
robot's in pink noise, cut out by the simulator's end-pointer and recognised as the robot does it, with the core agent's
threshold. In the same run, as the bare limit: a plain pocketsphinx grammar, which rejects nothing. Long commands go through
the platform's interpreter (`./rapp bench interpret` says more of it).

`--part development` runs the words that the settings were chosen with, and prints the weights that suit them best: logistic
regression, then a constant such that at most 6 % of the words outside the vocabulary reach the threshold.
Exit status 1 when more than 5 % do on the words judged with.
"""

import argparse
import hashlib
import json
import math
import sys
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from itertools import groupby
from pathlib import Path

import interpret
import numpy as np
from numpy.typing import NDArray
from pocketsphinx import Decoder
from spotting import CLEAN, SIZES, Answer, Case, Rates, cases, fit, groups, rates, shifted

from rapp_core.config import Config
from rapp_nao_sim.config import Config as SimConfig
from rapp_nao_sim.sound.endpointer import Ended, Endpointer
from rapp_nao_sim.sound.room import BLOCK, Block
from rapp_nao_sim.sound.samples import RATE
from rapp_nao_sim.sound.synthesis import speak
from rapp_nao_sim.speech.pronunciation import pronounce
from rapp_nao_sim.speech.recogniser import Evidence, Recogniser, probability
from rapp_nao_sim.speech.words import spoken_words

WORDS = Path(__file__).with_name("speech_words.json")
NOISES = (CLEAN, 20, 10, 5, 0)  # dB
BEFORE, AFTER = 1.2, 1.0  # s of noise around the word: the end-pointer learns the floor, and waits for the end
ALLOWED = 0.06  # false accepts when settings are chosen: on common words, many of them like one of the vocabulary
TOLERATED = 0.05  # false accepts on words never chosen with
QUICK_VOICES = 1
LONG_STEP, QUICK_LONG_STEP = 13, 41  # every so many utterances of the long commands; odd, so that all noises have their turn


def sound_of(word: str, voice: str, noise: int) -> NDArray[np.int16]:
    """What the microphone hears, the same in every run."""
    seed = hashlib.sha256(repr((word, voice, noise)).encode()).digest()[:8]
    random = np.random.default_rng(int.from_bytes(seed, "big"))
    config = SimConfig()
    speech = speak(word, voice).astype(np.float64) * config.person_level
    sound = np.concatenate([np.zeros(int(BEFORE * RATE)), speech, np.zeros(int(AFTER * RATE))])
    sound += random.normal(0, config.ambient / 32768, len(sound))
    if noise != CLEAN:
        sound += np.sqrt(np.mean(speech**2)) * 10 ** (-noise / 20) * interpret.pink(len(sound), random)
    return np.clip(sound * 32767, -32768, 32767).astype(np.int16)


def cut_out(sound: NDArray[np.int16]) -> Block | None:
    """The first sound that the end-pointer finds."""
    endpointer = Endpointer()
    for start in range(0, len(sound) - BLOCK + 1, BLOCK):
        change = endpointer.feed(sound[start : start + BLOCK])
        if isinstance(change, Ended):
            return change.samples
    return None


def prepare(key: tuple[str, str, int], folder: Path) -> None:
    """Write the sound to recognise; nothing when there is none."""
    samples = cut_out(sound_of(*key))
    if samples is not None:
        np.save(folder / _file(key), samples)


def _file(key: tuple[str, str, int]) -> str:
    return hashlib.sha256(repr(key).encode()).hexdigest()[:16] + ".npy"


class Plain:
    """Pocketsphinx with a grammar and nothing else set: the best word, whatever was said."""

    def __init__(self) -> None:
        self._decoder = Decoder(samprate=RATE, lm=None, loglevel="FATAL")
        self._phrases: dict[str, str] = {}

    def set_vocabulary(self, vocabulary: Sequence[str]) -> None:
        self._phrases = {" ".join(spoken_words(phrase)): phrase for phrase in vocabulary}
        for word in {word for phrase in self._phrases for word in phrase.split()}:
            if self._decoder.lookup_word(word) is None:
                self._decoder.add_word(word, pronounce(word), True)
        self._decoder.add_jsgf_string("words", f"#JSGF V1.0; grammar g; public <w> = {' | '.join(self._phrases)} ;")
        self._decoder.activate_search("words")

    def recognise(self, samples: Block) -> str | None:
        self._decoder.start_utt()
        self._decoder.process_raw(samples.tobytes(), full_utt=True)
        self._decoder.end_utt()
        found = self._decoder.hyp()
        return self._phrases.get(found.hypstr) if found is not None else None


@cache
def recognisers() -> tuple[Recogniser, Plain]:
    """Those of this process: a decoder takes a while to make, and memory."""
    return Recogniser(), Plain()


def answer(said: list[Case], words: list[str], folder: Path) -> list[Answer]:
    """Answers to cases of one vocabulary."""
    recogniser, plain = recognisers()
    for each in (recogniser, plain):
        each.set_vocabulary(groups(words, said[0].size)[said[0].group])
    answers = []
    for case in said:
        file = folder / _file((case.word, case.voice, case.noise))
        if file.exists():
            samples = np.load(file)
            answers.append(Answer(case, True, recogniser.compare(samples), plain.recognise(samples)))
        else:
            answers.append(Answer(case, False, None, None))
    return answers


def spot(part: dict[str, list[str]], noises: Sequence[int], voices: Sequence[str], workers: int) -> list[Answer]:
    """All answers of one part of the words."""
    said = sorted(cases(part["vocabulary"], part["outside"], voices, noises), key=lambda c: (c.size, c.group))
    pieces = [list(piece) for _, piece in groupby(said, key=lambda c: (c.size, c.group, c.voice))]
    with tempfile.TemporaryDirectory(prefix="rapp-speech-") as folder, ProcessPoolExecutor(workers) as pool:
        keys = sorted({(c.word, c.voice, c.noise) for c in said})
        list(pool.map(partial(prepare, folder=Path(folder)), keys, chunksize=16))
        found = pool.map(partial(answer, words=part["vocabulary"], folder=Path(folder)), pieces)
        return [one for some in found for one in some]


def judged(found: Evidence, size: int) -> float:
    return probability(found.ratio, found.frames, size)


def line(title: str, counted: Rates) -> str:
    shares = (counted.right, counted.wrong, counted.unnoticed, counted.false, counted.bare_right, counted.bare_false)
    return f"{title:<24}" + "".join(f"{share:12.1%}" if not math.isnan(share) else f"{'-':>12}" for share in shares)


def table(answers: list[Answer], threshold: float) -> str:
    """Rates by size and noise, by voice, and of all."""

    def row(title: str, wanted: Callable[[Case], bool]) -> str:
        return line(title, rates([a for a in answers if wanted(a.case)], judged, threshold))

    def size_and_noise(size: int, noise: int) -> str:
        return row(f"{size} words, {_noise(noise)}", lambda c: (c.size, c.noise) == (size, noise))

    noises = sorted({a.case.noise for a in answers}, reverse=True)
    voices = sorted({a.case.voice for a in answers})
    head = f"{'':<24}{'right':>12}{'wrong word':>12}{'not noticed':>12}{'outside: in':>12}{'bare: right':>12}{'bare: in':>12}"
    blocks = [[size_and_noise(size, noise) for noise in noises] for size in SIZES]
    blocks.append([row(f"{size} words", lambda c, size=size: c.size == size) for size in SIZES])  # type: ignore[misc]
    blocks.append([row(voice, lambda c, voice=voice: c.voice == voice) for voice in voices])  # type: ignore[misc]
    blocks.append([row(_noise(noise), lambda c, noise=noise: c.noise == noise) for noise in noises])  # type: ignore[misc]
    blocks.append([row("all", lambda _: True)])
    return head + "\n" + "\n\n".join("\n".join(block) for block in blocks)


def _noise(noise: int) -> str:
    return "clean" if noise == CLEAN else f"{noise} dB"


def long_commands(step: int, part_name: str, workers: int) -> str:
    """The interpreter's table by noise, of every `step`th of its utterances."""
    part = json.loads(interpret.SENTENCES.read_text(encoding="utf-8"))[part_name]
    said = interpret.utterances(part)[::step]
    with ProcessPoolExecutor(workers) as pool:
        answers = list(pool.map(interpret.judge, said, [part["catalogue"]] * len(said), chunksize=4))
    rows = [interpret.line(f"{noise} dB", [a for a in answers if a.utterance.noise == noise]) for noise in interpret.NOISES]
    return "\n".join([interpret.HEAD, *rows, interpret.line("all", answers)])


def suiting(answers: list[Answer], threshold: float) -> str:
    """The weights that suit these answers best, for `recogniser.WEIGHTS`."""
    weights = shifted(fit(answers), answers, threshold, ALLOWED)
    return "recogniser.WEIGHTS = (" + ", ".join(f"{weight:.3f}" for weight in weights) + ")"


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="bench speech", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one voice, three noises, few long commands: within a minute")
    parser.add_argument("--part", choices=("judging", "development"), default="judging")
    parser.add_argument("--workers", type=int, default=2, help="processes (%(default)s)")
    return parser.parse_args()


def main() -> int:
    chosen, threshold = options(), Config().threshold
    part = json.loads(WORDS.read_text(encoding="utf-8"))[chosen.part]
    noises = NOISES[::2] if chosen.quick else NOISES
    voices = part["voices"][: QUICK_VOICES if chosen.quick else None]
    answers = spot(part, noises, voices, chosen.workers)
    print(
        f"isolated words ({chosen.part} set), {len(answers)} cases, threshold {threshold:g}; “in”: taken for a word they are not\n"
    )
    print(table(answers, threshold))
    if chosen.part == "development":
        print("\n" + suiting(answers, threshold))
    print(f"\nlong commands ({chosen.part} set)\n")
    print(long_commands(QUICK_LONG_STEP if chosen.quick else LONG_STEP, chosen.part, chosen.workers))
    false = rates(answers, judged, threshold).false
    print(f"\nwords outside the vocabulary let in: {false:.1%}, tolerated {TOLERATED:.0%}")
    return 0 if false <= TOLERATED else 1


if __name__ == "__main__":
    sys.exit(main())
