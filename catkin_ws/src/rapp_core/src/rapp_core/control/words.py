"""What the core agent says by itself, beside what `refusals` and `question` put together."""

READY = "I am ready"
STOPPED = "You have stopped it"
READY_ALONE = "I am ready, but I cannot reach the platform"
NOT_UNDERSTOOD = "I did not understand you"
NONE_OF_THEM = "All right, I do nothing"
