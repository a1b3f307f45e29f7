"""The interpreter that hears: recording → texts → RApp, all in this process (0.2 s of one core for a command)."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from rapp_cloud.interpreter.beam import Expected
from rapp_cloud.interpreter.config import InterpreterConfig
from rapp_cloud.interpreter.errors import Refused
from rapp_cloud.interpreter.matching import chances, match
from rapp_cloud.interpreter.meaning import SentenceModel, weights_file
from rapp_cloud.interpreter.port import Commands, Interpretation
from rapp_cloud.interpreter.sound import read_sound, reduce_noise
from rapp_cloud.interpreter.speech import Recogniser, model_folder
from rapp_cloud.interpreter.words import content_words

LANGUAGES = ("en",)
"""Languages that are offered."""


class HearingInterpreter:
    """An `Interpreter`. Loading takes about 1 s, so make one per process (`make_interpreter`)."""

    def __init__(self, config: InterpreterConfig, recogniser: Recogniser, sentences: SentenceModel) -> None:
        self._config, self._recogniser, self._sentences = config, recogniser, sentences
        self._expect = lru_cache(maxsize=8)(self._make_expected)

    def interpret(self, recording: Path, commands: Commands, language: str = "en") -> Interpretation:
        """Say which RApp a recorded sentence asks for (see `Interpreter.interpret`)."""
        if language not in LANGUAGES:
            raise Refused(f"cannot interpret language {language[:20]!r}: offered are {', '.join(LANGUAGES)}")
        sound = reduce_noise(read_sound(recording, self._config.longest_recording), floor=self._config.spectral_floor)
        words = content_words([text for sentences in commands.values() for text in sentences])
        heard = self._recogniser.listen(sound, self._config.beam, self._expect(tuple(words)), self._config.word_bonus)
        weighed = chances([text.score + text.bonus for text in heard])
        texts = [(text.text, chance) for text, chance in zip(heard, weighed, strict=True)]
        return match(texts, commands, self._sentences.vector, self._config)

    def _make_expected(self, words: Sequence[str]) -> Expected:
        return self._recogniser.expect(words)


def make_interpreter() -> HearingInterpreter:
    """Load the models; the set-up function of a worker process (picklable by name). Raises Bug: models not installed."""
    vocabulary = Path(__file__).with_name("wordpiece.txt")
    return HearingInterpreter(InterpreterConfig(), Recogniser(model_folder()), SentenceModel(weights_file(), vocabulary))


@lru_cache(maxsize=1)
def _interpreter_of_this_process() -> HearingInterpreter:
    return make_interpreter()


def interpret_recording(recording: Path, commands: Commands, language: str = "en") -> Interpretation:
    """`interpret` with models that are loaded at the first call in a process: for a process pool."""
    return _interpreter_of_this_process().interpret(recording, commands, language)
