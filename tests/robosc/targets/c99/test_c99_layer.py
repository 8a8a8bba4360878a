"""A generated C layer does what the reference layer does, command by command, whatever is asked and whatever comes."""

import re
import subprocess
from collections import Counter
from pathlib import Path
from random import Random

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.errors import UnsupportedModelError
from robosc.execution.runtime.settings import Settings
from robosc.model.layers import sharing_requests
from robosc.model.structure import CommunicationKind, Deployment
from robosc.supervisor import Supervisor
from robosc.targets import generate
from robosc.targets.code.c.layout import make_layout
from support.c99 import GCC, SANITIZERS, WARNINGS, lonely_end, replay
from support.c99_layer import LayerReference, compare_layer, compiled_layer, refusals_of
from support.c99_main import events_back
from support.effort import examples
from support.execution import supervisor_of
from support.generated import example_supervisor
from support.models import model_of
from support.random_layers import random_layer
from support.random_limits import limited_robot, with_defaults
from support.random_supervisors import random_supervisor
from support.ros_layers import layer_of

needs_gcc = pytest.mark.skipif(GCC is None, reason="gcc is not installed")

EXAMPLES = ("line_follower/line_follower_layer", "maze_solver/maze_solver", "navigation/navigation")

EVERYTHING = """
robot Everything {
    interface twist use Twist from some_msgs
    interface go use Go from some_msgs
    datatype object Vector { x: double  y: double }
    datatype object Twist { linear: Vector  gear: integer(0..3)  ranges: array(double) }
    datatype object Progress { left: double }
    datatype enum Level from double to { value > 1.0 -> high  value < 0.5 -> low  default -> middle }
    datatype enum Tone from integer to { 6 / value > 2.0 -> loud  default -> soft }
    component Sensors {
        outgoing message level with identifier: "/scan", type: Level
        outgoing message speed with type: double
        outgoing message button with type: none
        behaviour {
            variable level: Level = high
            variable speed: double = 1.0
            on response from level do level := value
            on response from speed do speed := value
            initial marked state calm { on response from button goto tense }
            marked state tense { on response from button goto calm }
        }
    }
    component Base {
        incoming message fast with identifier: "/cmd_vel", type: Twist, when: value.linear.x > 0.5 links twist
        incoming message back with identifier: "/cmd_vel", type: Twist, when: value.linear.x < 0.0 or value.gear = 3
            links twist
        incoming message near with identifier: "/cmd_vel", type: Twist, when: any(x in value.ranges[3..0]: x < 0.5)
            links twist
        incoming message slow with identifier: "/cmd_vel", type: Twist links twist
        incoming message loud with identifier: "/beep", type: Tone, when: value = loud
        incoming message quiet with identifier: "/beep", type: Tone
        incoming message lift with identifier: "/lift", type: double, when: value > 0.4
        incoming message bell with type: none
        service calibrate with request: none, response: boolean links go
        service ask with request: none, response: none links go
        action move with request: none, response: none, feedback: Progress links go
        action turn with request: none, response: none, feedback: none links go
        behaviour {
            variable left: double
            variable tries: integer(0..3)
            on feedback from move do left := value.left
            on request to fast
            on request to back
            on request to near
            on request to slow
            on request to bell
            on request to ask
            initial marked state idle {
                on request to loud
                on request to quiet
                on request to lift
                on request to calibrate
                on request to move goto busy
                on request to turn
            }
            marked state busy {
                on response from move do tries := 0 goto idle
                on error from move do tries := if tries < 3 then tries + 1 else 0 goto idle
                on cancel to move goto idle
                on request to turn
            }
        }
    }
    requirement fast needs Sensors.calm and Sensors.level != low
    requirement back needs Sensors.calm
    requirement near needs Sensors.level != middle
    requirement lift needs Sensors.calm
    requirement loud needs Base.tries < 2
    requirement move needs Sensors.calm
    requirement move needs Base.idle
    requirement turn needs Sensors.level != low
}
"""


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled_layer(layer_of(EVERYTHING), tmp_path_factory.mktemp("everything"))


def _kinds(lines: list[str]) -> Counter[str]:
    """Count what happened: kinds of lines, with the reason of what was held back and how goals ended."""
    found: Counter[str] = Counter()
    for line in lines:
        words = line.split()
        found[" ".join(words[: 2 if words[0] == "log" else 1])] += 1
        if words[:2] == ["log", "blocked"]:
            found[line] += 1
        if words[0] == "end":
            found[f"end {words[3]}"] += 1
    return found


@needs_gcc
@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_behaves_as_the_reference(name: str, tmp_path: Path) -> None:
    supervisor = example_supervisor(name, Deployment.LAYER)
    lines = compare_layer(supervisor, compiled_layer(supervisor, tmp_path), Random(1), 5, 120)
    assert _kinds(lines)["log event"] > 100


@needs_gcc
def test_requests_of_every_kind_behave_as_the_reference(everything: Path) -> None:
    seen = _kinds(compare_layer(layer_of(EVERYTHING), everything, Random(7), 50, 150))
    for what in "release stop resume restart fault unknown unexpected event cancelling cancel_overdue blocked".split():
        assert seen[f"log {what}"] > 5, seen
    for what in "publish default call goal cancel pass blocked answer no_answer accept reject feedback end".split():
        assert seen[what] > 5, seen
    for reason in range(len(refusals_of(make_layout(layer_of(EVERYTHING))))):
        assert seen[f"log blocked {reason}"] > 2, (reason, seen)
    for end in range(3):
        assert seen[f"end {end}"] > 5, (end, seen)


@needs_gcc
@settings(max_examples=examples(12))
@given(st.integers(0, 2**32))
def test_any_sequence_behaves_as_the_reference(everything: Path, seed: int) -> None:
    compare_layer(layer_of(EVERYTHING), everything, Random(seed), 2, 100)


@needs_gcc
@pytest.mark.usefixtures("size")
def test_random_supervisors_behave_as_the_reference(tmp_path: Path) -> None:
    """Fixed seeds, since each costs a compiler run."""
    seen: Counter[str] = Counter()
    for seed in range(20):
        supervisor = msgspec.structs.replace(random_supervisor(seed), deployment=Deployment.LAYER)
        if any(len(sharing) > 1 for sharing in sharing_requests(supervisor.model)):
            continue  # No condition distinguishes these.
        try:
            program = compiled_layer(supervisor, tmp_path / str(seed))
        except UnsupportedModelError:
            continue
        seen.update(_kinds(compare_layer(supervisor, program, Random(seed), 5, 80)))
    for what in ("log event", "log unknown", "log unexpected", "log fault", "publish", "blocked"):
        assert seen[what] > 5, seen


@needs_gcc
def test_random_robots_behave_as_the_reference(tmp_path: Path) -> None:
    """Robots in which silent steps are many and may not end; their messages are distinguished by conditions."""
    seen: Counter[str] = Counter()
    for seed in range(8):
        supervisor = random_layer(Random(seed))
        if seed % 2:
            supervisor = limited_robot(with_defaults(supervisor, Random(seed)), Random(seed))
        program = compiled_layer(supervisor, tmp_path / str(seed))
        seen.update(_kinds(compare_layer(supervisor, program, Random(seed), 5, 80)))
    for what in ("publish", "log release", "log blocked 0", "log fault", "call", "no_answer"):
        assert seen[what] > 5, seen


@needs_gcc
def test_sanitizers_find_nothing(tmp_path: Path) -> None:
    for number, supervisor in enumerate((layer_of(EVERYTHING), random_layer(Random(3)))):
        program = compiled_layer(supervisor, tmp_path / str(number), *SANITIZERS)
        compare_layer(supervisor, program, Random(number), 4, 80)


@needs_gcc
def test_optimized_code_behaves_alike(tmp_path: Path) -> None:
    supervisor = layer_of(EVERYTHING)
    compare_layer(supervisor, compiled_layer(supervisor, tmp_path, "-O2"), Random(5), 4, 100)


TWO_GOALS = """
robot TwoGoals {
    interface dock use Dock from some_msgs
    component P {
        action one with request: none, response: none, feedback: none links dock
        action two with request: none, response: none, feedback: none links dock
        incoming message go with type: integer
        behaviour {
            initial marked state fine {
                on request to one
                on request to two
                on request to go
                on error from one goto broken
            }
            marked state broken { }
        }
    }
    requirement two needs P.fine
    requirement go needs P.fine
}
"""


class _Caller:
    """A reference layer with a message `go`, driven by hand.

    Args:
        text: Its model.
        named: Settings by name.
    """

    def __init__(self, text: str = TWO_GOALS, **named: object) -> None:
        self.supervisor = layer_of(text)
        self.reference = LayerReference(self.supervisor, Random(1), Settings(**named))  # type: ignore[arg-type]
        self.executor = self.reference.executor
        self.executor.start()
        self.reference.command("s")

    def goal(self, name: str, caller: int) -> None:
        message = {"x": 1.0}
        sent = self.reference._sent(name, message)
        self.executor.on_goal(name, caller, message)
        self.reference.command("q", self.reference._place(f"goal_{name}"), caller, *sent)

    def cancel(self, name: str, caller: int) -> None:
        self.executor.on_cancel(name, caller)
        self.reference.command("q", self.reference._place(f"cancel_{name}"), caller)

    def accept(self, number: int) -> None:
        self.executor.on_goal_accepted(number)
        self.reference.command("a", number)

    def go(self) -> None:
        message = {"x": 1.0}
        sent = self.reference._sent("go", message)
        self.executor.on_request("go", message)
        self.reference.command("q", 0, *sent)

    def receive(self, identifier: str) -> None:
        number = self.reference.remember(None)
        self.executor.receive(identifier, None)
        self.reference.command("m", list(self.reference.layout.received_topics).index(identifier), number)

    def watch(self, seconds: float) -> None:
        self.reference.clock.advance(seconds)
        self.executor.watch()
        self.reference.command("w")

    def lines(self) -> list[str]:
        return [line for line in self.reference.lines if not line.startswith(("state", "log"))]

    def check(self, folder: Path) -> None:
        program = compiled_layer(self.supervisor, folder)
        replay(program, self.reference.commands, self.reference.lines)


@needs_gcc
def test_a_goal_ends_for_its_caller_when_it_turns_against_its_requirements(tmp_path: Path) -> None:
    world = _Caller(action_timeout_s=None)
    world.goal("one", 7)
    world.goal("two", 8)
    world.accept(1)
    world.accept(2)
    world.reference.end(1, "aborted")
    # `one` has failed, so `two` is cancelled: aborted for its caller as soon as its server ends it.
    world.goal("two", 9)
    world.reference.end(2, "cancelled")
    assert world.lines()[4:] == ["cancel 1 2", "end 0 7 1 -1 1", "reject 1 9", f"blocked {_TWO} 3", "end 1 8 1 -1 4"]
    world.check(tmp_path)


_TWO = "x" + b"two".hex()


@needs_gcc
def test_a_cancelled_goal_ends_as_its_server_ends_it(tmp_path: Path) -> None:
    world = _Caller()
    for number, outcome in enumerate(("cancelled", "aborted"), 1):
        world.goal("two", number)
        world.cancel("two", number)
        world.cancel("two", number)
        world.accept(number)
        world.reference.end(number, outcome)
    ends = [line.split()[:4] for line in world.lines() if line.startswith("end")]
    assert ends == [["end", "1", "1", "2"], ["end", "1", "2", "1"]]
    world.check(tmp_path)


@needs_gcc
def test_a_caller_that_falls_silent_is_released_once(tmp_path: Path) -> None:
    world = _Caller(release_identifiers=("go",), command_timeout_s=1.0)
    world.go()
    world.watch(0.75)
    world.go()
    world.watch(0.75)
    assert "default 0" not in world.lines()
    world.watch(0.25)
    world.watch(5.0)
    assert world.lines() == ["publish 0 0", "publish 0 1", "default 0"]
    world.check(tmp_path)


@needs_gcc
def test_what_a_request_makes_false_does_not_release_its_own_earlier_message(tmp_path: Path) -> None:
    text = """
        robot Steps { component P {
            incoming message go with type: integer
            outgoing message ready with type: none
            behaviour {
                on request to go goto moving
                initial marked state still { }
                marked state moving { on response from ready goto still }
            }
        }
        requirement go needs P.still }
    """
    world = _Caller(text, release_identifiers=("go",))
    for _ in range(3):
        world.go()
        world.receive("ready")
    assert [line for line in world.lines() if not line.startswith("pass")] == [f"publish 0 {n}" for n in (0, 2, 4)]
    world.check(tmp_path)


@needs_gcc
def test_a_cancel_is_forwarded_and_what_goes_wrong_at_its_end_stops_the_robot(tmp_path: Path) -> None:
    text = """
        robot Endless {
        interface dock use Dock from some_msgs
        component P {
            action one with request: none, response: none, feedback: none links dock
            incoming message go with type: integer
            behaviour {
                on request to one
                on request to go
                initial marked state fine { on cancel to one goto left }
                marked state left { transition goto right }
                state right { transition goto left }
            }
        } }
    """
    world = _Caller(text, release_identifiers=("go",))
    world.goal("one", 7)
    world.accept(1)
    world.cancel("one", 7)
    assert not world.executor.is_faulty
    world.reference.end(1, "cancelled")
    assert world.executor.is_faulty
    assert [line.split()[:4] for line in world.lines()[2:]] == [
        ["cancel", "0", "1"],
        ["end", "0", "7", "2"],
        ["default", "0"],
    ]
    world.check(tmp_path)


@needs_gcc
@pytest.mark.parametrize("name", EXAMPLES)
def test_the_example_program_runs(name: str, tmp_path: Path) -> None:
    supervisor = example_supervisor(name, Deployment.LAYER)
    done = _run_example(supervisor, tmp_path)
    assert "bytes of RAM" in done
    assert "blocked /" in done
    assert lonely_end(supervisor) in done


@needs_gcc
def test_the_example_program_asks_for_everything(tmp_path: Path) -> None:
    done = _run_example(layer_of(EVERYTHING), tmp_path)
    for words in ("publish on /cmd_vel", "publish on bell", "call calibrate", "send_goal move", "accept_goal turn"):
        assert words in done, done


def _run_example(supervisor: Supervisor, folder: Path) -> str:
    files = generate(supervisor, "c99")
    for path, text in files.items():
        (folder / path).write_text(text, encoding="utf-8")
    sources = [path for path in files if path.endswith(".c")]
    command = [str(GCC), *WARNINGS, "-Wstrict-prototypes", *sources, "-lm", "-o", "example"]
    subprocess.run(command, cwd=folder, check=True)
    return subprocess.run([folder / "example"], capture_output=True, text=True, check=True).stdout


@needs_gcc
def test_nothing_allocates_and_nothing_is_global(tmp_path: Path) -> None:
    compiled_layer(layer_of(EVERYTHING), tmp_path, "-fno-pie", "-no-pie")
    symbols = subprocess.run(["nm", "unit.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    kinds = {line.split()[-1]: line.split()[-2] for line in symbols.splitlines()}
    assert {name for name, kind in kinds.items() if kind == "U"} <= {"memset", "memcpy", "strcmp", "__stack_chk_fail"}
    assert not {name for name, kind in kinds.items() if kind in "bBdDC"}
    assert all(name.startswith("everything_supervisor_") for name, kind in kinds.items() if kind == "T")


@needs_gcc
def test_a_layer_without_one_of_its_callbacks_is_refused(tmp_path: Path) -> None:
    files = generate(layer_of(EVERYTHING), "c99")
    for path, text in files.items():
        (tmp_path / path).write_text(text, encoding="utf-8")
    settings_ = re.findall(r"\n    callbacks\.(\w+) = ", files["main.c"])
    assert len(settings_) == 14
    unit = [str(GCC), "-std=c99", "-c", "everything_supervisor.c"]
    subprocess.run(unit, cwd=tmp_path, check=True)
    for name in settings_:
        text = files["main.c"].replace("    callbacks.log = print_log;", f"    callbacks.{name} = NULL;")
        (tmp_path / "main.c").write_text(text, encoding="utf-8")
        command = [str(GCC), "-w", "-std=c99", "main.c", "everything_supervisor.o", "-lm", "-o", "example"]
        subprocess.run(command, cwd=tmp_path, check=True)
        done = subprocess.run([tmp_path / "example"], capture_output=True, check=False)
        assert done.returncode == (0 if name == "log" else 1), name


def test_a_layer_has_nothing_that_decides() -> None:
    files = generate(layer_of(EVERYTHING), "c99")
    assert set(files) == {
        *("CMakeLists.txt", "README.md", "main.c"),
        *("everything_supervisor.c", "everything_supervisor.h"),
    }
    for path, text in files.items():
        words = r"polic|priorit|decid(?!es nothing)|decision(?! diagram)|_tick|seed|fits\b|IS_LAYER"
        assert not re.search(words, text.replace("what does not fit", "")), path


def test_the_header_says_where_data_tells_messages_apart() -> None:
    text = generate(layer_of(EVERYTHING), "c99")["everything_supervisor.h"]
    # Comments go over lines that begin with an asterisk.
    header = " ".join(word for word in text.split() if word != "*")
    sentence = "Its data says which of them; what is not known of it is unknown."
    assert f"The caller sends a message on /beep: loud, quiet. {sentence}" in header
    assert "The caller sends a message on bell: bell." in header
    assert f"on bell: bell. {sentence}" not in header


HOSTILE = """
robot Class {
    datatype enum None from double to { value > 0.5 -> self  default -> int }
    datatype object struct { from_: double  double_: double  int: array(double)  _x: boolean  NULL: double }
    interface x use Trigger from std_srvs
    component union {
        outgoing message def with identifier: "it's \\"quoted\\" \\\\ #*/ ??/", type: None
        outgoing message sent with identifier: "/sent", type: double
        incoming message return with identifier: "it's %s \\"quoted\\" \\\\ #*/ ??/", type: struct, when: value._x
            links x
        incoming message what with identifier: "it's %s \\"quoted\\" \\\\ #*/ ??/", type: struct,
            when: value.NULL > 1.0 links x
        incoming message printf with identifier: "/request", type: None, when: value = self
        incoming message data with identifier: "/a/b", type: double, when: value > 0.5
        incoming message notes with identifier: "/a_b", type: string, when: value = "a\\nb'c\\"d\\\\ {{ x }} %d ?? */"
        service failed with request: none, response: struct links x
        service t with request: none, response: none links x
        action refused with request: none, response: none, feedback: none links x
        behaviour {
            initial marked state x_y {
                on request to return
                on request to what
                on request to printf
                on request to data
                on request to notes
                on request to failed
                on request to refused
            }
        }
    }
}
"""


@needs_gcc
def test_names_that_are_words_of_c_work(tmp_path: Path) -> None:
    supervisor = layer_of(HOSTILE)
    lines = compare_layer(supervisor, compiled_layer(supervisor, tmp_path), Random(3), 5, 100)
    assert any(line.startswith("publish") for line in lines)
    _run_example(supervisor, tmp_path)


@needs_gcc
def test_a_model_without_one_kind_of_communication_works(tmp_path: Path) -> None:
    """Check that parts that a model does not need leave nothing that a compiler would call unused."""
    model = model_of(EVERYTHING)
    for kind in CommunicationKind:
        only = model_of(_ONLY[kind])
        supervisor = supervisor_of(only, Deployment.LAYER)
        folder = tmp_path / kind.name
        compare_layer(supervisor, compiled_layer(supervisor, folder), Random(2), 4, 60)
        _run_example(supervisor, folder)
    assert {item.kind for item in model.communications} == set(_ONLY)


_ONLY = {
    CommunicationKind.INCOMING_MESSAGE: """robot Only { component C {
        incoming message go with type: none
        behaviour { initial marked state s { on request to go } } } }""",
    CommunicationKind.OUTGOING_MESSAGE: """robot Only { component C {
        outgoing message seen with type: double
        behaviour { variable v: double  on response from seen do v := value  initial marked state s { } } } }""",
    CommunicationKind.SERVICE: """robot Only { interface x use Trigger from std_srvs component C {
        service ask with request: none, response: none links x
        behaviour { initial marked state s { on request to ask } } } }""",
    CommunicationKind.ACTION: """robot Only { interface x use Trigger from std_srvs component C {
        action run with request: none, response: none, feedback: none links x
        behaviour { initial marked state s { on request to run } } } }""",
}


def test_the_same_supervisor_gives_the_same_bytes() -> None:
    first, second = layer_of(EVERYTHING), layer_of(EVERYTHING)
    assert generate(first, "c99") == generate(second, "c99")
    assert events_back(LayerReference(first, Random(1)).layout)
