"""Synthesis and generation for robots of 100 to 1,000 components: processor time and memory of the whole commands.

Usage: large_robots.py [SIZE...]
"""

import os
import resource
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from figures import text_table

LIMIT_S = 120.0
"""Processor time after which a command is ended; larger robots of its kind are left out then."""

SIZES = (100, 300, 1000)
KINDS = ("pairs", "ring", "hub", "neighbours")
COMMANDS = {
    "synth": ["synth"],
    "synth --modular": ["synth", "--modular"],
    "python": ["generate", "--target", "python", "-o", "out"],
    "c99": ["generate", "--target", "c99", "-o", "out"],
    "ros2": ["generate", "--target", "ros2", "-o", "out"],
}

_COMPONENT = """
    component C{0} {{
        incoming message go{0} with identifier: "/go{0}", type: none
        incoming message back{0} with identifier: "/back{0}", type: none
        outgoing message done{0} with identifier: "/done{0}", type: none
        behaviour {{
            initial marked state idle {{ on request to go{0} goto busy }}
            state busy {{ on response from done{0} goto out }}
            state out {{ on request to back{0} goto idle }}
        }}
    }}
"""


def robot(kind: str, size: int) -> str:
    """The model of a robot of some components, which each go out and come back.

    Args:
        kind: `pairs`: two and two are never both out; `ring`: each goes while the next one is idle; `hub`: all go while
            the first one is out; `neighbours`: no two that follow each other are both out.
        size: Number of components.
    """
    components = "".join(_COMPONENT.format(number) for number in range(size))
    return f"robot Large {{{components}{''.join(_requirements(kind, size))}}}"


def _requirements(kind: str, size: int) -> Iterator[str]:
    match kind:
        case "ring":
            for number in range(size):
                yield f"requirement go{number} needs C{(number + 1) % size}.idle\n"
        case "hub":
            for number in range(1, size):
                yield f"requirement go{number} needs C0.out\n"
        case _:
            for number in range(0, size - 1, 2 if kind == "pairs" else 1):
                yield f"requirement never C{number}.out and C{number + 1}.out\n"


def _run(arguments: list[str], folder: Path) -> str:
    """Processor time and memory of a command, or why there are none."""
    command = [sys.executable, "-m", "robosc.cli.main", *arguments]
    process = os.fork()
    if process == 0:
        os.chdir(folder)
        limit = int(LIMIT_S)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 1)
        os.dup2(null, 2)
        os.execv(sys.executable, command)
    _, status, used = os.wait4(process, 0)
    if status:
        return "-"
    return f"{used.ru_utime + used.ru_stime:.1f} s, {used.ru_maxrss // 1024} MB"


def table(sizes: tuple[int, ...] = SIZES) -> str:
    """A row for each kind and size."""
    rows = []
    for kind in KINDS:
        lost: set[str] = set()
        for size in sizes:
            with tempfile.TemporaryDirectory() as name:
                (Path(name) / "large.rscd").write_text(robot(kind, size), encoding="utf-8")
                row = [kind, str(size)]
                for command, (verb, *options) in COMMANDS.items():
                    found = "-" if command in lost else _run([verb, "large.rscd", *options], Path(name))
                    if found == "-":
                        lost.add(command)
                    row.append(found)
            rows.append(row)
    title = f"Robots of many components: processor time and memory of whole commands ('-': more than {LIMIT_S:.0f} s)"
    return text_table(title, ["kind", "components", *COMMANDS], rows)


if __name__ == "__main__":
    sys.stdout.write(table(tuple(map(int, sys.argv[1:])) or SIZES) + "\n")
