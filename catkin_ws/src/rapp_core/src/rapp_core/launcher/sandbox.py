"""The bubblewrap sandbox of a dynamic agent (DESIGN section 3.6): what it sees, and what it may use.

It sees a read-only system, the Python environment, its own package, the recordings of its own run, and one private folder. It
inherits one descriptor, its channel, and no environment. The network is the host's until the gate of DESIGN section 3.6.
"""

import importlib.util
import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from rapp_core.config import Limits
from rapp_core.errors import Bug

NOBODY = "65534"
SYSTEM = ("/usr", "/etc/alternatives", "/etc/hosts", "/etc/ld.so.cache", "/etc/nsswitch.conf", "/etc/localtime")
RUNNER = "rapp_api.runner"
PACKAGES = ("rapp_api", "rapp_agent", "rapp_msgs")


@dataclass(frozen=True)
class RunFolders:
    """Folders of one run, outside the sandbox."""

    root: Path

    @property
    def package(self) -> Path:
        """The RApp's package; read-only inside, as /rapp/package."""
        return self.root / "package"

    @property
    def private(self) -> Path:
        """The only writable folder; /rapp/private inside."""
        return self.root / "private"

    @property
    def recordings(self) -> Path:
        """What the core agent records for this run; read-only inside, at the same path as outside."""
        return self.root / "recordings"

    def make(self) -> None:
        """Create the folders; the private one belongs to whoever runs inside."""
        for folder in (self.package, self.private, self.recordings):
            folder.mkdir(parents=True)
        self.root.chmod(0o711)
        if os.geteuid() == 0:
            os.chown(self.private, int(NOBODY), int(NOBODY))


def command(folders: RunFolders, limits: Limits, environment: dict[str, str]) -> list[str]:
    """The words that start the runner inside the sandbox."""
    words = [
        "bwrap",
        "--die-with-parent",
        "--new-session",
        "--unshare-ipc",
        "--unshare-pid",
        "--unshare-uts",
        "--unshare-cgroup-try",
    ]
    words += ["--clearenv", "--proc", "/proc", "--dev", "/dev", "--tmpfs", "/tmp"]
    for path in (*SYSTEM, *_python()):
        words += ["--ro-bind-try", path, path]
    for name in ("bin", "lib", "lib64", "sbin"):
        words += ["--symlink", f"usr/{name}", f"/{name}"]
    words += ["--ro-bind", str(folders.package), "/rapp/package", "--bind", str(folders.private), "/rapp/private"]
    words += ["--ro-bind", str(folders.recordings), str(folders.recordings), "--chdir", "/rapp/private"]
    for name, value in environment.items():
        words += ["--setenv", name, value]
    return [*words, *_unprivileged(), *_limited(limits), sys.executable, "-m", RUNNER]


def _python() -> Iterable[str]:
    """The virtual environment and the folders that hold the packages a dynamic agent imports."""
    found = {sys.prefix}
    for name in PACKAGES:
        spec = importlib.util.find_spec(name)
        if spec is None or spec.origin is None:
            raise Bug(f"cannot make a sandbox: package {name} is not installed here; run ./rapp help to set up")
        place = Path(spec.origin).parent
        found |= {str(place.parent), str(place.resolve().parent)}
    return sorted(found)


def _unprivileged() -> list[str]:
    """Root becomes nobody inside, or the limit on processes would not bind; others are put into a user namespace."""
    if os.geteuid() != 0:
        return ["--unshare-user", "--uid", NOBODY, "--gid", NOBODY]
    drop = ["setpriv", "--reuid", NOBODY, "--regid", NOBODY, "--clear-groups", "--inh-caps", "-all", "--no-new-privs"]
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
