"""The bar that moves on a terminal."""

import io
from typing import Any

import pytest
import rich.progress

from robosc_client.commands.progress_line import ProgressLine
from robosc_client.results import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def bars(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The bars that there are."""
    made: list[Any] = []
    start = rich.progress.Progress.start

    def noted(bar: rich.progress.Progress) -> None:
        made.append(bar)
        start(bar)

    monkeypatch.setattr(rich.progress.Progress, "start", noted)
    return made


def test_the_bar_goes_on_with_the_stages(bars: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr", Terminal())
    seen: list[tuple[float, float | None]] = []
    with ProgressLine() as line:
        (task,) = bars[0].tasks
        # The total is not known yet.
        assert task.total is None
        for stage in ("check", "synthesis", "synthesis", "verification", "controller", "generation"):
            line.report(Progress(stage, "[bold]words"))
            seen.append((task.completed, task.total))
            assert task.description == f"{stage}: [bold]words"
    assert seen == [(0, 4), (1, 4), (1, 4), (2, 4), (3, 4), (4, 4)]


def test_what_has_no_known_stages_moves_to_and_fro(bars: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr", Terminal())
    with ProgressLine() as line:
        line.show("64 callers")
        line.report(Progress("waiting", "for a quota"))
        assert bars[0].tasks[0].total is None


def test_there_is_none_without_a_terminal(bars: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr", io.StringIO())
    with ProgressLine() as line:
        line.show("words")
    assert bars == []
