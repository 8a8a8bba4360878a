"""The generated Python supervisor does what the interpreter does, step by step, whatever the model and the data."""

import ast
import itertools
import re
import subprocess
import sys
import textwrap
from collections import Counter
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.certification import make_supervisor
from robosc.errors import UnsupportedModelError
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.event_log import MemoryLog
from robosc.execution.runtime.protocol import batches
from robosc.expressions import Binary, BooleanType, Constant, DoubleType, Received
from robosc.model.structure import (
    Behaviour,
    Communication,
    CommunicationKind,
    Component,
    Deployment,
    Model,
    State,
    Transition,
    Update,
    Variable,
)
from robosc.supervisor import Supervisor, decode, encode
from robosc.targets import GenerateOptions, generate, write_files
from robosc.targets.code.python import changes
from support.effort import examples
from support.execution import supervisor_of, unsupervised
from support.generated import example_supervisor, imported, load_system, python_text, same
from support.layers import BothSides
from support.models import EXAMPLE_DEPLOYMENTS, EXAMPLE_NAMES, model_of
from support.random_models import random_bundle
from support.random_supervisors import random_data, random_supervisor

STEPS = 25
FULL_SCAN = {"ranges": [1.0] * 360}


class Twins:
    """A generated and an interpreted system that must never differ."""

    def __init__(self, supervisor: Supervisor) -> None:
        self.model = supervisor.model
        self.events, self.issued = supervisor.executable.events, supervisor.executable.issued
        self.generated = load_system(supervisor)
        self.interpreted = InterpretedSystem(supervisor)
        self.seen: Counter[str] = Counter()
        self.known: set[int] = set()
        assert tuple(self.generated.description) == tuple(self.interpreted.description)

    def compare(self) -> None:
        """Compare all that can be asked without changing anything."""
        assert same(self.generated.state(), self.interpreted.state())
        for event in self.issued:
            allowed = self.interpreted.enabled(event)
            assert self.generated.enabled(event) is allowed, event
            self.seen["enabled" if allowed else "disabled"] += 1
        assert self.generated.enabled_requests() == self.interpreted.enabled_requests()
        # The generated class must remember the answers that it would give if it asked for each event.
        self.known ^= set(self.generated.changed_requests())
        assert tuple(sorted(self.known)) == self.interpreted.enabled_requests()
        assert self.generated.enabled_silent() == self.interpreted.enabled_silent()
        for item in self.model.communications:
            if item.kind is not CommunicationKind.OUTGOING_MESSAGE:
                for question in ("provide", "requirements", "conjuncts"):
                    answers = [getattr(system, question)(item.name) for system in (self.generated, self.interpreted)]
                    assert same(*answers), (question, item.name, answers)
            if item.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION):
                assert self.generated.location(item.name) == self.interpreted.location(item.name)

    def match(self, data: Any) -> None:
        """Compare the incoming messages that a message could be."""
        for item in self.model.communications:
            if item.kind is CommunicationKind.INCOMING_MESSAGE:
                generated, interpreted = (s.matches(item.name, data) for s in (self.generated, self.interpreted))
                assert tuple(generated) == tuple(interpreted), (item.name, data)
                self.seen["match" if interpreted.holds else "no match"] += item.when is not None
                self.seen["unknown in a condition"] += bool(interpreted.unknown)

    def step(self, event: str, data: Any = None) -> tuple[str, ...] | None:
        """Take an event, with data if it is one of the environment."""
        readings: list[Any] = [None, None]
        if event not in self.issued:
            readings = [_read(system, event, data) for system in (self.generated, self.interpreted)]
            left, right = readings
            if None in (left, right):
                assert left is right, (event, data)
                self.seen["not read"] += 1
                return None
            assert same(left.data, right.data), (event, data)
            assert left.unknown == right.unknown, (event, data)
            assert left.enum_unknown is right.enum_unknown, (event, data)
            self.seen["unknown"] += bool(left.unknown)
            self.seen["unknown enum"] += left.enum_unknown
        before = self.generated.signature()
        changes = self.generated.changes, self.interpreted.changes
        results = [
            system.step(event, reading)
            for system, reading in zip((self.generated, self.interpreted), readings, strict=True)
        ]
        assert results[0] == results[1], (event, data)
        if results[0] is None:
            assert self.generated.signature() == before
        self.note_changes(changes, self.generated.signature() != before)
        self.seen["skipped"] += bool(results[0])
        self.seen["refused" if results[0] is None else "taken"] += 1
        return results[0]  # type: ignore[no-any-return]

    def note_changes(self, before: tuple[int, int], is_another: bool) -> None:
        """Both count changes where the state has become another, and only there."""
        assert (self.generated.changes != before[0]) is is_another
        assert (self.interpreted.changes != before[1]) is is_another
        self.seen["another state" if is_another else "the same state"] += 1

    def receive(self, identifier: str, data: Any) -> None:
        """Take a whole message at once; where that is refused, event by event."""
        changes = self.generated.changes, self.interpreted.changes
        before = self.generated.signature()
        results = [_received(system, identifier, data) for system in (self.generated, self.interpreted)]
        assert results[0] == results[1], (identifier, data)
        if results[0] is None:
            assert (self.generated.changes, self.interpreted.changes) == changes
            assert self.generated.signature() == before
            for _, event in batches(self.generated.description.communications)[identifier]:
                self.step(event, data)
        if results[0] == "not read":
            assert (self.generated.changes, self.interpreted.changes) == changes
            return
        self.seen["taken apart" if results[0] is None else "skipped at once" if results[0] else "taken at once"] += 1

    def run(self, dice: Random, steps: int) -> None:
        """A random walk that takes what is enabled more often than not."""
        identifiers = list(batches(self.generated.description.communications))
        names = tuple(self.events)
        responses = [item.events[0] for item in self.model.communications if item.request is None] * 3
        for _ in range(steps if names else 0):
            self.compare()
            event = dice.choice([*names, *responses])
            if event in self.issued and dice.random() < 0.8:
                enabled = [name for name in self.issued if self.interpreted.enabled(name)]
                event = dice.choice(enabled) if enabled else event
            self.step(event, random_data(dice))
            self.match(random_data(dice))
            if identifiers:
                # Between the questions, so that several changes are remembered at once.
                for _ in range(dice.randrange(3)):
                    self.receive(dice.choice(identifiers), random_data(dice))
        self.compare()
        self.generated.restart()
        self.interpreted.restart()
        self.known.clear()
        self.compare()


def _read(system: Any, event: str, data: Any) -> Any:
    """Convert data; None if it lacks what cannot be unknown."""
    try:
        return system.read(event, data)
    except ValueError as error:
        assert type(error).__name__ == "MissingData"
        return None


def _received(system: Any, identifier: str, data: Any) -> Any:
    """Take a whole message; `not read` if it lacks what cannot be unknown."""
    try:
        return system.receive(identifier, data)
    except ValueError as error:
        assert type(error).__name__ == "MissingData"
        return "not read"


@settings(max_examples=examples(60))
@given(st.integers(0, 2**32))
def test_a_random_supervisor_behaves_as_interpreted(seed: int) -> None:
    twins = Twins(random_supervisor(seed))
    twins.run(Random(seed), STEPS)


@settings(max_examples=examples(30))
@given(st.integers(0, 2**32 - 1))
def test_the_supervisor_of_a_random_text_behaves_as_interpreted(seed: int) -> None:
    made = make_supervisor(random_bundle(seed)).supervisor
    if made is not None:
        assert decode(encode(made)) == made
        Twins(made).run(Random(seed), 10)


@settings(max_examples=examples(30))
@given(st.integers(0, 2**32))
def test_a_random_supervisor_that_asks_one_by_one_behaves_as_interpreted(seed: int) -> None:
    """Models with many requests ask one by one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(changes, "ASKED_TOGETHER", 0)
        twins = Twins(random_supervisor(seed))
    twins.run(Random(seed), STEPS)


def test_the_random_supervisors_show_everything() -> None:
    """The fixed seeds below are checked as above; what they meet shows that the check is worth something."""
    total: Counter[str] = Counter()
    for seed in range(100):
        twins = Twins(random_supervisor(seed))
        twins.run(Random(seed), STEPS)
        total.update(twins.seen)
    print(dict(total))
    assert all(
        total[what] > least
        for what, least in {"enabled": 500, "disabled": 500, "unknown": 10, "unknown enum": 10, "skipped": 30}.items()
    )
    assert all(total[what] > 30 for what in ("taken at once", "taken apart", "skipped at once"))
    assert all(total[what] > 200 for what in ("another state", "the same state"))
    assert total["not read"] > 30
    assert total["match"] > 100 and total["no match"] > 100 and total["unknown in a condition"] > 10


@pytest.mark.parametrize(("name", "deployment"), EXAMPLE_DEPLOYMENTS)
def test_an_example_behaves_as_interpreted(name: str, deployment: Deployment) -> None:
    twins = Twins(example_supervisor(name, deployment))
    twins.run(Random(1), 200)
    samples: tuple[Any, ...] = (FULL_SCAN, {"ranges": [0.1] * 360}, {"ranges": []}, None, {"success": True}, 0.7, 2.0)
    for data in samples:
        for event in twins.events:
            twins.step(event, data)
            twins.compare()


def test_received_objects_and_mappings_are_read_alike() -> None:
    class Scan:
        ranges = FULL_SCAN["ranges"]

    system = load_system(example_supervisor("line_follower/line_follower"))
    for data in (Scan(), FULL_SCAN):
        reading = system.read("scan.response", data)
        assert reading == (("clear",), {"value": "clear"}, (), False)
    (text,) = system.read("scan.response", {"ranges": [1.0] * 5}).unknown
    assert text == "value is obstructed by default: an earlier rule is unknown"


def test_a_foreign_object_may_do_anything() -> None:
    class Bomb:
        def __getattr__(self, name: str) -> Any:
            raise RuntimeError(name)

        def __len__(self) -> int:
            raise RuntimeError("len")

        def __getitem__(self, index: int) -> Any:
            raise RuntimeError("item")

    twins = Twins(example_supervisor("line_follower/line_follower"))
    twins.step("scan.response", Bomb())
    twins.step("scan.response", {"ranges": Bomb()})
    twins.step("correction.response", Bomb())
    twins.compare()


def test_it_reads_like_the_model() -> None:
    text = python_text(example_supervisor("line_follower/line_follower"))
    for line in (
        "# value.ranges[0] > 0.4 and value.ranges[20] > 0.4 and value.ranges[340] > 0.4 -> clear",
        "if value_ranges_0 > 0.4 and value_ranges_20 > 0.4 and value_ranges_340 > 0.4:",
        "# requirement move needs LineDetector.line_found and LidarSensor.safe and",
        "# EmergencyStop.in_service",
        "self.LidarSensor__ahead = value",
        "'linear': {'x': 0.15},",
        "'angular': {'z': self.LineDetector__current_correction},",
    ):
        assert any(line == found.strip() for found in text.splitlines()), line


def test_what_the_supervisor_adds_is_explained() -> None:
    text = python_text(example_supervisor("navigation/navigation"))
    assert re.search(r"# added by the supervisor: .*Navigator\.", text)


@pytest.mark.parametrize("name", EXAMPLE_NAMES)
def test_all_files_are_python_3_8_and_depend_on_nothing(name: str) -> None:
    files = generate(example_supervisor(name), "python")
    for path, text in files.items():
        tree = ast.parse(text, feature_version=(3, 8))
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                assert not any(alias.name.startswith("robosc") for alias in node.names), path
            if isinstance(node, ast.ImportFrom):
                assert node.level or not (node.module or "").startswith("robosc"), path


def test_every_file_says_where_it_comes_from() -> None:
    supervisor = example_supervisor("line_follower/line_follower")
    for path, text in generate(supervisor, "python").items():
        head = text.splitlines()[:2]
        assert head[0].startswith("# Generated by RoboSC ") and " LineFollower;" in head[0], path
        assert head[1] == f"# Model files SHA-256: {supervisor.certificate.bundle_sha256}", path


def test_the_file_drives_an_executor_of_its_own(tmp_path: Path) -> None:
    """No module of RoboSC is used but the file itself."""
    files = generate(example_supervisor("line_follower/line_follower"), "python", GenerateOptions(package="follower"))
    sent: list[tuple[str, Any]] = []

    class Middleware:
        def prepare(self, communication: str, data: Any) -> Any:
            return data

        def is_default(self, communication: str, message: Any) -> bool:
            return not message["linear"]["x"]

        def publish(self, communication: str, message: Any) -> None:
            sent.append((communication, message))

        def publish_default(self, identifier: str) -> None:
            sent.append((identifier, None))

    with imported(files, tmp_path, "follower") as module:
        log, clock = MemoryLog(), ManualClock()
        executor = module.Executor(module.Supervisor(), Middleware(), None, clock, log)
        executor.start()
        executor.tick()
        executor.receive("/line/correction", 0.5)
        executor.receive("/scan", FULL_SCAN)
        executor.tick()
        executor.stop("test")
    assert [what for what, _ in sent] == ["halt", "move", "/cmd_vel"]
    assert sent[1][1] == {"linear": {"x": 0.15}, "angular": {"z": 0.5}}
    happened = [entry["event"] for entry in log.entries if entry["kind"] == "event"]
    assert happened == ["halt.request", "correction.response", "scan.response", "LidarSensor.tau_1", "move.request"]


ASYNC_PROGRAM = """
import asyncio, sys
from maze import AsyncController, Supervisor

class Robot:
    def __init__(self): self.sent = []
    def publish(self, message, data):
        self.sent.append(message)
        asyncio.get_event_loop().call_soon(self.controller.stop, "enough")
    def publish_default(self, identifier): self.sent.append(identifier)

async def main():
    robot = Robot()
    robot.controller = AsyncController(Supervisor(), robot)
    robot.controller.receive("/scan", {"ranges": [0.3] * 360})
    await robot.controller.run()
    print(robot.sent, [name for name in sys.modules if name.startswith("robosc")])

asyncio.run(main())
"""


@pytest.mark.parametrize("interpreter", sorted({sys.executable, *map(str, Path("/usr/bin").glob("python3"))}))
def test_the_file_alone_runs_in_another_program(interpreter: str, tmp_path: Path) -> None:
    files = generate(example_supervisor("maze_solver/maze_solver"), "python", GenerateOptions(package="maze"))
    write_files(files, tmp_path)
    (tmp_path / "program.py").write_text(ASYNC_PROGRAM)
    # The program sees nothing of this environment: no RoboSC, no installed package.
    done = subprocess.run(
        [interpreter, "-W", "error", "-s", "program.py"],
        cwd=tmp_path,
        env={},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("['rotate_left', '/cmd_vel'") and done.stdout.endswith("] []\n")


def test_the_program_of_the_documentation_runs(tmp_path: Path) -> None:
    page = (Path(__file__).parents[3] / "docs/python.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert "call_later(10.0," in program
    write_files(generate(example_supervisor("maze_solver/maze_solver"), "python"), tmp_path)
    (tmp_path / "program.py").write_text(program.replace("call_later(10.0,", "call_later(0.01,"))
    done = subprocess.run([sys.executable, "program.py"], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == ["rotate_left 90", "/cmd_vel default"]


def test_the_file_of_a_layer_holds_back_what_is_not_allowed(tmp_path: Path) -> None:
    """Use the file as its own text says."""
    supervisor = example_supervisor("line_follower/line_follower_layer", Deployment.LAYER)
    files = generate(supervisor, "python", GenerateOptions(package="follower_layer"))
    sides = BothSides()
    with imported(files, tmp_path, "follower_layer") as package:
        names: dict[str, Any] = {"robot": sides, "caller": sides}
        (code,) = code_of(package)
        exec(code, names)
        layer = names["layer"]
        assert type(layer).__module__ == "follower_layer"
        fast = {"linear": {"x": 0.2}}
        layer.on_request("/cmd_vel", fast)
        layer.receive("/line/correction", 0.5)
        layer.receive("/scan", FULL_SCAN)
        layer.on_request("/cmd_vel", {"linear": {"x": float("nan")}})
        layer.on_request("/cmd_vel", fast)
        layer.receive("/emergency_stop/stop", None)
        layer.stop("test")
    assert [sent[:2] for sent in sides.sent] == [
        ("blocked", "/cmd_vel"),
        ("pass", "/line/correction"),
        ("pass", "/scan"),
        ("blocked", "/cmd_vel"),
        ("publish", "move"),
        ("default", "/cmd_vel"),
        ("pass", "/emergency_stop/stop"),
        ("default", "/cmd_vel"),
    ]


def code_of(module: Any) -> list[str]:
    """The pieces of code in a module's text."""
    return [textwrap.dedent(code) for code in re.findall(r"(?:^    .*\n|^\n(?=    ))+", module.__doc__, re.MULTILINE)]


def test_the_text_of_a_controllers_file_says_how_it_is_used(tmp_path: Path) -> None:
    files = generate(example_supervisor("maze_solver/maze_solver"), "python", GenerateOptions(package="maze"))
    with imported(files, tmp_path, "maze") as package:
        _, code = code_of(package)
        names: dict[str, Any] = {"middleware": BothSides()}
        exec(code, names)
        names["executor"].receive("/scan", {"ranges": [0.3] * 360})
        names["executor"].tick()
    assert [sent[:2] for sent in names["middleware"].sent] == [("publish", "rotate_left")]


def test_a_package_may_be_called_as_one_likes() -> None:
    supervisor = example_supervisor("line_follower/line_follower")
    assert list(generate(supervisor, "python", GenerateOptions("my_robot"))) == ["my_robot.py"]
    for name in ("My", "1a", "a b", "../x", "a__b", "", "a" * 300, "class"):
        with pytest.raises(UnsupportedModelError, match="is not a name for a package"):
            generate(supervisor, "python", GenerateOptions(name))


HOSTILE = """
robot class {
    datatype enum None from double to { value > 0.5 -> self  default -> lambda }
    datatype object ^import { from_: double }
    component True {
        outgoing message def with identifier: "it's \\"quoted\\" \\\\ #", type: None
        incoming message pass with type: string
        service read with request: none, response: ^import links x
        behaviour {
            variable ^state: None = lambda
            variable enabled: boolean
            variable values: string = "'''\\"\\"\\"\\\\"
            variable skipped: integer(0..3)
            on response from def do ^state := value
            on response from read do enabled := value.from_ > 1.0, skipped := skipped + 1
            initial marked state return {
                on request to pass
                on request to read
                transition if True.^state = self goto _
            }
            marked state _ { transition if ^state = lambda goto return }
        }
    }
    interface x use Trigger from std_srvs
    requirement pass needs True.skipped < 3
    provide pass with "a\\nb'c\\"d\\\\ {{ x }} {% y %} é"
}
"""


def test_names_that_are_python_words_work() -> None:
    supervisor = unsupervised(HOSTILE)
    twins = Twins(supervisor)
    twins.run(Random(3), 200)
    assert twins.seen["enabled"] and twins.seen["taken"]
    for path, text in generate(supervisor, "python").items():
        ast.parse(text, filename=path, feature_version=(3, 8))


def _boolean_model(expression: Any) -> Supervisor:
    """A model with one update of a code-only boolean by an expression over a received double."""
    transition = Transition(None, "m.response", None, (Update("b", expression),), None)
    behaviour = Behaviour((Variable("b", BooleanType(), False, False),), (State("s", True, True),), (transition,))
    message = Communication("m", "C", CommunicationKind.OUTGOING_MESSAGE, "m", response=DoubleType())
    model = Model("Deep", (Component("C", behaviour),), (message,), (), (), (), (), ())
    return supervisor_of(model)


def test_a_long_chain_of_operators_is_no_problem() -> None:
    expression: Any = Binary(">", Received(), Constant(0.0))
    for _ in range(150):
        expression = Binary("and", expression, Binary(">", Received(), Constant(0.0)))
    twins = Twins(_boolean_model(expression))
    for data in (1.0, -1.0, float("nan")):
        twins.step("m.response", data)
        twins.compare()


def test_an_expression_too_deep_for_python_is_one_clear_error() -> None:
    expression: Any = Binary(">", Received(), Constant(0.0))
    for _ in range(5000):
        expression = Binary("and", Binary("=", Received(), Constant(1.0)), expression)
    with pytest.raises(UnsupportedModelError, match="the model Deep has an expression that is nested too deeply"):
        generate(_boolean_model(expression), "python")


def test_all_updates_of_a_step_read_the_state_before_it() -> None:
    model = model_of("""
        robot Swap {
            component A {
                outgoing message go with type: none
                behaviour {
                    variable x: integer(0..9) = 1
                    variable y: integer(0..9) = 2
                    on response from go do x := y, y := x goto s
                    initial marked state s { on response from go do x := B.z, y := x goto t }
                    marked state t { }
                }
            }
            component B {
                behaviour {
                    variable z: integer(0..9) = 3
                    variable in_s: boolean
                    on response from go do z := A.x, in_s := A.s
                    initial marked state only { }
                }
            }
        }
    """)
    twins = Twins(supervisor_of(model))
    found = []
    for _ in range(4):
        twins.compare()
        state = twins.generated.state()
        found.append((*state["A"]["variables"].values(), *state["B"]["variables"].values(), state["A"]["state"]))
        twins.step("go.response")
    assert found == [
        (1, 2, 3, False, "s"),
        (3, 1, 1, True, "t"),
        (1, 3, 3, False, "s"),
        (3, 1, 1, True, "t"),
    ]


RECEIVED = """
    robot Received {
        datatype enum Other from double to { value != 1.0 -> other  default -> one }
        datatype enum Small from integer(0..5) to { value < 5 -> small  default -> large }
        component C {
            outgoing message number with type: Other
            outgoing message level with type: integer(0..5)
            outgoing message size with type: Small
            outgoing message minus with type: double
            behaviour {
                variable other: Other = one
                variable level: integer(0..5)
                variable size: Small = large
                variable minus: double
                on response from number do other := value
                on response from level do level := value
                on response from size do size := value
                on response from minus do minus := -value
                initial marked state s { }
            }
        }
    }
"""


@pytest.mark.parametrize(
    ("event", "data", "value", "unknown"),
    [
        ("number", 2, "other", ()),
        ("number", 1.0, "one", ()),
        ("number", float("inf"), "other", ()),
        ("number", float("nan"), "one", ("value is one by default: an earlier rule is unknown",)),
        ("number", "2", "one", ("value is one by default: an earlier rule is unknown",)),
        ("level", 4, 4, ()),
        ("level", 9, 5, ("value is 9, outside 0..5",)),
        ("level", -9, 0, ("value is -9, outside 0..5",)),
        ("level", 2**31, 5, ("value is 2147483648, outside 0..5",)),
        ("level", -(2**70), 0, (f"value is {-(2**70)}, outside 0..5",)),
        ("size", -1, "small", ("value is -1, outside 0..5",)),
        ("size", 7, "large", ("value is 7, outside 0..5",)),
        ("minus", 2, -2.0, ()),
        ("minus", float("inf"), 0.0, ()),
        ("minus", float("nan"), 0.0, ()),
    ],
)
def test_what_is_received_is_converted_once_and_for_all(event: str, data: Any, value: Any, unknown: Any) -> None:
    twins = Twins(unsupervised(RECEIVED))
    twins.step("level.response", 2)
    assert twins.generated.read(f"{event}.response", data).unknown == unknown
    twins.step(f"{event}.response", data)
    twins.compare()
    variable = "other" if event == "number" else event
    assert same(twins.generated.state()["C"]["variables"][variable], value)


@pytest.mark.parametrize(
    ("event", "data", "message"),
    [
        ("level", 3.0, "value is 3.0, and must be an integer"),
        ("level", True, "value is True, and must be an integer"),
        ("level", None, "value is missing, and cannot be unknown"),
        ("size", None, "value is missing, and cannot be unknown"),
        ("size", "x", "value is 'x', and must be an integer"),
        ("number", None, "value is missing, and cannot be unknown"),
    ],
)
def test_what_cannot_be_unknown_is_refused_alike(event: str, data: Any, message: str) -> None:
    twins = Twins(unsupervised(RECEIVED))
    for system in (twins.generated, twins.interpreted):
        for call in (partial(system.read, f"{event}.response"), partial(system.receive, event)):
            with pytest.raises(ValueError, match=re.escape(message)):
                call(data)
    twins.compare()


def test_names_that_would_meet_stay_apart() -> None:
    text = """
        robot R {
            component A { behaviour { variable b__c: boolean  initial marked state s { } } }
            component A__b { behaviour { variable c: boolean  initial marked state s { } } }
            component ^state { behaviour { initial marked state s { } } }
        }
    """
    twins = Twins(unsupervised(text))
    twins.compare()
    assert len(set(vars(twins.generated))) == len(list(itertools.chain(vars(twins.generated))))
    assert {"A__b__c", "A__b__c_2"} <= vars(twins.generated).keys()
