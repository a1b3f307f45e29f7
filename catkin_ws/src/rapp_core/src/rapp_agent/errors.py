"""What can be wrong with an agent's structure or use; all of it is a bug of the program that built the agent."""


class AgentError(Exception):
    """Root of the errors of this package."""


class GraphError(AgentError):
    """The graph of a machine is not sound; the text names the state and what is missing."""


class BufferFull(AgentError):  # noqa: N818 - the name of the condition, as queue.Full
    """A bounded buffer has no room; take something out, or drop the item."""
