"""Puts small faults into the code, one at a time, and prints which of them the tests find.

    python soak/faults.py --number 50 --seed 1
    python soak/faults.py --number 0 --only bridge/robosc_bridge/safety

A fault is a change that mutmut makes in one place: another operator, constant, argument or branch. `--number`
functions are drawn by `--seed`, and of each of them one change; 0 takes every change. A first run of all tests notes
which of them enter these functions, in programs that they start too, and only those run for a change: first some at
random, then the rest, until one fails. The code is changed in a copy, so that nothing is left behind. `--save` writes
the changes down and `--load` takes them again, for instance for the tests of another revision, where a function that
reads otherwise is left out.

Exit status: 0 at least `--wanted` percent are found, 1 fewer, 2 wrong use or tests that fail without a change.
"""

import argparse
import ast
import json
import os
import random
import shutil
import signal
import subprocess
import sys
from collections.abc import Collection, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("robosc", "server/robosc_server", "client/robosc_client", "bridge")
LEFT_OUT = (".git", ".venv*", "out", "node_modules", "__pycache__", ".*_cache", ".hypothesis", "build", "dist")

FIRST = 150
"""Tests that run before all others that enter a function: most faults are found by any of them."""

LIMIT_S = 1800
"""Time for the tests of a fault; one that makes them hang is found as well."""

USAGE_ERROR, NO_TESTS = 4, 5
"""Exit statuses of pytest."""

NOTING = '''
"""Notes which tests enter which functions: the start of every Python program below a run of `soak/faults.py`."""

import contextlib
import json
import os
import sys

_functions = {(file, name) for file, name in json.loads(FUNCTIONS)}
_seen = set()


def _enters(code, _offset):
    file = code.co_filename
    key = (file[len(ROOT):], code.co_qualname) if file.startswith(ROOT) else None
    if key not in _functions:
        return sys.monitoring.DISABLE
    # A program that a test starts inherits its name.
    test = os.environ.get("PYTEST_CURRENT_TEST", "").rsplit(" ", 1)[0]
    if test and (test, key) not in _seen:
        _seen.add((test, key))
        # A process that is confined may write nothing.
        with contextlib.suppress(OSError), open(f"{NOTES}/{os.getpid()}", "a") as notes:
            notes.write(json.dumps([test, *key]) + "\\n")
    return None


sys.monitoring.use_tool_id(4, "faults")
sys.monitoring.register_callback(4, sys.monitoring.events.PY_START, _enters)
sys.monitoring.set_events(4, sys.monitoring.events.PY_START)
'''


@dataclass(frozen=True)
class Mutant:
    """One change: `before` of `file` reads `after`; both are the text of the whole function `function`."""

    file: str
    function: str
    before: str
    after: str

    def diff(self) -> str:
        """Return the lines that differ."""
        before, after = self.before.splitlines(), self.after.splitlines()
        gone = [f"- {line.strip()}" for line in before if line not in after]
        come = [f"+ {line.strip()}" for line in after if line not in before]
        return "\n".join(gone + come)


def functions_of(file: Path) -> Iterator[str]:
    """Yield the functions and methods of a file."""
    for statement in ast.parse(file.read_text()).body:
        if isinstance(statement, ast.FunctionDef):
            yield statement.name
        elif isinstance(statement, ast.ClassDef):
            yield from (f"{statement.name}.{part.name}" for part in statement.body if isinstance(part, ast.FunctionDef))


def mutants_of(root: Path, file: Path, wanted: Collection[str]) -> Iterator[Mutant]:
    """Yield all changes of functions and methods of a file."""
    # They stand in the folder of tools alone.
    import libcst as cst
    from mutmut.mutation.file_mutation import create_mutations, deep_replace

    module, mutations, *_ = create_mutations(str(file), file.read_text())
    names = {}
    for statement in module.body:
        if isinstance(statement, cst.FunctionDef):
            names[statement] = statement.name.value
        elif isinstance(statement, cst.ClassDef):
            for part in statement.body.body:
                if isinstance(part, cst.FunctionDef):
                    names[part] = f"{statement.name.value}.{part.name.value}"
    for mutation in mutations:
        function = mutation.contained_by_top_level_function
        if names.get(function) not in wanted:
            continue
        changed = deep_replace(function, mutation.original_node, mutation.mutated_node)
        before, after = (module.code_for_node(function), module.code_for_node(changed))
        if before != after and module.code.count(before) == 1:
            yield Mutant(str(file.relative_to(root)), names[function], before, after)


def drawn(root: Path, only: Sequence[str], number: int, seed: int) -> list[Mutant]:
    """Return one change of each of `number` functions, or every change for 0."""
    files = sorted(
        file for path in only for file in ([root / path] if path.endswith(".py") else (root / path).rglob("*.py"))
    )
    if not number:
        return [mutant for file in files for mutant in mutants_of(root, file, set(functions_of(file)))]
    chance = random.Random(seed)
    functions = [(file, name) for file in files for name in functions_of(file)]
    chance.shuffle(functions)
    found: list[Mutant] = []
    for file, name in functions:
        # Some have nothing that could be changed.
        if len(found) < number and (mutants := list(mutants_of(root, file, {name}))):
            found.append(chance.choice(mutants))
    return found


class Trial:
    """A copy of the project in which its tests run."""

    def __init__(self, root: Path, tests: Sequence[str], workers: int, python: str) -> None:
        self.tests = tests
        self.workers = workers
        self.python = python
        self.copy = ROOT / "out" / "faults"
        shutil.rmtree(self.copy, ignore_errors=True)
        shutil.copytree(root, self.copy, ignore=shutil.ignore_patterns(*LEFT_OUT), symlinks=True)
        # The tests look for some of what is made once.
        for made in ("tests/node/node_modules", "editors/vscode/node_modules", ".venv"):
            if (root / made).exists():
                (self.copy / made).symlink_to(root / made)

    def environment(self, site: Path | None) -> dict[str, str]:
        paths = [self.copy, *(self.copy / name for name in ("proto", "server", "client", "bridge", "editors"))]
        paths.append(self.copy / "examples" / "robosc_examples")
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        return environment | {"PYTHONPATH": os.pathsep.join(map(str, [site, *paths] if site else paths))}

    def run(self, tests: Sequence[str], words: Sequence[str] = (), site: Path | None = None) -> tuple[int, str]:
        """Run tests; return pytest's exit status and what it printed.

        Args:
            tests: Names of tests, or their folders.
            words: Further words for pytest.
            site: Folder whose `sitecustomize.py` each Python program begins with.
        """
        chosen = self.copy / "out" / "chosen.txt"
        chosen.parent.mkdir(exist_ok=True)
        chosen.write_text("\n".join(tests) + "\n")
        program = subprocess.Popen(
            [
                *(self.python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--tb", "line"),
                *("-n", str(self.workers), "--dist", "worksteal", *words, f"@{chosen}"),
            ],
            cwd=self.copy,
            env=self.environment(site),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        try:
            output, _ = program.communicate(timeout=LIMIT_S)
        except subprocess.TimeoutExpired:
            os.killpg(program.pid, signal.SIGKILL)
            return 1, "FAILED (the tests hung)"
        return program.returncode, output

    def reach(self, mutants: Sequence[Mutant]) -> tuple[int, str, dict[tuple[str, str], set[str]]]:
        """Run all tests; return pytest's exit status, what it printed, and the tests that enter each function."""
        notes, site = self.copy / "out" / "notes", self.copy / "out" / "site"
        for folder in (notes, site):
            folder.mkdir(parents=True, exist_ok=True)
        functions = sorted({(mutant.file, mutant.function) for mutant in mutants})
        # Not in the environment: some tests give their programs another one.
        given = {"FUNCTIONS": json.dumps(functions), "ROOT": f"{self.copy}/", "NOTES": str(notes)}
        values = "".join(f"{name} = {value!r}\n" for name, value in given.items())
        (site / "sitecustomize.py").write_text(values + NOTING)
        status, output = self.run(self.tests, site=site)
        reached: dict[tuple[str, str], set[str]] = {function: set() for function in functions}
        for file in notes.iterdir():
            for line in file.read_text().splitlines():
                test, path, name = json.loads(line)
                reached[path, name].add(test)
        return status, output, reached

    def finds(self, mutant: Mutant, tests: set[str]) -> str:
        """Return the test that finds a change, or an empty text."""
        file = self.copy / mutant.file
        whole = file.read_text()
        file.write_text(whole.replace(mutant.before, mutant.after))
        try:
            ordered = sorted(tests)
            random.Random(0).shuffle(ordered)
            for part in (ordered[:FIRST], ordered[FIRST:]):
                status, output = self.run(part, ["-x"]) if part else (0, "")
                if status == USAGE_ERROR:
                    raise RuntimeError(f"pytest does not take the tests that it has run before:\n{output}")
                if status not in {0, NO_TESTS}:
                    failed = [line for line in output.splitlines() if line.startswith(("FAILED", "ERROR"))]
                    return failed[0] if failed else (output.splitlines() or ["ended"])[-1]
        finally:
            file.write_text(whole)
        return ""


def main(words: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=50, help="functions that are changed, 0: every change (50)")
    parser.add_argument("--seed", type=int, default=1, help="seed of functions and changes (1)")
    parser.add_argument("--only", nargs="+", default=PACKAGES, metavar="PATH", help="folders or files of the project")
    parser.add_argument("--tests", nargs="+", default=["tests"], help="tests that pytest runs (tests)")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="tests at a time")
    parser.add_argument("--wanted", type=float, default=0, help="percent to be found for exit status 0 (0)")
    parser.add_argument("--root", type=Path, default=ROOT, help="project that is tried (this one)")
    parser.add_argument("--python", default=sys.executable, help="interpreter of the tests (this one)")
    parser.add_argument("--save", type=Path, metavar="FILE", help="write the changes as JSON before they are tried")
    parser.add_argument("--load", type=Path, metavar="FILE", help="try these changes")
    parser.add_argument("--json", action="store_true", help="print the outcome as JSON")
    choice = parser.parse_args(words)
    root = choice.root.resolve()
    missing = [path for path in choice.only if not (root / path).exists()]
    if missing:
        parser.error(f"{missing[0]} is not in {root}: name folders or files of the project")
    try:
        mutants = (
            [Mutant(**entry) for entry in json.loads(choice.load.read_text())]
            if choice.load
            else drawn(root, choice.only, choice.number, choice.seed)
        )
    except ImportError:
        parser.error("mutmut is not installed: start this by `make faults`")
    if choice.save:
        choice.save.write_text(json.dumps([asdict(mutant) for mutant in mutants], indent=1))
    mutants = [mutant for mutant in mutants if (root / mutant.file).exists()]
    mutants = [mutant for mutant in mutants if (root / mutant.file).read_text().count(mutant.before) == 1]

    trial = Trial(root, choice.tests, choice.workers, choice.python)
    status, output, reached = trial.reach(mutants)
    print("\n".join(output.splitlines()[-20:]), file=sys.stderr)
    if status:
        print("Tests fail without a change: fix them first.", file=sys.stderr)
        return 2
    outcome: list[dict[str, Any]] = []
    for mutant in mutants:
        tests = reached[mutant.file, mutant.function]
        found = trial.finds(mutant, tests)
        outcome.append(asdict(mutant) | {"tests": len(tests), "found": found})
        if not choice.json:
            print(
                f"{'found' if found else 'MISSED'}  {mutant.file}:{mutant.function}  {len(tests)} tests  {found[:100]}"
            )
            print("\n".join(f"        {line}" for line in mutant.diff().splitlines()), flush=True)
    count = sum(1 for entry in outcome if entry["found"])
    percent = 100 * count / len(outcome) if outcome else 100.0
    print(json.dumps(outcome, indent=1) if choice.json else f"{count} of {len(outcome)} changes found: {percent:.0f} %")
    return 0 if percent >= choice.wanted else 1


if __name__ == "__main__":
    sys.exit(main())
