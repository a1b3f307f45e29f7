"""What the simulated person is to say, looked at before anything starts: the voice is there, the message fits into a recording."""

import json

from rapp_cli.demo.config import VOICE_MAIL, DemoConfig
from rapp_cli.demo.story import THINKING
from rapp_cli.errors import UsageError
from rapp_cli.paths import STORE
from rapp_nao_sim.sound.samples import RATE
from rapp_nao_sim.sound.synthesis import VoiceError, speak

LATE = 0.4  # s by which a person may begin later on a busy machine


def check_speech(config: DemoConfig) -> None:
    """Raises UsageError for a voice that is not there, and for a message that voice_mail would cut."""
    message = config.message if config.story == VOICE_MAIL else config.command
    try:
        takes = len(speak(message, config.voice)) / RATE
    except VoiceError as error:
        raise UsageError(f"cannot use --voice {config.voice}: {error}") from error
    records = json.loads((STORE / "voice_mail" / "package.json").read_text())["rapp"]["parameters"]["message_seconds"]
    fits = records - THINKING - LATE
    if config.story == VOICE_MAIL and takes > fits:
        raise UsageError(f"cannot record the whole --message: it takes {takes:.1f} s, voice_mail has {fits:.1f} s; make it shorter")
