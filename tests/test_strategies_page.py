"""The page about goals: its robots do what it says, and its findings are those that there are."""

import re
from pathlib import Path

from robosc.certification import make_supervisor
from robosc.diagnostics import codes
from robosc.errors import Severity
from robosc.execution.interpreter import InterpretedSystem
from support.execution import Bench
from support.goal_porter import LOOP, PAGE, PORTER
from support.models import bundle_of
from support.tutorial import play_page

DOOR = "    assume Door.opening leads to Door.ajar\n"


def bench_of(text: str) -> Bench:
    """An executor of a model, which decides as the settings' defaults say."""
    made = make_supervisor(bundle_of(text))
    assert made.supervisor is not None, made.diagnostics
    assert {item.severity for item in made.diagnostics} <= {Severity.NOTE}
    return Bench(InterpretedSystem(made.supervisor))


def errors(text: str) -> list[str]:
    made = make_supervisor(bundle_of(text))
    assert made.supervisor is None
    return [item.code for item in made.diagnostics if item.severity is Severity.ERROR]


def sent(bench: Bench, periods: int = 6) -> list[str]:
    """Messages that are published in some periods."""
    before = len(bench.middleware.sent)
    for _ in range(periods):
        bench.executor.tick()
    return [name for kind, name, *_ in bench.middleware.sent[before:] if kind == "publish"]


def test_what_is_typed_prints_what_the_page_says(tmp_path: Path) -> None:
    assert play_page(PAGE, tmp_path) > 0


def test_the_first_robot_does_everything() -> None:
    bench = bench_of(LOOP)
    done: list[str] = []
    for _ in range(20):
        done += sent(bench, 1)
        if done[-1] in ("open", "close"):
            bench.executor.receive("/door/opened" if done[-1] == "open" else "/door/closed", None)
    assert done[2:18] == ["open", "enter", "leave", "close"] * 4


def test_the_porter_answers_calls_and_waits_outside() -> None:
    bench = bench_of(PORTER)
    assert sent(bench) == []
    bench.executor.receive("/call", None)
    assert sent(bench) == ["open"]
    bench.executor.receive("/door/opened", None)
    assert sent(bench) == ["enter", "leave", "close"]
    bench.executor.receive("/door/closed", None)
    assert sent(bench) == []


def test_a_broken_assumption_makes_it_wait_and_a_late_door_lets_it_go_on() -> None:
    bench = bench_of(PORTER)
    bench.executor.receive("/call", None)
    assert sent(bench, 200) == ["open"]
    bench.executor.receive("/door/opened", None)
    assert sent(bench) == ["enter", "leave", "close"]


def test_the_findings_that_it_speaks_of_come_as_it_says() -> None:
    without = "".join(line for line in PORTER.splitlines(keepends=True) if "assume" not in line)
    assert errors(without) == ["unreachable-goal"]
    assert errors(PORTER.replace(DOOR, "    assume always eventually Door.ajar\n")) == ["preventable-assumption"]
    listed = set(re.findall(r"^\| \[`([a-z-]+)`\]", PAGE, flags=re.MULTILINE))
    assert listed == {code for code in codes() if re.search("goal|assumption|^visit", code)} - {"goal-in-library"}
