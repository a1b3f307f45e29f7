"""What a dynamic agent sees and may use, found out from inside the real sandbox (DESIGN section 3.6)."""

import os
from pathlib import Path


def test_it_reads_no_other_file_of_the_robot(workshop, tmp_path):
    secret = tmp_path / "home" / "secret"
    secret.write_text("of the robot")
    places = [secret, Path(__file__), tmp_path / "package1"]
    places += map(Path, ("/etc/shadow", "/etc/passwd", "/home", "/var"))
    body = f"""
import os
facts = []
for place in {[str(place) for place in places]!r}:
    if os.path.isfile(place) or (os.path.isdir(place) and os.listdir(place)):
        facts.append(place)
"""
    facts = workshop.facts(body.strip())
    assert facts == []


def test_it_writes_in_its_private_folder_only(workshop):
    facts = workshop.facts(
        """
import os
facts = {}
prefix = __import__("sys").prefix
for place in ("/", "/tmp", "/usr", "/etc", "/rapp", "/rapp/package", "/dev", "/dev/shm", "/proc", prefix, os.environ["HOME"]):
    try:
        with open(os.path.join(place, "written"), "w") as file:
            file.write("x")
        facts[place] = True
    except OSError:
        facts[place] = False
""".strip()
    )
    assert [place for place, writable in facts.items() if writable] == ["/rapp/private"]


def test_the_package_and_the_recordings_are_read_only_copies(workshop):
    run = workshop.start("import time\nwhile True: time.sleep(0.1)")
    assert (run.package / "agent.py").exists()
    (run.recordings / "recording.ogg").write_bytes(b"OggS")
    inside = Path(f"/proc/{run._process.first}/root")
    assert (inside / "rapp/package/agent.py").read_text() == (run.package / "agent.py").read_text()
    assert (inside / str(run.recordings)[1:] / "recording.ogg").read_bytes() == b"OggS"
    mounts = Path(f"/proc/{run._process.first}/mounts").read_text().splitlines()
    options = {line.split()[1]: line.split()[3].split(",") for line in mounts}
    assert "ro" in options["/rapp/package"]
    assert "ro" in options[str(run.recordings)]


def test_it_is_nobody_and_can_become_nobody_else(workshop):
    facts = workshop.facts(
        """
import ctypes, os
libc = ctypes.CDLL(None)
capabilities = (ctypes.c_uint32 * 6)()  # effective, permitted, inheritable, twice: capget(2)
assert libc.capget((ctypes.c_uint32 * 2)(0x20080522, 0), capabilities) == 0
facts = {"uid": os.getuid(), "groups": os.getgroups(), "caps": list(capabilities), "new": libc.prctl(39, 0, 0, 0, 0)}
try:
    os.setuid(0)
    facts["root"] = True
except OSError:
    facts["root"] = False
""".strip()
    )
    assert facts["uid"] != 0
    assert facts["groups"] in ([], [65534])
    assert (facts["caps"], facts["new"], facts["root"]) == ([0] * 6, 1, False)


def test_it_sees_no_processes_and_signals_none_of_ours(workshop):
    body = """
import os
facts = [len(os.listdir("/proc"))]
for number in range(2, 4096):
    try:
        os.kill(number, 0)
        facts.append(number)
    except ProcessLookupError:
        pass
"""
    seen, *reached = workshop.facts(body.strip())
    assert seen == 0
    assert len(reached) < 20  # its own threads, in a namespace of its own
    assert max(reached) < 40


def test_it_inherits_its_channel_and_no_environment(workshop, monkeypatch):
    monkeypatch.setenv("RAPP_SMTP_PASSWORD", "of the robot")
    facts = workshop.facts(
        """
import os, stat
private, kinds = os.stat("/rapp/private").st_dev, {}
for number in range(512):
    try:
        found = os.fstat(number)
    except OSError:
        continue
    if found.st_dev != private:  # what it has opened itself: rospy's log
        kinds[number] = stat.S_IFMT(found.st_mode)
files = [number for number, kind in kinds.items() if kind in (stat.S_IFREG, stat.S_IFDIR, stat.S_IFCHR, stat.S_IFBLK)]
channel = int(os.environ["RAPP_CHANNEL_FD"])
facts = {"files": files, "env": sorted(os.environ), "channel": stat.S_ISSOCK(kinds[channel])}
""".strip()
    )
    assert (facts["files"], facts["channel"]) == ([0, 1, 2], True)
    assert set(facts["env"]) <= {
        "HOME", "LANG", "MALLOC_ARENA_MAX", "PATH", "PWD", "PYTHONDONTWRITEBYTECODE", "RAPP_CHANNEL_FD",
        "ROS_HOME", "ROS_IP", "ROS_LOG_DIR",
        "ROS_MASTER_URI", "TMPDIR", "LC_CTYPE", "ROS_LOG_FILENAME",
    }  # fmt: skip


def test_memory_has_a_limit(workshop):
    body = """
facts = []
for size in (100 << 20, 2 << 30):
    try:
        block = bytearray(size)
        facts.append(True)
    except MemoryError:
        facts.append(False)
"""
    assert workshop.facts(body.strip()) == [True, False]


def test_processes_have_a_limit_that_others_do_not_feel(workshop):
    body = """
import os, time
facts = 0
try:
    while facts < 200:
        if os.fork() == 0:
            time.sleep(60)
            os._exit(0)
        facts += 1
except OSError:
    pass
"""
    first = workshop.facts(body.strip())
    assert 0 < first < 40
    assert abs(workshop.facts(body.strip()) - first) <= 2


def test_files_have_limits_of_size_and_number(workshop):
    body = """
import os, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
facts = {"open": 0, "size": 0}
with open("large", "wb", buffering=0) as file:
    try:
        for _ in range(100):
            facts["size"] += file.write(bytes(100_000))
    except OSError:
        pass
files = []
try:
    while facts["open"] < 500:
        files.append(open("large"))
        facts["open"] += 1
except OSError:
    pass
files.clear()
"""
    facts = workshop.facts(body.strip())
    assert facts["size"] == 1 << 20
    assert 0 < facts["open"] < 64


def test_its_private_folder_cannot_be_filled_beyond_its_size(workshop):
    body = """
facts = 0
try:
    for number in range(50):
        with open(f"file{number}", "wb", buffering=0) as file:
            facts += file.write(bytes(1 << 19))
except OSError:
    pass
"""
    assert 1 << 19 < workshop.facts(body.strip()) <= workshop.config.limits.private


def test_the_account_is_the_run_s_own_when_root_starts_it(workshop, wait_for):
    runs = [workshop.start("import time\nopen('mine', 'w').close()\nwhile True: time.sleep(0.1)") for _ in range(2)]
    accounts = [run.folders.account for run in runs]
    if os.geteuid() == 0:
        assert all(account is not None and 65000 <= account < 65500 for account in accounts)
        mine = [Path(f"/proc/{run._process.first}/root/rapp/private/mine") for run in runs]
        wait_for(lambda: all(path.exists() for path in mine))
        assert [path.stat().st_uid for path in mine] == accounts
    else:
        assert accounts == [None, None]
