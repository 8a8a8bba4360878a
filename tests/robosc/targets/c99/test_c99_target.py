"""Generated C does what the reference executor does, command by command, whatever the model and the data."""

import re
import subprocess
from collections import Counter
from pathlib import Path
from random import Random

import msgspec
import pytest

from robosc.errors import UnsupportedModelError
from robosc.execution.runtime.settings import Settings
from robosc.expressions import Binary, BooleanType, Constant, DoubleType, Expression, Received
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
from robosc.supervisor import Supervisor
from robosc.targets import GenerateOptions, generate
from robosc.targets.code.c.naming import member_name, prefix_for
from robosc.targets.code.c.text import safe, string_literal
from support.c99 import GCC, OUTCOMES, SANITIZERS, WARNINGS, Reference, compare, compiled, lonely_end, replay
from support.c99_main import events_back
from support.execution import supervisor_of, unsupervised
from support.generated import example_supervisor
from support.models import EXAMPLE_NAMES
from support.random_controllers import random_robot
from support.random_supervisors import random_supervisor

needs_gcc = pytest.mark.skipif(GCC is None, reason="gcc is not installed")


def _controller(seed: int) -> Supervisor:
    return msgspec.structs.replace(random_supervisor(seed), deployment=Deployment.CONTROLLER)


@needs_gcc
@pytest.mark.parametrize("name", EXAMPLE_NAMES)
def test_an_example_behaves_as_the_reference(name: str, tmp_path: Path) -> None:
    supervisor = example_supervisor(name)
    lines = compare(supervisor, compiled(supervisor, tmp_path), Random(1), 8, 150)
    assert sum(line.startswith("log event") for line in lines) > 300


@needs_gcc
@pytest.mark.usefixtures("size")
def test_random_supervisors_behave_as_the_reference(tmp_path: Path) -> None:
    """Fixed seeds, since each costs a compiler run; what they meet shows that the comparison is worth something."""
    seen: Counter[str] = Counter()
    for seed in range(18):
        supervisor = _controller(seed)
        try:
            program = compiled(supervisor, tmp_path / str(seed))
        except UnsupportedModelError:
            continue
        seen.update(_kinds(compare(supervisor, program, Random(seed), 4, 80)))
    for what in ("log event", "log unknown", "log unexpected", "log fault", "log restart", "publish"):
        assert seen[what] > 5, seen


EVERYTHING = """
robot Everything {
    interface twist use Twist from geometry_msgs
    interface go use Go from some_msgs
    datatype object Twist { x: double  y: double }
    datatype object Goal { place: integer  fast: boolean }
    datatype object Progress { left: double }
    datatype enum Level from double to { value > 1.0 -> high  value < 0.5 -> low  default -> middle }
    datatype enum Side from double to { value >= 0.7 -> left  default -> right }
    component Sensors {
        outgoing message level with identifier: "/scan", type: Level
        outgoing message side with identifier: "/scan", type: Side
        outgoing message speed with type: double
        outgoing message button with type: none
        behaviour {
            variable level: Level = high
            variable side: Side = left
            variable speed: double = 1.0
            on response from level do level := value
            on response from side do side := value
            on response from speed do speed := value
            initial marked state calm {
                on response from button goto tense
                on request to turn goto tense
            }
            marked state tense { on response from button goto calm }
        }
    }
    component Base {
        incoming message forward with identifier: "/cmd", type: Twist links twist
        incoming message back with identifier: "/cmd", type: Twist links twist
        incoming message turn with identifier: "/turn", type: Twist links twist
        incoming message beep with type: integer
        service calibrate with request: none, response: boolean links go
        action move with request: Goal, response: none, feedback: Progress links go
        behaviour {
            variable tries: integer(0..3)
            variable left: double
            on feedback from move do left := value.left
            initial marked state idle {
                on request to forward
                on request to back
                on request to turn
                on request to beep
                on request to calibrate
                on request to move goto busy
            }
            marked state busy {
                on request to turn
                on request to calibrate
                on response from move do tries := 0 goto idle
                on error from move do tries := if tries < 3 then tries + 1 else 0 goto idle
                on cancel to move goto idle
            }
        }
    }
    component Wheels {
        behaviour {
            initial marked state still {
                on request to turn goto rolling
                on response from speed goto rolling
            }
            marked state rolling {
                on request to turn
                on response from level goto still
            }
        }
    }
    requirement forward needs Sensors.level = high and Sensors.calm
    requirement back needs Sensors.level = low or Sensors.side = left
    requirement turn needs Wheels.still and Sensors.calm
    requirement Sensors.level = middle disables calibrate
    requirement move needs Sensors.calm
    requirement move needs Base.idle
    requirement move needs Sensors.level != low
    provide forward with { x: 1.0 / Sensors.speed } if Sensors.side = left
    provide forward with { x: 0.5, y: Sensors.speed }
    provide back with { x: 0.0 }
    provide turn with { y: Sensors.speed - 1.0 }
    provide beep with Base.tries
    provide move with { place: Base.tries + 1, fast: Sensors.side = right }
}
"""


@needs_gcc
@pytest.mark.usefixtures("size")
def test_requests_of_every_kind_behave_as_the_reference(tmp_path: Path) -> None:
    supervisor = unsupervised(EVERYTHING)
    seen = Counter(_kinds(compare(supervisor, compiled(supervisor, tmp_path), Random(7), 60, 150)))
    for what in "release stop resume restart fault unknown unexpected event cancelling cancel_overdue".split():
        assert seen[f"log {what}"] > 5, seen
    for what in ("publish", "default", "call", "goal", "cancel"):
        assert seen[what] > 5, seen


TWO_GOALS = """
robot TwoGoals {
    interface dock use Dock from some_msgs
    interface check use Check from some_msgs
    component P {
        action one with request: none, response: none, feedback: none links dock
        action two with request: none, response: none, feedback: none links dock
        service ask with request: none, response: none links check
        incoming message go with type: integer
        behaviour {
            initial marked state fine {
                on request to one
                on request to two
                on request to ask
                on request to go
                on error from one goto broken
                on error from ask goto broken
            }
            marked state broken { }
        }
    }
    requirement two needs P.fine
    requirement go needs P.fine
    provide go with 1
}
"""


@needs_gcc
def test_a_goal_that_another_that_timed_out_has_cancelled_does_not_time_out_with_it(tmp_path: Path) -> None:
    supervisor = unsupervised(TWO_GOALS)
    reference = Reference(supervisor, Random(1), Settings(action_timeout_s=2.0, release_identifiers=()))
    executor = reference.executor
    executor.start()
    reference.command("s")
    for _ in range(2):
        executor.tick()
        reference.command("t")
    reference.clock.advance(3.0)
    executor.watch()
    reference.command("w")
    assert sum(line.startswith("goal") for line in reference.lines) == 2
    for number in list(reference.goals):
        executor.on_goal_ended(number, "cancelled")
        reference.command("e", number, OUTCOMES.index("cancelled"))
    for event, count in (("one.error", 1), ("one.cancel", 0), ("two.error", 0), ("two.cancel", 1)):
        assert reference.lines.count(f"log event {reference.events[event]}") == count
    assert executor.counters.unexpected == 0
    # The error of the first one has turned against the other.
    assert f"log cancelling {reference.numbers['two']} requirement 1" in reference.lines
    assert f"log cancelling {reference.numbers['one']} timeout" in reference.lines
    replay(compiled(supervisor, tmp_path), reference.commands, reference.lines)


@needs_gcc
@pytest.mark.parametrize("outcome", ["succeeded", "aborted"])
def test_the_end_of_a_goal_is_taken_whatever_else_is_over(outcome: str, tmp_path: Path) -> None:
    supervisor = unsupervised(TWO_GOALS)
    settings = Settings(service_timeout_s=2.0, release_identifiers=("go",))
    reference = Reference(supervisor, Random(1), settings)
    executor = reference.executor
    executor.start()
    reference.command("s")
    for _ in range(4):
        executor.tick()
        reference.command("t")
    number = next(number for number, name in reference.goals.items() if name == "one")
    reference.clock.advance(2.0)
    # The call is over its time, which makes a release due, which fails.
    reference.let_fail("default")
    executor.on_goal_ended(number, outcome)
    if outcome == "succeeded":
        reference.command("b", events_back(reference.layout).index("one.response"), number)
    else:
        reference.command("e", number, OUTCOMES.index(outcome))
    assert executor.is_faulty
    reference.let_fail()
    executor.restart()
    reference.command("R")
    # The other goal, of which the model knows nothing now, must end before anything is requested.
    executor.tick()
    reference.command("t")
    (other,) = (number for number, name in reference.goals.items() if name == "two")
    executor.on_goal_ended(other, "cancelled")
    reference.command("e", other, OUTCOMES.index("cancelled"))
    for _ in range(4):
        executor.tick()
        reference.command("t")
    assert [name for number_, name in sorted(reference.goals.items())].count("one") == 2
    replay(compiled(supervisor, tmp_path), reference.commands, reference.lines)


CARRIER = """
robot Carrier {
    interface go use Go from some_msgs
    component Base {
        action drive with request: none, response: none, feedback: none links go
        behaviour {
            initial marked state still { on request to drive goto driving }
            marked state driving {
                on response from drive goto still
                on error from drive goto lost
                on cancel to drive goto still
            }
            marked state lost { }
        }
    }
    component Arm {
        incoming message lift with type: none
        outgoing message person with type: none
        behaviour {
            initial marked state clear {
                on response from person goto blocked
                on request to lift
            }
            marked state blocked { on request to lift }
        }
    }
    requirement drive needs Arm.clear
    requirement lift needs Base.still and Arm.blocked
}
"""


@needs_gcc
@pytest.mark.parametrize("is_accepted", [True, False], ids=["accepted", "not-accepted"])
@pytest.mark.parametrize(
    ("outcome", "event"),
    [
        ("cancelled", "drive.cancel"),
        ("succeeded", "drive.response"),
        *((outcome, "drive.error") for outcome in ("rejected", "aborted", "lost")),
        (None, None),
    ],
)
def test_a_cancelled_goal_is_executed_until_its_end_is_known(
    outcome: str | None, event: str | None, is_accepted: bool, tmp_path: Path
) -> None:
    """A goal of a server that brakes, succeeds or fails in spite of the cancel, or never answers."""
    supervisor = unsupervised(CARRIER)
    reference = Reference(supervisor, Random(1), Settings(cancel_timeout_s=2.0))
    executor = reference.executor

    def ticks(seconds: float) -> None:
        reference.clock.advance(seconds)
        executor.tick()
        reference.command("t")

    def lines(*beginnings: str) -> list[str]:
        return [line for line in reference.lines if line.startswith(beginnings)]

    executor.start()
    reference.command("s")
    ticks(0.0)
    if is_accepted:
        executor.on_goal_accepted(1)
        reference.command("a", 1)
    executor.receive("person", None)
    reference.command("m", 0)
    drive = reference.numbers["drive"]
    assert lines("log cancelling") == [f"log cancelling {drive} requirement 1"]
    assert len(lines("cancel")) == is_accepted
    if not is_accepted:
        executor.on_goal_accepted(1)
        reference.command("a", 1)
        assert len(lines("cancel")) == 1
    for _ in range(3):
        ticks(1.0)
        executor.on_feedback(1, None)
        reference.command("b", events_back(reference.layout).index("drive.feedback"), 1)
    # The wheels may turn.
    assert not lines("publish")
    assert lines("log cancel_overdue") == [f"log cancel_overdue {drive}"]
    assert executor.overdue_cancels == ("drive",)
    if outcome is not None:
        executor.on_goal_ended(1, outcome)
        words = ("b", events_back(reference.layout).index("drive.response"), 1)
        reference.command(*(words if outcome == "succeeded" else ("e", 1, OUTCOMES.index(outcome))))
        ticks(1.0)
        assert bool(lines("publish")) is (outcome in ("cancelled", "succeeded"))
    ends = [f"drive.{kind}" for kind in ("response", "error", "cancel")]
    happened = [end for end in ends if f"log event {reference.events[end]}" in reference.lines]
    assert happened == ([] if event is None else [event])
    assert executor.cancelling == (() if event else ("drive",))
    assert executor.counters.unexpected == 0
    replay(compiled(supervisor, tmp_path), reference.commands, reference.lines)


@needs_gcc
def test_random_robots_behave_as_the_reference(tmp_path: Path) -> None:
    """Robots in which silent steps are many and may not end."""
    for seed in (3, 10, 17, 20, 21, 24, 107, 108):
        supervisor = random_robot(seed)
        compare(supervisor, compiled(supervisor, tmp_path / str(seed)), Random(seed), 6, 100)


@needs_gcc
def test_sanitizers_find_nothing(tmp_path: Path) -> None:
    for number, supervisor in enumerate((example_supervisor("navigation/navigation"), _controller(167))):
        program = compiled(supervisor, tmp_path / str(number), *SANITIZERS)
        compare(supervisor, program, Random(number), 3, 100)


@needs_gcc
def test_optimized_code_behaves_alike(tmp_path: Path) -> None:
    supervisor = example_supervisor("navigation/navigation")
    compare(supervisor, compiled(supervisor, tmp_path, "-O2"), Random(5), 5, 150)


def _kinds(lines: list[str]) -> list[str]:
    return [" ".join(line.split()[: 2 if line.startswith("log") else 1]) for line in lines]


HOSTILE = """
robot Class {
    datatype enum None from double to { value > 0.5 -> self  default -> int }
    datatype object struct { from_: double  double_: double  int: array(double)  _x: boolean  NULL: double }
    component union {
        outgoing message def with identifier: "it's \\"quoted\\" \\\\ #*/ ??/", type: None
        outgoing message a_b with identifier: "/a/b", type: double
        outgoing message a__b with identifier: "/a_b", type: boolean
        outgoing message void with identifier: "/v", type: struct links x
        incoming message return with type: string
        service read with request: none, response: struct links x
        behaviour {
            variable errno: None = int
            variable volatile: boolean
            variable words: string = "'''\\"\\"\\"\\\\ %s ??/ */"
            variable int: integer(0..3)
            variable number: double
            on response from def do errno := value
            on response from a_b do number := value
            on response from a__b do volatile := value
            on response from void do number := max(value.int[0..2]), volatile := value._x
            on response from read do volatile := value.from_ > 1.0, int := int + 1
            initial marked state x_y {
                on request to return
                on request to read
                transition if union.errno = self goto x__y
            }
            marked state x__y { transition if errno = None.int goto x_y }
        }
    }
    component union_x { behaviour { variable y: boolean  initial marked state y_2 { } } }
    interface x use Trigger from std_srvs
    requirement return needs union.int < 3
    provide return with "a\\nb'c\\"d\\\\ {{ x }} %d ?? */ é"
}
"""


BELOW_ZERO = """
robot BelowZero {
    component P {
        outgoing message seen with type: integer(-40000..40000)
        outgoing message least with type: integer(-2147483648..2147483647)
        incoming message told with type: integer
        behaviour {
            variable kept: integer(-100..100) = -100
            variable lowest: integer(-2147483648..2147483647) = -2147483648
            on response from seen do kept := value
            on response from least do lowest := value
            initial marked state fine {
                on request to told
            }
        }
    }
    provide told with P.kept
    requirement told needs P.kept > -90 and P.lowest > -2147483648
}
"""


@needs_gcc
def test_a_word_of_a_comment_is_no_reading_of_the_old_state(tmp_path: Path) -> None:
    """A compiler warns about a copy that nothing reads."""
    supervisor = unsupervised("""robot R {
        component Threshold {
            outgoing message tick with type: none
            behaviour {
                variable level: integer(0..3)
                variable other: integer(0..3)
                on response from tick do other := if Threshold.level < 100 then 1 else 2
                initial marked state s { }
            }
        }
    }""")
    compiled(supervisor, tmp_path)


@needs_gcc
@pytest.mark.parametrize("text", [HOSTILE, BELOW_ZERO], ids=["words-of-c", "ranges-below-zero"])
def test_hostile_names_and_ranges_below_zero_work(text: str, tmp_path: Path) -> None:
    supervisor = unsupervised(text)
    lines = compare(supervisor, compiled(supervisor, tmp_path), Random(3), 5, 150)
    assert any(line.startswith("publish") for line in lines)


# Beginnings of names of the library and of the generated code, names of headers, of other files, of targets of CMake.
CLASHING = """
    All Add Clean Double Equal Find Float Help Install Int32 Kleene M Main Math Notes Ptrdiff Robot Size State Stdbool
    Stdint Stdio String Test Uint8 Value
""".split()


@needs_gcc
def test_no_name_of_a_robot_clashes_with_anything(tmp_path: Path) -> None:
    for robot in CLASHING:
        files = generate(unsupervised(EVERYTHING.replace("robot Everything", f"robot {robot}")), "c99")
        assert len(files) == 5
        folder = tmp_path / robot
        folder.mkdir()
        for path, text in files.items():
            (folder / path).write_text(text, encoding="utf-8")
        command = [str(GCC), *WARNINGS, "-I.", "-fsyntax-only", *(path for path in files if path.endswith(".c"))]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, (robot, done.stderr[:2000])
        target = re.search(r"add_library\((\w+) ", files["CMakeLists.txt"])
        assert target is not None
        assert target[1].endswith("_supervisor")


@needs_gcc
def test_very_long_names_stay_apart(tmp_path: Path) -> None:
    long = "n" * 250
    text = f"""
        robot {"R" * 255} {{
            component {long}1 {{
                incoming message {long}a with type: none
                incoming message {long}b with type: none
                behaviour {{ variable {long}x: boolean  variable {long}y: boolean
                    initial marked state {long}s {{ on request to {long}a goto {long}t }}
                    marked state {long}t {{ on request to {long}b goto {long}s }} }}
            }}
        }}
    """
    supervisor = unsupervised(text)
    compare(supervisor, compiled(supervisor, tmp_path), Random(3), 3, 50)


def test_prefixes_are_identifiers_that_c_leaves_to_programs() -> None:
    assert prefix_for("LineFollower") == "line_follower_supervisor"
    assert prefix_for("line_supervisor") == "line_supervisor"
    assert prefix_for("Supervisor") == "supervisor_supervisor"
    assert prefix_for("Island") == "robot_island_supervisor"
    assert prefix_for("Sem") == "robot_sem_supervisor"
    assert prefix_for("Integer") == "robot_integer_supervisor"
    assert prefix_for("Value") == "robot_value_supervisor"
    assert prefix_for("_") == "robot_supervisor"
    assert len(prefix_for("R" * 500)) < 80
    for name in ("int", "errno", "_x", "NULL", "class", "__"):
        assert re.fullmatch(r"[a-z]\w*_|[A-Z]\w*_", member_name(name)), member_name(name)
    assert member_name("x") == "x"


def test_texts_are_escaped() -> None:
    assert string_literal('a"\\\n?é') == '"a\\042\\134\\012\\077\\303\\251"'
    assert "*/" not in safe("*/ ??/")
    for text in ("*/ ??/", "???/", "????", "?????/"):
        assert "??" not in safe(text)


@needs_gcc
@pytest.mark.parametrize("robot", ["ball_pusher", "line_follower", "maze_solver", "object_finder", "person_follower"])
def test_it_compiles_beside_what_a_c_library_adds_to_the_standard(robot: str, tmp_path: Path) -> None:
    """Compile like catkin and most builds: with names that the headers declare beyond C99, such as `finite`."""
    files = generate(example_supervisor(f"{robot}/{robot}"), "c99")
    for path, text in files.items():
        (tmp_path / path).write_text(text, encoding="utf-8")
    sources = [path for path in files if path.endswith(".c")]
    command = [str(GCC), "-std=gnu17", "-D_GNU_SOURCE", "-Wall", "-Wextra", "-Werror", "-c", *sources]
    subprocess.run(command, cwd=tmp_path, check=True)


@needs_gcc
@pytest.mark.parametrize("name", EXAMPLE_NAMES)
def test_the_example_program_runs(name: str, tmp_path: Path) -> None:
    supervisor = example_supervisor(name)
    files = generate(supervisor, "c99")
    for path, text in files.items():
        (tmp_path / path).write_text(text, encoding="utf-8")
    sources = [path for path in files if path.endswith(".c")]
    command = [str(GCC), *WARNINGS, "-Wstrict-prototypes", *sources, "-lm", "-o", "example"]
    subprocess.run(command, cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "example"], capture_output=True, text=True, check=True)
    assert "bytes of RAM" in done.stdout
    assert lonely_end(supervisor) in done.stdout


@needs_gcc
def test_nothing_allocates_and_nothing_is_global(tmp_path: Path) -> None:
    compiled(example_supervisor("navigation/navigation"), tmp_path, "-fno-pie", "-no-pie")
    symbols = subprocess.run(["nm", "unit.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    kinds = {line.split()[-1]: line.split()[-2] for line in symbols.splitlines()}
    assert {name for name, kind in kinds.items() if kind == "U"} <= {"memset", "memcpy", "strcmp", "__stack_chk_fail"}
    assert not {name for name, kind in kinds.items() if kind in "bBdDC"}
    assert all(name.startswith("navigation_supervisor_") for name, kind in kinds.items() if kind == "T")


def test_every_file_says_where_it_comes_from() -> None:
    supervisor = example_supervisor("line_follower/line_follower")
    files = generate(supervisor, "c99")
    assert set(files) == {
        "CMakeLists.txt",
        "README.md",
        "line_follower_supervisor.c",
        "line_follower_supervisor.h",
        "main.c",
    }
    for path, text in files.items():
        head = text.splitlines()[:2]
        assert "Generated by RoboSC " in head[0], path
        assert f"Model files SHA-256: {supervisor.certificate.bundle_sha256}" in head[1], path


def test_the_prefix_may_be_chosen() -> None:
    files = generate(example_supervisor("line_follower/line_follower"), "c99", GenerateOptions("my_robot"))
    assert "my_robot_supervisor.c" in files
    assert "my_robot_supervisor_init" in files["my_robot_supervisor.h"]
    with pytest.raises(UnsupportedModelError, match="is not a name for a package"):
        generate(example_supervisor("line_follower/line_follower"), "c99", GenerateOptions("My-Robot"))


def test_what_is_not_done_is_refused() -> None:
    text = """
        robot R { component C {
            outgoing message m with type: string
            behaviour { variable v: string  on response from m do v := value  initial marked state s { } }
        } }
    """
    with pytest.raises(UnsupportedModelError, match=r"received texts that are kept: the variable C\.v takes one"):
        generate(unsupervised(text), "c99")


@needs_gcc
def test_texts_are_as_long_as_compilers_take_them(tmp_path: Path) -> None:
    text = """
        robot R { component C {
            incoming message m with type: string
            behaviour { variable v: string = "%s"  initial marked state s { on request to m } } }
            provide m with "%s"
        }
    """
    compiled(unsupervised(text % ("x" * 4095, "é" * 2047)), tmp_path)
    for variable, provided in (("x" * 4096, "x"), ("x", "x" * 4096), ("é" * 2048, "x")):
        with pytest.raises(UnsupportedModelError, match="does not do texts of more than 4095 bytes"):
            generate(unsupervised(text % (variable, provided)), "c99")


def test_an_expression_too_deep_for_c_is_one_clear_error() -> None:
    for depth in (300, 5000):
        expression: Expression = Binary(">", Received(), Constant(0.0))
        for _ in range(depth):
            expression = Binary("or", Binary("and", expression, Received()), Binary("=", Received(), Constant(True)))
        transition = Transition(None, "m.response", None, (Update("b", expression),), None)
        behaviour = Behaviour((Variable("b", BooleanType(), False, False),), (State("s", True, True),), (transition,))
        message = Communication("m", "C", CommunicationKind.OUTGOING_MESSAGE, "m", response=DoubleType())
        model = Model("Deep", (Component("C", behaviour),), (message,), (), (), (), (), ())
        with pytest.raises(UnsupportedModelError, match="the model Deep has an expression that is nested too deeply"):
            generate(supervisor_of(model), "c99")
