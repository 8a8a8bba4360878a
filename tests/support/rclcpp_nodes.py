"""Generated rclcpp nodes on a stand-in for the middleware: compiled with the real messages, driven line by line."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from robosc.certification import make_supervisor
from robosc.supervisor import Supervisor
from robosc.targets import GenerateOptions, StateMessage, generate, write_files
from support.message_headers import missing_generator, write_headers
from support.models import bundle_of
from support.shared import shared

COURIER = Path(__file__).parents[1] / "models" / "courier" / "model.rscd"
STAND_IN = Path(__file__).with_name("rclcpp_stand_in")
WARNINGS = "-Wall -Wextra -Wpedantic -Werror".split()
SANITIZERS = "-g1 -fsanitize=address,undefined -fno-sanitize-recover=all".split()
LIMIT_S = 60.0
PROGRAM = "controller"
RECORDED_RUN = "test/test_recorded_run.cpp"

_HOSTILE = r"""
robot None {
    datatype object int { x: double }
    datatype enum goto_ from string to { value = "*/ \" ' \\ ??/ %d </name>" -> break default -> auto }
    interface i use Vector3 from geometry_msgs
    component namespace {
        incoming message delete with identifier: "/a", type: string
        incoming message new with identifier: "/b", type: int links i
        outgoing message template with identifier: "/c", type: goto_
        outgoing message LONG with identifier: "/d", type: boolean
        behaviour {
            variable class: goto_ = auto
            variable robot_t: integer
            variable this: string = "\"; system(\"x\"); // \\ ' ??/\n%s é"
            on response from template do class := value
            on response from LONG do robot_t := 7
            initial marked state std { on request to delete on request to new }
        }
    }
    requirement delete needs namespace.class = break
    provide delete with "\"; import os; */ %s ??/ \\ é"
    provide new with { x: -0.5 }
}
""".replace("LONG", "n" * 150)
"""Names and texts chosen to break C and C++."""


def missing(*packages: str) -> str | None:
    """Name the parts missing to compile such nodes with the messages of some packages, as a reason to skip."""
    lacking = [name for name in ("gcc", "g++") if shutil.which(name) is None]
    include = Path(sys.prefix) / "include"
    lacking += [
        f"the C++ messages of {name}"
        for name in ("rcl_interfaces", "action_msgs", "diagnostic_msgs", "std_msgs", *packages)
        if not (include / name).is_dir()
    ]
    return f"not installed: {', '.join(lacking)}" if lacking else missing_generator()


def compiled(
    supervisor: Supervisor, folder: Path, *options: str, state_message: StateMessage = StateMessage.BOTH
) -> Path:
    """The program of a node, compiled without a warning; it publishes its state in either form unless it is to be JSON.

    The form is that of the parameter file, which such a program is not given: JSON if no parameter says otherwise.
    """
    write_files(generate(supervisor, "ros2-cpp", GenerateOptions(state_message=state_message)), folder)
    source = folder / "src"
    (engine,) = source.glob("*_supervisor.c")
    packages = sorted((Path(sys.prefix) / "include").iterdir())
    if state_message != StateMessage.JSON:
        packages.append(folder / "headers")
        packages[-1].mkdir()
        write_headers("robosc_msgs", generate(supervisor, "ros2-msgs"), packages[-1])
    includes = [word for path in packages if path.is_dir() for word in ("-isystem", str(path))]
    program = folder / PROGRAM
    sources = ("main.cpp", "node.cpp")
    both = [*WARNINGS, *options, "-ffp-contract=off"]
    for command in (
        ["gcc", "-std=c99", *both, "-c", engine.name, "-o", "engine.o"],
        [
            "g++",
            "-std=c++17",
            *both,
            "-I.",
            f"-I{STAND_IN}",
            *includes,
            *sources,
            "engine.o",
            "-pthread",
            "-o",
            str(program),
        ],
    ):
        done = subprocess.run(command, cwd=source, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[:6000]
    return program


def compiled_test(supervisor: Supervisor, folder: Path) -> Path:
    """The program of a package's own test, compiled without a warning; `folder` may hold the package already."""
    if not folder.exists():
        write_files(generate(supervisor, "ros2-cpp"), folder)
    (engine,) = (folder / "src").glob("*_supervisor.c")
    program = folder / "recorded_run"
    both = [*WARNINGS, "-ffp-contract=off"]
    for command in (
        ["gcc", "-std=c99", *both, "-c", str(engine), "-o", "engine_of_test.o"],
        ["g++", "-std=c++17", *both, "-Isrc", f"-I{STAND_IN}", RECORDED_RUN, "engine_of_test.o", "-o", str(program)],
    ):
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[:6000]
    return program


def compiled_once(supervisor: Supervisor, factory: pytest.TempPathFactory, *options: str) -> Path:
    """The same program for all tests of a run, which compile a robot with the same options."""
    name = f"ros2_cpp_{supervisor.model.name}_{supervisor.deployment}"
    folder = shared(factory, name, lambda folder: compiled(supervisor, folder, *options))
    return folder / PROGRAM


def courier() -> Supervisor:
    """The courier, which has every kind of server, with no variable of type string: in C none takes a received text."""
    text = COURIER.read_text(encoding="utf-8")
    text = text.replace("variable text: string", "").replace("do text := value.^message ", "")
    made = make_supervisor(bundle_of(text))
    assert made.supervisor is not None, made.reason
    return made.supervisor


def hostile() -> Supervisor:
    """The robot with names and texts that were chosen to break C and C++."""
    made = make_supervisor(bundle_of(_HOSTILE))
    assert made.supervisor is not None, made.reason
    return made.supervisor


def run(
    program: Path,
    lines: Sequence[str],
    *parameters: str,
    namespace: str = "/",
    level: str = "warn",
    middleware: str = "rmw_fastrtps_cpp",
) -> subprocess.CompletedProcess[str]:
    """Run a node on what happens to it, with parameters such as `period:=0.02`; the last line is to end it."""
    arguments = [word for parameter in parameters for word in ("-p", parameter)]
    arguments += ["-r", f"__ns:={namespace}", "--log-level", level]
    return subprocess.run(
        [str(program), "--ros-args", *arguments],
        input="".join(f"{line}\n" for line in lines),
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        env={"PATH": os.environ["PATH"], "RMW_IMPLEMENTATION": middleware},
        check=False,
    )


def sent(output: str, but: str = "/diagnostics") -> list[tuple[str, str, str]]:
    """Return the outputs of a node, except those of one topic: word (publish, call, goal, cancel), name, and data."""
    found = [re.fullmatch(r"(\w+) (\S+) (.*)", line) for line in output.splitlines()]
    assert all(found), output
    return [(match[1], match[2], match[3]) for match in found if match and match[2] != but]
