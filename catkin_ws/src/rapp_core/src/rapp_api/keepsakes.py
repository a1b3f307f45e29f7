"""What a RApp leaves behind: all else that it writes ends with its run."""

from rapp_api.core_agent import current


def keep(name: str, data: bytes) -> str:
    """Have the core agent keep a file, such as "table.jpg", in the robot's data folder; gives its path there.

    A file of the same name replaces the one that this RApp has kept before. Raises Invalid for a name with more than letters,
    digits and ._- in it, Refused when the RApp keeps too much (64 MB; 8 MB for one file).
    """
    return current().keep(name, bytes(data))
