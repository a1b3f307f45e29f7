"""Greets the person by the name in their profile: the smallest RApp that uses robot and cloud."""

from rapp_api import DynamicAgent, cloud, communication


class Hello(DynamicAgent):
    """The dynamic agent."""

    def execute(self) -> None:
        """Ask the repository agent who the person is, and greet them."""
        name = cloud.call_wait("profile")["name"]
        communication.text_to_speech(f"hello {name}, I am happy to see you")
