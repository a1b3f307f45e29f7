"""The gate between real sandboxes and a real ROS: what passes, what does not, and what is left of it (DESIGN section 3.6)."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fakes.processes import ended
from rapp_core.gate.bounds import HEADER, REQUEST
from rapp_core.launcher.run import Run
from rapp_ros.master import ask

FOREVER = "import time\nwhile True: time.sleep(0.05)"
MOVER = ("rapp_say", "rapp_move_to")
PATIENCE = 20.0  # s
TRY = """
import errno, os, socket, xmlrpc.client
def attempt(function, *args):
    try:
        return ["did", function(*args)]
    except Exception as error:
        return [type(error).__name__, str(error)]
master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
"""

OTHER = """
import rospy
from rapp_msgs.srv import Say
rospy.wait_for_service("rapp_say", 9)
print(rospy.ServiceProxy("rapp_say", Say)("x", "en").success)
"""


def graph(roscore: str) -> str:
    return str(ask(roscore, PATIENCE, "getSystemState", "/test")[2])


# what passes


def test_services_and_actions_pass_under_the_run_s_name_and_secret_which_the_rapp_does_not_hold(workshop, core):
    body = """
from rapp_msgs.msg import MoveToGoal
from rapp_api import navigation
from rapp_api.core_agent import current
import gc
communication.rapp_say("hello")
client = navigation.action_client("rapp_move_to")
assert client.wait_for_server()
client.send_goal(MoveToGoal(x=1.0))
assert client.wait_for_result()
facts = [client.get_result().success, current()._header]
"""
    run = workshop.start("import json\n" + body.strip() + "\nprint('FACTS', json.dumps(facts), flush=True)", MOVER)
    text, outcome = workshop.finish(run)
    assert outcome == "done", text
    assert "FACTS [true, {}]" in text
    node, say, goal = f"/dynamic_agent_{run.name}", core.notes("rapp_say")[-1], core.notes("goal")[-1]
    assert {say["caller"], goal["caller"]} == {node}
    assert say["secret"] == goal["secret"] == run.token
    assert run.token not in text


def test_what_it_says_of_itself_is_not_believed(workshop, core):
    """Neither its name nor a secret of another, over rospy or by hand."""
    body = (
        TRY
        + """
import rospy
from rapp_msgs.srv import Say
from rosgraph.network import read_ros_handshake_header, write_ros_handshake_header
from io import BytesIO
rospy.ServiceProxy("rapp_say", Say, persistent=True, headers={"callerid": "/core_agent", "rapp_channel": "guessed"})("x", "en")
_, _, uri = master.lookupService("/core_agent", "/rapp_say")
with socket.create_connection(("127.0.0.1", int(uri.rpartition(":")[2]))) as end:
    write_ros_handshake_header(end, {"service": "/rapp_say", "md5sum": "*", "callerid": "/core_agent", "rapp_channel": "guessed"})
    facts = "error" in read_ros_handshake_header(end, BytesIO(), 4096)
"""
    )
    before = len(core.notes("rapp_say"))
    assert workshop.facts(body.strip()) is False
    (note,) = core.notes("rapp_say")[before:]
    assert note["caller"].startswith("/dynamic_agent_")
    assert note["secret"] != "guessed"


def test_large_messages_pass_whole(workshop, core):
    body = "from rapp_api.core_agent import current\ncurrent().keep('x', bytes(8_000_000))\nfacts = 1"
    assert workshop.facts(body, ["rapp_keep"]) == 1
    assert core.notes("rapp_keep")[-1]["size"] == 8_000_000


# what does not


def test_a_service_that_package_json_does_not_name_is_refused_clearly(workshop, core):
    body = """
from rapp_api import Refused
try:
    communication.rapp_record(1.0)
except Refused as error:
    facts = str(error)
"""
    text = workshop.facts(body.strip())
    assert text == "cannot call /rapp_record: the RApp's package.json does not name it under permissions.core"


def test_the_host_s_network_is_not_there(workshop, roscore):
    """The real master, NAOqi's and rosbridge's ports, another of the host, its abstract sockets, the Internet."""
    port = roscore.rpartition(":")[2]
    with socket.create_server(("", 0)) as listener, socket.socket(socket.AF_UNIX) as abstract:
        abstract.bind(f"\0rapp-test-{os.getpid()}")
        abstract.listen()
        own = socket.gethostbyname(socket.gethostname())
        ports = [int(port), 9559, 9090, listener.getsockname()[1]]
        places = [(host, each) for host in ("127.0.0.1", own) for each in ports] + [("192.0.2.1", 80), ("1.1.1.1", 53)]
        body = (
            TRY
            + f"""
facts = [attempt(socket.create_connection, tuple(place), 2)[0] for place in {places!r}]
facts.append(attempt(socket.create_connection, ("::1", {ports[-1]}), 2)[0])
facts.append(attempt(socket.socket(socket.AF_UNIX).connect, "\\0rapp-test-{os.getpid()}")[0])
facts.append(attempt(lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b"x", ("1.1.1.1", 53)))[0])
facts.append(attempt(socket.getaddrinfo, "example.org", 80)[0])
facts.append([name for _, name in socket.if_nameindex()])
"""
        )
        *attempts, devices = workshop.facts(body.strip())
        listener.setblocking(False)
        with pytest.raises(BlockingIOError):
            listener.accept()
    assert set(attempts) <= {"ConnectionRefusedError", "OSError", "gaierror"}, attempts
    assert devices == ["lo"]


def test_names_of_the_robot_cannot_be_taken_seen_or_withdrawn(workshop, core, roscore):
    before = graph(roscore)
    assert "/core_agent/state" in before
    body = (
        TRY
        + """
api, me = "http://127.0.0.1:4000/", "/core_agent"
facts = [attempt(getattr(master, method), *words) for method, *words in [
    ("registerService", me, "/rapp_say", "rosrpc://127.0.0.1:4", api),
    ("registerService", me, "/rapp_x", "rosrpc://127.0.0.1:4", api),
    ("registerPublisher", me, "/core_agent/state", "*", api), ("registerPublisher", me, "/rapp_move_to/result", "*", api),
    ("registerSubscriber", me, "/core_agent/state", "*", api), ("lookupNode", me, me), ("shutdown", me, "now"),
    ("setParam", me, "/use_sim_time", True), ("deleteParam", me, "/run_id"), ("getParam", me, "/"),
    ("requestTopic", me, "/core_agent/state", [["TCPROS"]]),
    ("unregisterService", me, "/rapp_say", "rosrpc://127.0.0.1:4001"), ("unregisterPublisher", me, "/core_agent/state", api),
    ("unregisterSubscriber", me, "/rapp_move_to/goal", api), ("getSystemState", me),
]]
"""
    )
    facts = workshop.facts(body.strip(), MOVER)
    assert [kind for kind, _ in facts] == ["did"] * len(facts)
    answers = [answer for _, answer in facts]
    assert all(answer[0] == -1 for answer in answers[:11]), answers
    assert answers[14][2] == [[], [], []]
    assert ask(roscore, PATIENCE, "getParam", "/test", "/use_sim_time")[0] != 1
    assert graph(roscore) == before


def test_a_topic_or_service_of_the_robot_s_own_is_not_relayed(workshop, core):
    body = (
        TRY
        + """
from rosgraph.network import read_ros_handshake_header, write_ros_handshake_header
from io import BytesIO
_, _, uri = master.lookupService("/me", "/rapp_say")
facts = []
secret = {"service": "/rapp_hop/secret"}
for names in [secret, {**secret, "topic": ""}, {"topic": "/core_agent/state"}, {"topic": "/rapp_move_to/goal"}, {"other": "x"}]:
    with socket.create_connection(("127.0.0.1", int(uri.rpartition(":")[2])), 5) as end:
        write_ros_handshake_header(end, {**names, "md5sum": "*", "callerid": "/core_agent", "type": "*"})
        facts.append([read_ros_handshake_header(end, BytesIO(), 4096).get("error", ""), end.recv(100).decode()])
"""
    )
    facts = workshop.facts(body.strip(), MOVER)
    assert all(error.startswith("refused: cannot") and rest == "" for error, rest in facts), facts
    assert core.notes("rapp_hop/secret") == []


def test_one_run_does_not_reach_another(workshop):
    workshop.start("listener = __import__('socket').create_server(('127.0.0.1', 4321))\n" + FOREVER)
    facts = workshop.facts(TRY + "facts = attempt(socket.create_connection, ('127.0.0.1', 4321), 2)")
    assert facts[0] == "ConnectionRefusedError"


# bounds


def test_no_header_no_message_and_no_crowd_is_taken_beyond_its_bound(workshop, core):
    """And a call that keeps them is served meanwhile, and after."""
    body = (
        TRY
        + f"""
import http.client, signal, struct
from rosgraph.network import read_ros_handshake_header, write_ros_handshake_header
from io import BytesIO
_, _, uri = master.lookupService("/me", "/rapp_say")
relay = ("127.0.0.1", int(uri.rpartition(":")[2]))
def ended(end):
    end.settimeout(15)
    try:
        while end.recv(65536): pass
        return True
    except ConnectionError:
        return True
    except TimeoutError:
        return False
facts = []
too_long = [struct.pack("<I", size) + bytes(1000) for size in ({HEADER + 1}, 0xFFFFFFFF)]
for sent in (*too_long, b"GET / HTTP/1.1\\r\\n\\r\\n", struct.pack("<II", 4, 0)):
    with socket.create_connection(relay, 5) as end:
        end.sendall(sent)
        facts.append(ended(end))
with socket.create_connection(relay, 5) as end:
    write_ros_handshake_header(end, {{"service": "/rapp_say", "md5sum": "*", "callerid": "/x", "persistent": "1"}})
    read_ros_handshake_header(end, BytesIO(), 4096)
    end.sendall(struct.pack("<I", {REQUEST + 1}) + bytes(1000))
    facts.append(ended(end))
connection = http.client.HTTPConnection("127.0.0.1", 11311, timeout=10)
connection.request("POST", "/", bytes(200_000))
facts.append(connection.getresponse().status >= 400)
children = []
for _ in range(4):  # each process may open so many files
    came, come = os.pipe()
    children.append(os.fork())
    if children[-1] == 0:
        crowd = [socket.create_connection(relay, 5) for _ in range(25)]
        os.close(come)
        signal.pause()
    os.close(come)
    os.read(came, 1)
communication.rapp_say("in the crowd")
for child in children:
    os.kill(child, signal.SIGKILL)
communication.rapp_say("after the crowd")
"""
    )
    facts = workshop.facts(body.strip())
    assert facts == [True] * 6


def test_a_flood_of_calls_and_questions_is_slowed_and_the_core_agent_answers_others(workshop, core, ros_env):
    """20 threads call as fast as they can; another node is served all the same."""
    body = (
        """
import threading
from rapp_api.core_agent import current
import xmlrpc.client, os
def ask():
    while True: current().say("x", "en")
def question():
    master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
    while True: master.getSystemState("/me")
for each in [ask] * 10 + [question] * 10:
    threading.Thread(target=each, daemon=True).start()
"""
        + FOREVER
    )
    run = workshop.start(body.strip())
    before, begun = len(core.notes("rapp_say")), time.monotonic()
    done = subprocess.run([sys.executable, "-c", OTHER], env=ros_env, capture_output=True, text=True, timeout=30)
    assert done.stdout == "True\n"
    assert run.alive
    served = len(core.notes("rapp_say")) - before
    assert served < 500 * (time.monotonic() - begun) + 600


# its life


def ended_run(run: Run) -> list[int]:
    """End a run; gives the processes it had."""
    pids = [run._process.pid, run._process.first, run._gate.pid]
    run.end(2.0)
    return pids


@pytest.mark.parametrize("fault", [None, signal.SIGKILL, signal.SIGSTOP])
def test_nothing_is_left_of_a_run_whatever_happens_to_its_gate(workshop, core, roscore, wait_for, fault):
    before = graph(roscore)
    run = workshop.start("from rapp_api import navigation\nclient = navigation.action_client('rapp_move_to')\n" + FOREVER, MOVER)
    wait_for(lambda: f"dynamic_agent_{run.name}" in graph(roscore))
    if fault is not None:
        os.kill(run._gate.pid, fault)
    pids = ended_run(run)
    assert all(ended(pid) for pid in pids)
    assert graph(roscore) == before
    assert not run.folders.root.exists()


def test_a_gate_that_dies_is_the_run_s_death_and_one_that_stands_still_its_silence(workshop, wait_for):
    dead, still = workshop.start(FOREVER), workshop.start(FOREVER)
    os.kill(dead._gate.pid, signal.SIGKILL)
    os.kill(still._gate.pid, signal.SIGSTOP)
    wait_for(lambda: not dead.alive)
    wait_for(lambda: time.monotonic() - still.heartbeat > 1.0)
    assert still.alive


@pytest.mark.parametrize("fault", [signal.SIGKILL, signal.SIGSTOP])
def test_a_spare_whose_gate_has_failed_is_replaced(workshop, wait_for, fault):
    workshop.launcher.prepare()
    spare = workshop.launcher._spare
    assert spare.wait_ready(PATIENCE)
    os.kill(spare._gate.pid, fault)
    wait_for(lambda: not spare.usable)
    assert workshop.finish(workshop.start("pass"))[1] == "done"
    assert ended(spare._gate.pid)


def test_a_gate_has_no_rights_and_no_more_than_it_needs(workshop):
    run = workshop.start(FOREVER)
    status = dict(line.split(":", 1) for line in Path(f"/proc/{run._gate.pid}/status").read_text().splitlines())
    environment = Path(f"/proc/{run._gate.pid}/environ").read_bytes()
    limits = Path(f"/proc/{run._gate.pid}/limits").read_text()
    if os.geteuid() == 0:
        assert status["Uid"].split() == ["65533"] * 4
        assert int(status["CapEff"], 16) == 0
    assert {entry.partition(b"=")[0] for entry in environment.split(b"\0") if entry} <= {b"PATH", b"LANG", b"MALLOC_ARENA_MAX"}
    assert run.token.encode() not in Path(f"/proc/{run._gate.pid}/cmdline").read_bytes()
    assert any(line.startswith("Max address space") and str(1 << 30) in line for line in limits.splitlines())
