"""The link's side towards ROS."""

from unittest.mock import Mock

from rapp_link.ros_side import RosSide


def test_the_line_to_the_bridge_holds_nothing_back() -> None:
    """Nagle's algorithm would keep what follows an answer until the bridge has acknowledged that: 40 ms for each call."""
    nothing = Mock()
    side = RosSide("ws://127.0.0.1:9090", (), nothing, nothing, nothing)
    protocol = Mock(_message_handlers={})
    side._announce(protocol)
    protocol.transport.setTcpNoDelay.assert_called_once_with(True)
    assert side.connected
