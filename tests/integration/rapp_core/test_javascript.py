"""RApps in JavaScript in real sandboxes, behind real gates: what they can and cannot do, how they end (DESIGN section 3.6)."""

import json
import os
import shutil
import signal
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from fakes.processes import ended
from fakes.rapps import install_rapp
from fakes.roslibjs import install_roslib
from rapp_ros.master import ask

MOVER = ("rapp_say", "rapp_move_to")
FOREVER = "await new Promise(() => {});"
ATTEMPT = """
const attempt = async (work) => {
  try { return ["did", await work()]; } catch (error) { return [error.name, error.message]; }
};
const { WebSocket } = require("ws");
const wire = new WebSocket("ws://127.0.0.1:9090");
const came = [];
const answers = new Map();
wire.on("message", (data) => {
  const message = JSON.parse(data);
  if (message.op === "service_response") answers.get(message.id)(message); else came.push(message);
});
await new Promise((resolve) => wire.once("open", resolve));
const send = (message) => wire.send(JSON.stringify(message));
const ask = (service, args = {}, id = service) => new Promise((resolve) => {
  answers.set(id, resolve);
  send({ op: "call_service", id, service, args });
});
let facts;
"""
MODULE = """
import { DynamicAgent } from "rapp_api";
export default class extends DynamicAgent { execute() { console.log("module"); } }
"""


@pytest.fixture(scope="module")
def roslibjs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install_roslib(tmp_path_factory.mktemp("npm") / "roslibjs")


def told(workshop: Any, body: str, core: tuple[str, ...] = ("rapp_say",)) -> tuple[Any, Any, str]:
    """The `facts` that `body` has found out from inside a sandbox, its run, and all it has printed."""
    body = f"{ATTEMPT}{body}\nconsole.log('FACTS ' + JSON.stringify(facts));"
    run = workshop.start(body, core, "javascript")
    text, outcome = workshop.finish(run)
    assert outcome == "done", text
    return json.loads(next(line for line in text.splitlines() if line.startswith("FACTS "))[6:]), run, text


def graph(roscore: str) -> str:
    return str(ask(roscore, 20.0, "getSystemState", "/test")[2])


def test_a_run_from_first_word_to_gone(workshop, core):
    """Its calls come under the run's name and with the lease's secret, of which it knows nothing."""
    body = """
await communication.textToSpeech("hello", "pl");
facts = [await keepsakes.keep("kept.txt", "text"), process.env];
"""
    _, run, text = told(workshop, body, ("rapp_say", "rapp_keep"))
    kinds = [message["type"] for message in workshop.heard if message["type"] != "state"]
    assert kinds == ["activate", "first_word", "terminate", "gone"]
    states = [m["state"] for m in workshop.heard if m["type"] == "state" and m["kind"] == "entered"]
    assert states == ["s1", "s2", "s3", "execute", "s4", "s5"]
    for note in (core.notes("rapp_say")[-1], core.notes("rapp_keep")[-1]):
        assert note["caller"] == f"/dynamic_agent_{run.name}"
        assert note["secret"] == run.token
    assert core.notes("rapp_keep")[-1]["size"] == len("text")
    assert run.token not in text


def test_what_package_json_does_not_name_is_refused(workshop, core):
    """By rapp_api, and by the protocol: a core service, one of the robot's own, rosapi, and what only looks like it."""
    body = """
const names = ["rapp_rest", "/rapp_hop/secret", "/rosapi/topics", "rosapi/nodes", "/core_agent/get_loggers"];
let where;
try { await navigation.rest(); } catch (error) { where = error.stack; }
facts = {
  said: await attempt(() => navigation.rest()),
  where,
  off: [await attempt(() => communication.textToSpeech()), await attempt(() => communication.textToSpeech(["a"]))],
  asked: await Promise.all(names.map((name) => ask(name))),
};
"""
    facts, _, _ = told(workshop, body)
    refusal = "cannot call /rapp_rest: the RApp's package.json does not name it under permissions.core"
    assert facts["said"] == ["Refused", refusal]
    assert "/agent.js:" in facts["where"]
    assert [name for name, _ in facts["off"]] == ["Invalid", "Invalid"]
    assert [answer["result"] for answer in facts["asked"]] == [False] * len(facts["asked"])
    assert core.notes("rapp_hop/secret") == core.notes("rapp_rest") == []


def test_topics_and_ports_of_the_robot_are_out_of_reach(workshop, core, roscore):
    """Nothing of another's is heard, published, offered, set or withdrawn; its own loopback has nothing of the robot's."""
    before = graph(roscore)
    port = urlsplit(roscore).port
    body = f"""
const net = require("node:net");
const reach = (port, host = "127.0.0.1") => new Promise((resolve) => {{
  const socket = net.connect({{ port, host }}, () => resolve("reached"));
  socket.on("error", (error) => resolve(error.code));
}});
send({{ op: "subscribe", topic: "/core_agent/state", type: "std_msgs/String" }});
send({{ op: "subscribe", topic: "/rapp_move_to/goal", type: "rapp_msgs/MoveToActionGoal" }});
send({{ op: "publish", topic: "/core_agent/state", msg: {{ data: "mine" }} }});
send({{ op: "advertise", topic: "/rapp_hop/cancel", type: "std_msgs/String" }});
send({{ op: "publish", topic: "/rapp_hop/cancel", msg: {{ data: "1" }} }});
send({{ op: "advertise_service", service: "/rapp_say", type: "rapp_msgs/Say" }});
send({{ op: "unadvertise_service", service: "/rapp_say" }});
await ask("rapp_say", {{ text: "after it all", language: "" }});
facts = {{
  heard: came.filter((message) => message.op === "publish"),
  ports: [await reach({port}), await reach(9559), await reach(22), await reach(80, "192.0.2.1")],
}};
"""
    facts, run, _ = told(workshop, body)
    assert facts["heard"] == []
    assert facts["ports"] == ["ECONNREFUSED"] * 3 + ["ENETUNREACH"]
    assert core.notes("rapp_say")[-1]["caller"] == f"/dynamic_agent_{run.name}"
    assert graph(roscore) == before


def test_plain_roslib_calls_services_and_sends_goals(workshop, core, roslibjs):
    body = """
const ROSLIB = await import("roslib");
const ros = new ROSLIB.Ros({ url: "ws://127.0.0.1:9090" });
await new Promise((resolve) => ros.on("connection", resolve));
const say = new ROSLIB.Service({ ros, name: "/rapp_say", serviceType: "rapp_msgs/Say" });
const said = await new Promise((resolve, reject) => say.callService({ text: "by roslib", language: "en" }, resolve, reject));
const client = new ROSLIB.ActionClient({ ros, serverName: "/rapp_move_to", actionName: "rapp_msgs/MoveToAction" });
let feedback = 0;
let done;
while (feedback === 0) { // the first goal's may come before its topic is connected
  const goal = new ROSLIB.Goal({ actionClient: client, goalMessage: { x: 1, y: 0, theta: 0 } });
  goal.on("feedback", () => { feedback += 1; });
  const result = new Promise((resolve) => goal.on("result", resolve));
  goal.send();
  done = await result;
  await this.pause(0.1);
}
console.log("FACTS " + JSON.stringify([said.success, done.success]));
"""
    package = workshop.write(body, MOVER, "javascript")
    shutil.copytree(roslibjs / "node_modules", package / "node_modules")
    run = workshop.activate(package)
    text, outcome = workshop.finish(run)
    assert outcome == "done", text
    assert "FACTS [true,true]" in text
    goal = core.notes("goal")[-1]
    assert (goal["caller"], goal["secret"]) == (f"/dynamic_agent_{run.name}", run.token)


@pytest.mark.parametrize(
    ("program", "detail"),
    [
        ("Promise.reject(new RangeError('left alone')); await this.pause(60);", "RangeError: left alone"),
        ("await Promise.reject();", "Error: undefined was thrown"),
        ("throw new Error('\\ud83d');", "Error: ?"),
        ("}} this is no program {{", "SyntaxError"),
    ],
)
def test_a_program_that_fails_says_how(workshop, wait_for, program, detail):
    run = workshop.start(program, runtime="javascript")
    wait_for(lambda: run.outcome is not None)
    assert run.outcome[0] == "failed"
    assert run.outcome[1].startswith(detail)
    assert workshop.finish(run)[1] == "failed"


def test_what_fails_where_nobody_waits_leads_to_s4_too(workshop):
    """Fig. 3: every failure leads there, and the task's own end comes too late to count."""
    run = workshop.start(
        "this.terminate = () => console.log('tidied');\nsetTimeout(() => { throw null; }, 50);\nawait this.pause(0.3);",
        runtime="javascript",
    )
    text, outcome = workshop.finish(run)
    assert (outcome, "tidied" in text) == ("failed", True), text


def test_a_file_too_large_for_a_call_harms_no_other_call(workshop, core):
    body = """
facts = [
  await attempt(() => keepsakes.keep("large", Buffer.alloc(30_000_000))),
  await attempt(() => keepsakes.keep("small", "text")),
];
"""
    facts, _, _ = told(workshop, body, ("rapp_keep",))
    assert facts[0] == ["Refused", "cannot call rapp_keep: more than 16 MiB at once; send smaller files"]
    assert facts[1][0] == "did"


def test_an_es_module_is_a_rapp_too(workshop):
    package = workshop.write("", runtime="javascript")
    (package / "agent.mjs").write_text(MODULE)
    manifest = (package / "package.json").read_text()
    (package / "package.json").write_text(manifest.replace("agent.js", "agent.mjs"))
    text, outcome = workshop.finish(workshop.activate(package))
    assert (outcome, "module" in text) == ("done", True), text


def test_a_robot_that_has_such_rapps_keeps_node_warm_and_other_rapps_do_not_meet_it(workshop, wait_for):
    def warm() -> Any:
        workshop.launcher.prepare()
        spare = workshop.launcher._spare
        assert spare.wait_ready(20)
        return spare, [pid for pid in inside_of(spare) if {b"rapp_bridge", b"runner.js"} & words_of(pid)]

    install_rapp(workshop.config.home, "before", "", runtime="javascript")
    spare, engine = warm()
    assert len(engine) == 2
    assert workshop.start("console.log('warm');", runtime="javascript") is spare
    assert not any(ended(pid) for pid in engine)
    assert workshop.finish(spare)[1] == "done"
    spare, engine = warm()
    os.kill(engine[0], signal.SIGKILL)
    wait_for(lambda: ended(engine[0]))
    text, outcome = workshop.finish(workshop.start("console.log('started anew');", runtime="javascript"))
    assert outcome == "done", text
    spare, engine = warm()
    assert workshop.start("self.pause(60)") is spare
    assert all(ended(pid) for pid in engine)


def words_of(pid: int) -> set[bytes]:
    """The words that started a process, without their folders."""
    try:
        return {word.rpartition(b"/")[2] for word in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")}
    except OSError:
        return set()  # it has ended meanwhile


# ends that are none


def inside_of(run: Any) -> list[int]:
    """All processes of a run's sandbox."""

    def namespace(pid: int) -> Path | None:
        try:
            return Path(f"/proc/{pid}/ns/pid").readlink()
        except OSError:
            return None

    own = namespace(run._process.first)
    return [pid for pid in (int(each.name) for each in Path("/proc").glob("[0-9]*")) if namespace(pid) == own]


def test_an_event_loop_that_stands_still_beats_on_but_does_not_count_and_is_ended(workshop, wait_for):
    body = "process.on('SIGTERM', () => {}); console.log('asleep'); await this.pause(0.5); while (true) {}"
    run = workshop.start(body, runtime="javascript")
    wait_for(lambda: "asleep" in run.folders.log.read_text())
    inside = inside_of(run)
    assert len(inside) >= 4  # bubblewrap's first process, the runner, rosbridge, node
    wait_for(lambda: run.heartbeat - run.progress > 1.5)
    run.end(0.2)
    wait_for(lambda: all(ended(pid) for pid in inside))


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_rapp_whose_rosbridge_dies_or_stands_still_is_told_so(workshop, core, number):
    """Its next calls are unreachable, as everything is."""
    body = """
let failed = null;
while (failed === null) {
  try { await communication.textToSpeech("x"); await this.pause(0.05); } catch (error) { failed = error; }
}
console.log("FACTS", failed.name, failed.message);
"""
    run = workshop.start(body, runtime="javascript")
    victim = next(pid for pid in inside_of(run) if b"rapp_bridge" in words_of(pid))
    os.kill(victim, number)
    text, outcome = workshop.finish(run)
    assert outcome == "done", text
    assert "FACTS Unreachable cannot" in text
