"""Benchmark of the delay from an event in the control loop's thread to the painted frame of the live view.

A robot of sixty components lives through fifty events a second; its live view is served in the same process, as by
`robosc-bridge run`, and shown by a real browser without a window. Both use the same clock. An entry is *seen* when
the frame that shows it has been painted: its row is found by a MutationObserver, and the first task after the next
animation frame is taken for the moment; the time that a screen takes to light up comes on top. The same is measured
for the state shown at a component, where it changes. Browser and server have priority over other programs where that
is permitted.

Usage: live_view_pixels.py [--events N] [--components N] [--rate HZ]
"""

import argparse
import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT / part) for part in (".", "bridge", "proto", "tests", "tests/benchmarks")]

from figures import text_table  # noqa: E402  # found through the path above
from support.browser import CHROMIUM, running_browser, visit  # noqa: E402
from support.live import LiveRobot, large_model, supervisor_without_synthesis, viewed  # noqa: E402
from support.real_time import Lateness, preferred  # noqa: E402

EVENTS, COMPONENTS, RATE_HZ = 500, 60, 50.0
WARM_UP = 50
AIM_MS = 150.0
KEPT_S = 1.0
"""A state that lasts so long is seen at last."""

# Times in the browser: the first paint of each entry's row, and each change of a component's state.
WATCH = """() => {
  window.rowsMs = {};
  window.statesMs = [];
  const painted = (report) => requestAnimationFrame(() => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = () => report(performance.timeOrigin + performance.now());
    port2.postMessage(0);
  });
  new MutationObserver((records) => {
    const numbers = records.flatMap((it) => [...it.addedNodes]).map((it) => it.dataset?.number).filter(Boolean);
    if (numbers.length > 0) painted((ms) => numbers.forEach((number) => { window.rowsMs[number] ??= ms; }));
  }).observe(document.querySelector("#stream-rows"), { childList: true });
  const text = { subtree: true, childList: true, characterData: true };
  for (const [i, state] of document.querySelectorAll(".card-state").entries()) {
    new MutationObserver(() => {
      const text = state.textContent;
      painted((ms) => window.statesMs.push([i, text, ms]));
    }).observe(state, text);
  }
}"""

SHOWN = "(texts) => [...document.querySelectorAll('.card-state')].every((it, i) => it.textContent === texts[i])"
PAINTED = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 0))))"


def table(events: int = EVENTS, components: int = COMPONENTS, rate_hz: float = RATE_HZ) -> str:
    """Return the table of the measurements."""
    if CHROMIUM is None:
        return "From event to pixel: not measured, there is no Chromium on this machine."
    robot = LiveRobot(supervisor_without_synthesis(large_model(components)))
    with preferred(), Lateness() as lateness:
        rows, states = _measured(robot, events, rate_hz)
    title = (
        f"From event to pixel, ms: {components} components, {rate_hz:g} events a second "
        f"(the machine was up to {1000 * lateness.worst_s:.0f} ms late)"
    )
    header = ["what is seen", "count", "p50", "p90", "p99", "max", "aim (p99)"]
    return text_table(title, header, [_row("row of the event stream", rows), _row("state of a component", states)])


def _row(name: str, samples_ms: list[float]) -> list[str]:
    ordered = sorted(samples_ms)
    shares = [ordered[min(int(len(ordered) * share), len(ordered) - 1)] for share in (0.5, 0.9, 0.99)]
    return [name, str(len(ordered)), *(f"{item:.0f}" for item in (*shares, ordered[-1])), f"{AIM_MS:.0f}"]


def _measured(robot: LiveRobot, events: int, rate_hz: float) -> tuple[list[float], list[float]]:
    """Milliseconds until each row, and until each change of state, after the first few."""
    happened_s: dict[int, float] = {}
    changes: list[tuple[float, int, str]] = []
    names = [item.name for item in robot.supervisor.model.components]
    with running_browser() as browser, viewed(robot) as endpoint, visit(browser, endpoint.url) as seen:
        seen.wait("() => document.querySelectorAll('.state.is-active').length > 0")
        seen.page.evaluate(WATCH)
        begin_s = time.monotonic()
        for number in range(1, WARM_UP + events + 1):
            before = _states(robot)
            now_s = time.time()
            robot.step()
            happened_s[number] = now_s
            after = _states(robot)
            changes += [(now_s, i, after[name]) for i, name in enumerate(names) if after[name] != before[name]]
            time.sleep(max(begin_s + number / rate_hz - time.monotonic(), 0.0))
        seen.wait("(last) => window.rowsMs[last] !== undefined", WARM_UP + events)
        seen.wait(SHOWN, [_states(robot)[name] for name in names])
        seen.page.evaluate(PAINTED)
        rows_ms: dict[str, float] = seen.page.evaluate("() => window.rowsMs")
        states_ms: list[tuple[int, str, float]] = seen.page.evaluate("() => window.statesMs")
    measured = {number: at_s for number, at_s in happened_s.items() if number > WARM_UP}
    late = [item for item in changes if item[0] >= measured[WARM_UP + 1]]
    return list(_until_rows(measured, rows_ms)), list(_until_states(late, states_ms))


def _until_rows(happened_s: dict[int, float], rows_ms: dict[str, float]) -> Iterator[float]:
    """Yield the time until each entry is seen, in milliseconds.

    If more entries came within a frame than there is room for, those that have gone by are seen with the next one.
    """
    next_ms = math.inf
    for number, at_s in sorted(happened_s.items(), reverse=True):
        next_ms = min(next_ms, rows_ms.get(str(number), math.inf))
        yield next_ms - 1000 * at_s


def _states(robot: LiveRobot) -> dict[str, str]:
    return {name: part["state"] for name, part in robot.system.state().items()}


def _until_states(changes: list[tuple[float, int, str]], seen: list[tuple[int, str, float]]) -> Iterator[float]:
    """Yield the time until each change of a state is seen, in milliseconds.

    A change that was undone soon, or that undid another one, is left out: maybe no frame came between, and neither
    was seen.
    """
    for number, (at_s, i, state) in enumerate(changes):
        others = (*changes[:number], *changes[number + 1 :])
        if any(j == i and abs(then_s - at_s) < KEPT_S for then_s, j, _ in others):
            continue
        later = [ms for j, text, ms in seen if (j, text) == (i, state) and ms >= 1000 * at_s]
        yield later[0] - 1000 * at_s if later else math.inf


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--events", type=int, default=EVENTS)
    parser.add_argument("--components", type=int, default=COMPONENTS)
    parser.add_argument("--rate", type=float, default=RATE_HZ)
    arguments: Any = parser.parse_args()
    sys.stdout.write(table(arguments.events, arguments.components, arguments.rate) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
