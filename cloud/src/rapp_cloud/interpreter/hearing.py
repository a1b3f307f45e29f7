"""The interpreter that hears: recording → texts → RApp, all in this process (0.2 s of one core for a command)."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from rapp_cloud.interpreter.beam import Expected
from rapp_cloud.interpreter.config import InterpreterConfig
from rapp_cloud.interpreter.errors import Refused
from rapp_cloud.interpreter.kept import KeptVectors
from rapp_cloud.interpreter.matching import Offered, chances, match
from rapp_cloud.interpreter.meaning import MODEL, SentenceModel, weights_file
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
        self._commands: Commands | None = None
        self._offered: Offered | None = None
        self._expected = Expected()

    def learn(self, sentences: Sequence[str], language: str = "en") -> None:
        """Work out what takes long, before a recording is interpreted against these sentences (see `Interpreter.learn`)."""
        if language in LANGUAGES:
            self._sentences.learn(sentences)

    def interpret(self, recording: Path, commands: Commands, language: str = "en") -> Interpretation:
        """Say which RApp a recorded sentence asks for (see `Interpreter.interpret`)."""
        if language not in LANGUAGES:
            raise Refused(f"cannot interpret language {language[:20]!r}: offered are {', '.join(LANGUAGES)}")
        sound = reduce_noise(read_sound(recording, self._config.longest_recording), floor=self._config.spectral_floor)
        offered = self._ready_for(commands)
        heard = self._recogniser.listen(sound, self._config.beam, self._expected, self._config.word_bonus)
        weighed = chances([text.score + text.bonus for text in heard])
        texts = [(text.text, chance) for text, chance in zip(heard, weighed, strict=True)]
        return match(texts, offered, self._sentences.vectors, self._config)

    def _ready_for(self, commands: Commands) -> Offered:
        if self._offered is None or commands != self._commands:
            self._offered = Offered(commands, self._sentences.learnt)
            words = content_words([text for sentences in commands.values() for text in sentences])
            self._expected, self._commands = self._recogniser.expect(words), commands
        return self._offered


def make_interpreter(cache: Path | None = None) -> HearingInterpreter:
    """Load the models; the set-up function of a worker process (picklable by name). Raises Bug: models not installed.

    :param cache: folder for what was worked out once; None: none
    """
    vocabulary = Path(__file__).with_name("wordpiece.txt")
    kept = None
    if cache is not None:
        cache.mkdir(parents=True, exist_ok=True, mode=0o700)
        kept = KeptVectors(cache / f"{MODEL}.vectors")
    return HearingInterpreter(InterpreterConfig(), Recogniser(model_folder()), SentenceModel(weights_file(), vocabulary, kept))


@lru_cache(maxsize=1)
def _interpreter_of_this_process() -> HearingInterpreter:
    return make_interpreter()


def interpret_recording(recording: Path, commands: Commands, language: str = "en") -> Interpretation:
    """`interpret` with models that are loaded at the first call in a process: for a process pool."""
    return _interpreter_of_this_process().interpret(recording, commands, language)
