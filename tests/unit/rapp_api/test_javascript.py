"""rapp_api of JavaScript against the table of core services and Python's rapp_api; run by node, without ROS."""

import inspect
import json
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from fakes.roslibjs import NODE
from rapp_api import communication, errors, javascript, keepsakes, navigation, vision
from rapp_core.manifest import RUNTIMES as OF_THE_CORE
from rapp_core.services.table import CORE_SERVICES
from rapp_hop.hz.manifest import RUNTIMES

API = Path(javascript.__file__).with_name("js")
SRV = Path(__file__).parents[3] / "catkin_ws" / "src" / "rapp_msgs" / "srv"
PYTHON = {"communication": communication, "navigation": navigation, "vision": vision, "keepsakes": keepsakes}
PROGRAM = """
const rapp = require(process.argv[1]);
const attempt = async (work) => {
  try { return ["did", await work()]; } catch (error) { return [error.name, error.message, error instanceof rapp.RappError]; }
};
const asked = [];
let answer = {};
rapp.core.use(async (service, fields) => {
  asked.push([service, fields]);
  if (answer instanceof Error) throw answer;
  return { success: true, ...answer };
});
"""


def node(body: str) -> Any:
    """What `body` gives as `facts`."""
    text = f"{PROGRAM}\n(async () => {{ let facts;\n{body}\nconsole.log(JSON.stringify(facts)); }})();"
    done = subprocess.run([str(NODE), "-e", text, str(API)], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def snake_case(name: str) -> str:
    return re.sub("([A-Z])", lambda found: "_" + found[1].lower(), name)


@pytest.fixture(scope="module")
def table() -> dict[str, Any]:
    """Of each function its service, its parameters with their defaults, and the names of the fields it asks with."""
    found: dict[str, Any] = node("""
const { SERVICES } = require(process.argv[1] + "/services.js");
const SAMPLES = { path: [{ x: 1, y: 2 }], pose: { x: 1, y: 2 }, dictionary: ["a"], data: "x" };
facts = {};
for (const [module, rows] of Object.entries(SERVICES)) {
  for (const [name, row] of Object.entries(rows)) {
    const parameters = Object.entries(row.parameters);
    asked.length = 0;
    try { await rapp[module][name](...parameters.map(([each]) => SAMPLES[each] ?? 1)); } catch {}
    const given = Object.fromEntries(parameters.map(([each, standard]) => [each, standard === undefined ? "NEEDED" : standard]));
    facts[`${module}.${name}`] = { service: row.service, parameters: given, asked: asked[0] };
  }
}
""")
    return {snake_case(name): row for name, row in found.items()}


def test_every_core_service_has_a_function_of_its_name(table: dict[str, Any]) -> None:
    expected = {row.api: row.name for row in CORE_SERVICES} | {"keepsakes.keep": "rapp_keep"}
    assert {name: row["service"] for name, row in table.items()} == expected


def test_a_function_has_python_s_parameters_and_defaults(table: dict[str, Any]) -> None:
    for name, row in table.items():
        module, _, function = name.partition(".")
        parameters = inspect.signature(getattr(PYTHON[module], function)).parameters.values()
        expected = {each.name: "NEEDED" if each.default is each.empty else each.default for each in parameters}
        assert {snake_case(each): value for each, value in row["parameters"].items()} == expected, name


def test_a_function_fills_in_the_request_s_fields(table: dict[str, Any]) -> None:
    srv = {row.name: row.srv for row in CORE_SERVICES} | {"rapp_keep": "Keep"}
    for name, row in table.items():
        request = (SRV / f"{srv[row['service']]}.srv").read_text().split("---")[0]
        fields = re.findall(r"^[\w/]+(?:\[\d*\])? +(\w+) *(?:#.*)?$", request, re.MULTILINE)
        assert row["asked"][0] == row["service"]
        assert set(row["asked"][1]) == set(fields), name


def test_constants_are_python_s() -> None:
    facts = node("facts = [rapp.communication.EMPTY, rapp.navigation.ROBOT, rapp.vision.QUAD_VGA, rapp.vision.BOTTOM];")
    assert facts == [communication.EMPTY, navigation.ROBOT, vision.QUAD_VGA, vision.BOTTOM]


def test_answers_become_values() -> None:
    facts = node("""
answer = { pose: { header: { frame_id: "map" }, pose: { position: { x: 1, y: 2 }, orientation: { z: 1, w: 0 } } } };
const pose = await rapp.navigation.getRobotPose();
answer = { transform: [...Array(16).keys()] };
const matrix = await rapp.navigation.getTransform("CameraTop", rapp.navigation.WORLD);
answer = { frame: { width: 1, height: 1, data: "AQID" } };
const picture = await rapp.vision.captureImage();
await rapp.navigation.moveAlongPath([{ x: 1, y: 0, theta: Math.PI, frame: "odom" }]);
await rapp.navigation.moveJoint("HeadYaw", 0.5);
await rapp.keepsakes.keep("a.txt", "abc");
facts = { pose, matrix, picture: [...picture.data], asked: asked.slice(-3).map(([, fields]) => fields) };
""")
    assert facts["pose"] == {"x": 1, "y": 2, "theta": pytest.approx(3.14159, abs=1e-4), "frame": "map"}
    assert facts["matrix"][1] == [4, 5, 6, 7]
    assert facts["picture"] == [1, 2, 3]
    path, joint, kept = facts["asked"]
    assert path["poses"][0]["header"] == {"frame_id": "odom"}
    assert path["poses"][0]["pose"]["orientation"]["z"] == pytest.approx(1.0)
    assert joint == {"joints": ["HeadYaw"], "angles": [0.5], "speed": 0}
    assert kept == {"name": "a.txt", "data": "YWJj"}


def test_calls_to_the_cloud_carry_files_that_only_the_rapp_sees(tmp_path: Path) -> None:
    facts = node(f"""
answer = {{ result: '{{"name": "Maria"}}', state: "kept", stopped: true }};
const file = new rapp.cloud.File({json.dumps(str(tmp_path / "of_the_robot.ogg"))});
facts = [await rapp.cloud.call("profile", {{ file, other: 1 }}), await rapp.cloud.callAgent("mine", {{}}, 3),
  await rapp.cloud.sendMail(["a@b.c"], "s", "b"), await rapp.cloud.stopAgent(),
  await attempt(() => rapp.cloud.call("x", {{ file: new rapp.cloud.File("/rapp/private/nothing") }})),
  await attempt(() => rapp.cloud.call("x", {{ big: 1n }})), asked];
""")
    assert facts[:4] == [{"name": "Maria"}, {"name": "Maria"}, "kept", True]
    assert [each[0] for each in facts[4:6]] == ["Refused", "Invalid"]
    called, agent = facts[6][0][1], facts[6][1][1]
    assert json.loads(called["arguments"]) == {"file": {"file": str(tmp_path / "of_the_robot.ogg")}, "other": 1}
    assert (called["agent"], agent["agent"], agent["timeout"]) == (False, True, 3)
    assert facts[6][2][0] == "rapp_send_mail"


def test_error_words_become_errors() -> None:
    kinds = ["refused", "unreachable", "invalid", "bug", "", "strange"]
    facts = node(f"""
facts = [];
for (const error of {json.dumps(kinds)}) {{
  answer = {{ success: false, error, message: "cannot: because" }};
  facts.push(await attempt(() => rapp.navigation.moveStop()));
}}
""")
    expected = [errors.KINDS.get(kind, errors.Refused).__name__ for kind in kinds]
    assert facts == [[name, "cannot: because", True] for name in expected]


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("cannot call /rapp_rest: cannot connect: refused: cannot call /rapp_rest: not named; see that its node runs", "Refused"),
        ("cannot call /rapp_rest: no such service is registered; start its node", "Unreachable"),
        ("cannot wait longer for /rapp_rest: no answer in 3 s", "Unreachable"),
        ("cannot fill text: it is no text", "Invalid"),
    ],
)
def test_what_rosbridge_says_of_a_failed_call(text: str, kind: str) -> None:
    name, message = node(f"""
const {{ failure }} = require(process.argv[1] + "/core.js");
const error = failure("rapp_rest", {json.dumps(text)});
facts = [error.name, error.message];
""")
    assert name == kind
    assert message.startswith("cannot ") and "see that its node runs" not in message


def test_an_agent_walks_its_fsm_and_every_failure_leads_to_s4() -> None:
    facts = node("""
class Agent extends rapp.DynamicAgent {
  async execute() { await this.state("ask", () => 1, "ask something"); throw new rapp.Invalid("cannot: no"); }
  terminate() { this.tidy = true; }
}
const agent = new Agent({ a: 1 });
const told = [];
let end = null;
const ended = (error) => { end = error.message; };
await agent.run(() => told.push("first word"), ended, ({ machine, state, kind }) => told.push([machine, state, kind]));
facts = { told, end, tidy: agent.tidy, parameters: agent.parameters };
""")
    dynamic = [
        (state, kind) for machine, state, kind in (each for each in facts["told"] if each != "first word") if machine == "dynamic"
    ]
    around = [("s1", "entered"), ("s1", "left"), ("s2", "entered"), ("s2", "left")]
    assert dynamic == [
        *around,
        *[("s3", "entered"), ("s3", "failed"), ("s3", "left")],
        *[("s4", "entered"), ("s4", "left"), ("s5", "entered"), ("s5", "left")],
    ]
    assert facts["told"][1] == "first word"
    assert ["execute", "ask", "entered"] in facts["told"]
    assert (facts["end"], facts["tidy"], facts["parameters"]) == ("cannot: no", True, {"a": 1})


def test_outside_a_run_there_is_no_core_agent() -> None:
    done = subprocess.run(
        [str(NODE), "-e", "require(process.argv[1]).navigation.rest().catch((error) => console.log(error.name))", str(API)],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert done.stdout == "Bug\n"


def test_both_sides_know_the_same_runtimes() -> None:
    assert set(OF_THE_CORE) == set(RUNTIMES)
    assert javascript.RUNTIME in RUNTIMES
