"""The bubblewrap sandbox of a cloud agent: what it sees, and what it may use. Pure but for looking up where Python is.

It sees a read-only system, the Python environment, `rapp_hop`, its own package, the socket of a_rep, and one private folder, which
is of bounded size, in memory, and ends with it. It inherits its channel and its listening socket, and no environment. Its network
is its own and empty: not even the platform's loopback is in it. /proc is empty, for in a container none can be mounted.
"""

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import rapp_hop

NOBODY = "65534"
SYSTEM = ("/usr", "/etc/alternatives", "/etc/ld.so.cache", "/etc/localtime")
RUNNER = "rapp_hop.cloud_agent_runner"
INSIDE_PACKAGE = "/rapp/package"
INSIDE_PRIVATE = "/rapp/private"
INSIDE_PLATFORM = "/rapp/platform"  # holds the socket of a_rep
INSIDE_PYTHON = "/rapp/python"
PLATFORM_SOCKET = "a_rep.socket"


@dataclass(frozen=True)
class Limits:
    """What one cloud agent may use."""

    memory: int = 1 << 30  # bytes: address space of one process, and what all of them hold together
    cpu: int = 600  # s of processor time of all its processes
    processes: int = 64  # processes and threads
    files: int = 256  # open files
    file_size: int = 64 << 20  # bytes of one file, of its log too
    private: int = 64 << 20  # bytes of all files in its private folder, in memory
    life: float = 3600.0  # s
    start: float = 10.0  # s to serve
    silence: float = 5.0  # s without a sign of life of its loop
    terminate: float = 1.0  # s from SIGTERM to SIGKILL


@dataclass(frozen=True)
class Folders:
    """Folders of one agent, outside the sandbox; `account` is the user id inside, None for our own."""

    root: Path
    account: int | None

    @property
    def package(self) -> Path:
        """Its package; read-only inside."""
        return self.root / "package"

    @property
    def platform(self) -> Path:
        """Holds the socket of a_rep; read-only inside."""
        return self.root / "platform"

    @property
    def log(self) -> Path:
        """What its processes print; not seen inside."""
        return self.root / "agent.log"

    def make(self) -> None:
        """Create the folders: the root only for us, those bound into the sandbox for whoever runs there."""
        self.root.mkdir(mode=0o700)
        for folder in (self.package, self.platform):
            folder.mkdir()
            folder.chmod(0o755)


def command(folders: Folders, limits: Limits, environment: dict[str, str]) -> list[str]:
    """The words that start the runner inside the sandbox."""
    hop = Path(rapp_hop.__file__).resolve().parent
    read_only = [(path, path) for path in (*SYSTEM, *_python())]
    read_only += [(str(folders.package), INSIDE_PACKAGE), (str(folders.platform), INSIDE_PLATFORM)]
    read_only += [(str(hop), f"{INSIDE_PYTHON}/{hop.name}")]
    words = ["bwrap", "--die-with-parent", "--new-session", "--unshare-net"]
    words += ["--unshare-ipc", "--unshare-pid", "--unshare-uts", "--unshare-cgroup-try"]
    words += ["--clearenv", "--tmpfs", "/proc", "--dev", "/dev", "--tmpfs", "/tmp"]
    for folder in _parents([inside for _, inside in read_only]):
        words += ["--perms", "0755", "--dir", folder]  # bubblewrap's own would be closed to other users
    for outside, inside in read_only:
        words += ["--ro-bind-try" if inside in SYSTEM else "--ro-bind", outside, inside]
    for name in ("bin", "lib", "lib64", "sbin"):
        words += ["--symlink", f"usr/{name}", f"/{name}"]
    words += ["--perms", "1777", "--size", str(limits.private), "--tmpfs", INSIDE_PRIVATE, "--chdir", INSIDE_PRIVATE]
    for name, value in environment.items():
        words += ["--setenv", name, value]
    for folder in ("/tmp", "/proc", "/dev", "/"):
        words += ["--remount-ro", folder]
    return [*words, *_unprivileged(folders.account), *_limited(limits), sys.executable, "-m", RUNNER]


def _parents(paths: Iterable[str]) -> list[str]:
    """All folders above the paths, outermost first, but for the root."""
    folders = {str(folder) for path in paths for folder in Path(path).parents}
    return sorted(folders - {"/", "/tmp"})


def _python() -> list[str]:
    """The virtual environment, when there is one; Debian's Python is in /usr."""
    return [] if sys.prefix.startswith("/usr") else [sys.prefix]


def _unprivileged(account: int | None) -> list[str]:
    """Root becomes the agent's account inside, or the limit on processes would not bind; others get a user namespace."""
    if account is None:
        return ["--unshare-user", "--uid", NOBODY, "--gid", NOBODY]
    drop = ["setpriv", "--reuid", str(account), "--regid", str(account), "--clear-groups"]
    drop += ["--inh-caps", "-all", "--no-new-privs"]
    return ["--cap-drop", "ALL", "--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID", *drop]


def _limited(limits: Limits) -> list[str]:
    return [
        "prlimit",
        f"--as={limits.memory}",
        f"--cpu={limits.cpu}",
        f"--nproc={limits.processes}",
        f"--nofile={limits.files}",
        f"--fsize={limits.file_size}",
        "--core=0",
    ]
