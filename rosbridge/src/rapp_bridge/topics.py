"""What publications and subscriptions share: finding out a topic's type."""

from typing import Any

import rospy

from rapp_bridge.errors import Invalid, Unreachable
from rapp_bridge.master import Master


def topic_type(master: Master, name: str, wanted: str | None) -> str | None:
    """The topic's type, None when nobody knows it; a wanted one must be that which the master knows. Blocks.

    Raises Invalid or Unreachable.
    """
    known = master.topic_type(name)
    if known is not None and wanted and known != wanted:
        raise Invalid(f"cannot use topic {name} as {wanted}: it is {known}; use that type")
    return wanted or known


def registered(make: Any, name: str, *words: Any, **more: Any) -> Any:
    """A publisher, subscriber or service of rospy; raises Unreachable when it cannot be registered. Blocks."""
    try:
        return make(name, *words, **more)
    except (rospy.ROSException, rospy.ServiceException, OSError, ValueError) as error:
        raise Unreachable(f"cannot register {name}: {error}") from error
