"""What the core agent says by itself, beside what `refusals` and `question` put together, and the word it listens for."""

READY = "I am ready"
STOPPED = "You have stopped it"
READY_ALONE = "I am ready, but I cannot reach the platform"
NOT_UNDERSTOOD = "I did not understand you"
UNUSABLE = "The new version cannot be used, I take the one before"
NONE_OF_THEM = "All right, I do nothing"

STOP = {
    "en": "stop", "pl": "stop", "fr": "arrête", "de": "stopp", "es": "para", "it": "basta", "el": "σταμάτα", "pt": "para",
    "nl": "stop", "sv": "stopp", "da": "stop", "fi": "seis", "cs": "stop", "ru": "стой", "tr": "dur",
}  # fmt: skip
"""By which a person stops the robot, by language; in another language only a hand on its head does."""
