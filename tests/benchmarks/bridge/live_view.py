"""Benchmark of the delay until the live view reports an event, and of the share of a processor that it takes.

A robot of many components lives in a process of its own, with events at a steady rate, behind the live view of a
bridge; pages are open in another process. *Late*: from the event to the WebSocket message with it, on one clock.
*Update*: the same to the first update that was made after the event. *CPU*: user and system time of the robot's
process, with and without pages, over the time that passed; the share of the pages is the difference.

Usage: live_view.py [SECONDS]
"""

import argparse
import asyncio
import contextlib
import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "benchmarks")]

import aiohttp  # noqa: E402

from figures import text_table  # noqa: E402  # found through the path above

SECONDS = 10.0
ENVIRONMENT = {
    **os.environ,
    "PYTHONPATH": os.pathsep.join(map(str, (ROOT, *(ROOT / name for name in ("bridge", "proto", "client", "tests"))))),
}
CASES = ((60, 50.0, 0), (60, 50.0, 1), (60, 50.0, 4), (60, 200.0, 1))
"""Components, events a second, pages."""

HEADER = [
    "components, events/s, pages",
    "events",
    "missed",
    "late p50, ms",
    "p99, ms",
    "max, ms",
    "update p50, ms",
    "CPU",
]


@dataclass
class Seen:
    """Data that a page received.

    Attributes:
        late_s: Delay of each event, in seconds.
        update_s: Time from each event until an update that was made after it, in seconds.
        numbers: Numbers of the entries.
    """

    late_s: list[float] = field(default_factory=list)
    update_s: list[float] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)


async def look(url: str, until_s: float, seen: Seen) -> None:
    """Open a page, and take the time of all that comes."""
    base = url.partition("/?")[0]
    waiting: list[float] = []
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(f"{base}/stream", headers={"Origin": base}, max_msg_size=2**26) as page,
    ):
        while (left_s := until_s - time.monotonic()) > 0:
            with contextlib.suppress(TimeoutError):
                message = await page.receive(left_s)
                if message.type is not aiohttp.WSMsgType.TEXT:
                    return
                now_s = time.time()
                content = json.loads(message.data)
                if content["type"] == "events":
                    for entry in content["entries"]:
                        seen.late_s.append(now_s - entry["time_s"])
                        seen.numbers.append(entry["number"])
                        waiting.append(entry["time_s"])
                elif content["type"] == "update":
                    seen.update_s += [now_s - time_s for time_s in waiting if time_s <= content["time_s"]]
                    waiting = [time_s for time_s in waiting if time_s > content["time_s"]]


def cpu_s(process: int) -> float:
    """User and system time that a process has taken (proc(5), /proc/pid/stat)."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100.0


def measured(components: int, rate_hz: float, pages: int, seconds: float) -> list[str]:
    """One row."""
    command = [sys.executable, "-m", "support.live", "--address", "127.0.0.1:0"]
    command += ["--components", str(components), "--rate", str(rate_hz)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT, env=ENVIRONMENT) as robot:
        try:
            assert robot.stdout is not None
            url = robot.stdout.readline().strip()
            seen = [Seen() for _ in range(pages)]
            begin_s, before_s = time.monotonic(), cpu_s(robot.pid)

            async def look_all() -> None:
                until_s = begin_s + seconds
                await asyncio.gather(*(look(url, until_s, item) for item in seen))
                await asyncio.sleep(until_s - time.monotonic())

            asyncio.run(look_all())
            share = (cpu_s(robot.pid) - before_s) / (time.monotonic() - begin_s)
        finally:
            robot.kill()
    late = sorted(value * 1e3 for item in seen for value in item.late_s)
    update = sorted(value * 1e3 for item in seen for value in item.update_s)
    missed = sum(item.numbers[-1] - item.numbers[0] + 1 - len(item.numbers) for item in seen if item.numbers)
    return [
        f"{components}, {rate_hz:g}, {pages}",
        str(len(late)),
        str(missed),
        *(_at(late, share_) for share_ in (0.5, 0.99, 1.0)),
        _at(update, 0.5),
        f"{100 * share:.0f} %",
    ]


def _at(values: list[float], share: float) -> str:
    return f"{values[min(int(share * len(values)), len(values) - 1)]:.1f}" if values else "-"


def table(seconds: float = SECONDS) -> str:
    """Figures of all cases."""
    rows = [measured(*case, seconds) for case in CASES]
    return text_table(f"Live view, {seconds:g} s each", HEADER, rows)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seconds", nargs="?", type=float, default=SECONDS)
    sys.stdout.write(table(parser.parse_args().seconds) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
