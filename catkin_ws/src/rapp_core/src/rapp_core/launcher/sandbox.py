"""The bubblewrap sandbox of a dynamic agent (DESIGN section 3.6): what it sees, and what it may use.

It sees a read-only system, the Python environment, its own package, the recordings of its own run, and one private folder, which
is of bounded size, in memory, and ends with it. It inherits two descriptors, its channel and the way to its gate, and no
environment. Its network is its own, and has nothing but a loopback: see `rapp_core.gate`. /proc is empty, for in a container none
can be mounted.
"""

import importlib.util
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from rapp_core.config import Limits
from rapp_core.errors import Bug
from rapp_core.ports import INSIDE_PACKAGE

NOBODY = "65534"
SYSTEM = ("/usr", "/etc/alternatives", "/etc/hosts", "/etc/ld.so.cache", "/etc/nsswitch.conf", "/etc/localtime")
RUNNER = "rapp_api.runner"
PACKAGES = ("rapp_api", "rapp_agent", "rapp_msgs")
BRIDGE = "rapp_bridge"  # of RApps in other languages; not imported here
INSIDE_JAVASCRIPT = "/rapp/node_modules/rapp_api"  # where node finds it from the package's folder
INSIDE_PRIVATE = "/rapp/private"


@dataclass(frozen=True)
class RunFolders:
    """Folders of one run, outside the sandbox; `account` is the user id inside, None for our own."""

    root: Path
    account: int | None

    @property
    def package(self) -> Path:
        """The RApp's package; read-only inside, as /rapp/package."""
        return self.root / "package"

    @property
    def recordings(self) -> Path:
        """What the core agent records for this run; read-only inside, at the same path as outside."""
        return self.root / "recordings"

    @property
    def log(self) -> Path:
        """What the run's processes print; not seen inside."""
        return self.root / "agent.log"

    def make(self) -> None:
        """Create the folders."""
        for folder in (self.package, self.recordings):
            folder.mkdir(parents=True)


def command(folders: RunFolders, limits: Limits, environment: dict[str, str]) -> list[str]:
    """The words that start the runner inside the sandbox. Raises Bug when the Python packages cannot be found."""
    recordings = str(folders.recordings)
    read_only = [(path, path) for path in (*SYSTEM, *_python())]
    read_only += [(str(_source("rapp_api") / "js"), INSIDE_JAVASCRIPT)]
    read_only += [(str(folders.package), INSIDE_PACKAGE), (recordings, recordings)]
    words = ["bwrap", "--die-with-parent", "--new-session"]
    words += ["--unshare-ipc", "--unshare-net", "--unshare-pid", "--unshare-uts", "--unshare-cgroup-try"]
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
    """The virtual environment and the folders that hold the packages a dynamic agent imports."""
    found = {sys.prefix}
    for name in (*PACKAGES, *([BRIDGE] if is_here(BRIDGE) else [])):
        found |= {str(_folder(name).parent), str(_source(name).parent)}
    return sorted(path for path in found if not path.startswith("/usr/"))


def is_here(name: str) -> bool:
    """Whether a Python package is installed here."""
    return importlib.util.find_spec(name) is not None


def _folder(name: str) -> Path:
    """Where a Python package is. Raises Bug."""
    spec = importlib.util.find_spec(name)
    if spec is None or spec.origin is None:
        raise Bug(f"cannot make a sandbox: package {name} is not installed here; run ./rapp help to set up")
    return Path(spec.origin).parent


def _source(name: str) -> Path:
    """Where a Python package's files are: catkin links them from elsewhere. Raises Bug."""
    return (_folder(name) / "__init__.py").resolve().parent


def _unprivileged(account: int | None) -> list[str]:
    """All get a user namespace; root becomes the run's account in it, or the limit on processes would not bind."""
    if account is None:
        return ["--unshare-user", "--uid", NOBODY, "--gid", NOBODY]
    own = ["--unshare-user", "--uid", "0", "--gid", "0"]
    drop = ["setpriv", "--reuid", str(account), "--regid", str(account), "--clear-groups"]
    drop += ["--inh-caps", "-all", "--no-new-privs"]
    return [*own, "--cap-drop", "ALL", "--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID", *drop]


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
