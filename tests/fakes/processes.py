"""Processes as the kernel tells of them."""

from pathlib import Path


def stat(pid: int) -> list[str]:
    """The fields of /proc/<pid>/stat from the state on, see proc(5).

    :raises OSError: there is no such process
    """
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()


def ended(pid: int) -> bool:
    """Whether a process has ended; one that waits for somebody to reap it has."""
    try:
        return stat(pid)[0] == "Z"
    except OSError:
        return True


def children(pid: int) -> list[int]:
    """The running children of a process, in the order of their numbers."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, parent = stat(int(folder.name))[:2]
        except OSError:
            continue  # it ended meanwhile
        if state != "Z" and int(parent) == pid:
            found.append(int(folder.name))
    return sorted(found)


def words(pid: int) -> list[str]:
    """The command line of a process; none of one that has ended."""
    return _file(pid, "cmdline").decode(errors="replace").split("\0")[:-1]


def environment(pid: int) -> bytes:
    """The environment with which a process was started, see proc(5); none of one that has ended."""
    return _file(pid, "environ")


def _file(pid: int, name: str) -> bytes:
    try:
        return Path(f"/proc/{pid}/{name}").read_bytes()
    except OSError:
        return b""


def descendants(pid: int) -> list[int]:
    """The running children of a process, theirs, and so on."""
    return [each for child in children(pid) for each in (child, *descendants(child))]
