"""Asks the model checker spin about Promela models."""

import re
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

IS_INSTALLED = shutil.which("spin") is not None and shutil.which("gcc") is not None
DEPTH = 20_000


@dataclass(frozen=True)
class Answer:
    """Findings of spin.

    Attributes:
        errors: True if it found fault with the model without a property: an assertion.
        states: States that it stored, without a property.
        verdicts: Verdict on each property, by name: True if it holds.
    """

    errors: bool
    states: int
    verdicts: dict[str, bool]


def ask_spin(model: str, properties: Mapping[str, str], folder: Path) -> Answer:
    """Check a model and properties in linear temporal logic.

    Args:
        model: Promela text.
        properties: Formulas by name.
        folder: An empty folder to work in.
    """
    claims = "".join(f"ltl {name} {{ {formula} }}\n" for name, formula in properties.items())
    (folder / "model.pml").write_text(model + claims, encoding="utf-8")
    # Variables that are only written would be left out of the state, but for -o2.
    _run(folder, "spin", "-a", "-o2", "model.pml")
    # Small tables: a hundred runs would otherwise spend their time on clearing memory.
    _run(folder, "gcc", "-O0", "-w", "-DSAFETY", "-DNOCLAIM", "-o", "plain", "pan.c")
    plain = _run(folder, "./plain", f"-m{DEPTH}", "-w16")
    if properties:
        _run(folder, "gcc", "-O0", "-w", "-o", "pan", "pan.c")
    verdicts = {name: not _errors(_run(folder, "./pan", "-a", f"-m{DEPTH}", "-w16", "-N", name)) for name in properties}
    found = re.search(r"(\d+) states, stored", plain)
    assert found, plain
    return Answer(_errors(plain), int(found[1]), verdicts)


def _errors(report: str) -> bool:
    found = re.search(r"errors: (\d+)", report)
    assert found, report
    assert "search depth too small" not in report, report
    return found[1] != "0"


def _run(folder: Path, *command: str) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "rror:" not in done.stdout, done.stdout
    return done.stdout
