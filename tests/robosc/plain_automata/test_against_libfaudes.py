"""Supervisors of random plain automata: those of libFAUDES have the same language; where we have none it has none."""

import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

import robosc
from robosc.automata import System
from robosc.exploration import graph_automaton
from robosc.pipeline.exploring import graph_of
from robosc.plain_automata import write_gen
from support.effort import examples
from support.random_plain import random_plain

PEER = Path(__file__).parents[2] / "support" / "faudes_peer.py"
VERDICTS = {"same", "other", "neither", "only ours", "only theirs"}


def write_problem(made: System, folder: Path) -> None:
    """Write the automata, and what the supervisor leaves of them."""
    folder.mkdir()
    for name, automaton in zip(("plant", "other", "requirement"), made.automata, strict=True):
        (folder / f"{name}.gen").write_text(write_gen(replace(made, automata=(automaton,))))
    supervisor = robosc.synthesize(made).supervisor
    if supervisor is not None:
        controlled = graph_automaton(graph_of(supervisor, limit=10_000), made)
        (folder / "supervisor.gen").write_text(write_gen(controlled))


@pytest.mark.random
def test_supervisors_are_those_of_libfaudes(tmp_path: Path) -> None:
    folders = [tmp_path / str(seed) for seed in range(examples(60))]
    for seed, folder in enumerate(folders):
        write_problem(random_plain(Random(seed)), folder)
    asked = "".join(f"{folder}\n" for folder in folders)
    done = subprocess.run([sys.executable, str(PEER)], input=asked, capture_output=True, text=True, check=True)
    # It also prints which libraries it would draw with.
    verdicts = [line for line in done.stdout.splitlines() if line in VERDICTS]
    assert len(verdicts) == len(folders), done.stdout + done.stderr
    differing = [
        folder.name for folder, verdict in zip(folders, verdicts, strict=True) if verdict not in ("same", "neither")
    ]
    assert differing == []
    assert min(Counter(verdicts).values()) > len(folders) // 10
