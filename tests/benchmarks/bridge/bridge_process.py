"""A bridge as `robosc-bridge run` makes it, which measures itself: in standby first, then running.

Usage: bridge_process.py MODEL CONFIGURATION STANDBY_S RUNNING_S [WATCHERS [PAGES]]

Watchers take everything that the bridge shows, as soon as there is something new, and put the measurements of each
snapshot into JSON as a remote endpoint would. Pages of the live view are open in processes of their own; what a browser
does with what it receives is no part of them. Without any there is no live view.

Prints one JSON document: by how much each decision was late, overruns, and how much of a processor the process took.
"""

import json
import logging
import subprocess
import sys
import threading
import time
from pathlib import Path

from robosc.execution.runtime.event_log import NullLog
from robosc.execution.runtime.executor import Executor
from robosc.model.structure import Deployment
from robosc_bridge.assembly import Machine, assemble
from robosc_bridge.configuration import load, map_channels
from robosc_bridge.daemon.feed import Feed
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.daemon.supervisors import Source, obtain
from robosc_bridge.daemon.view_settings import ViewSettings
from robosc_view import ViewEndpoint

LIMIT_S = 60.0
SETTLE_S = 1.0


def _watch_decisions(machine: Machine) -> list[float]:
    """Return the list in which the lateness of each decision will be noted, in seconds."""
    found: list[float] = []
    tick = Executor.tick

    def timed(self: Executor) -> None:
        # Only the loop knows its schedule.
        found.append(time.monotonic() - machine.daemon._execution.due_s)
        tick(self)

    Executor.tick = timed  # type: ignore[method-assign]
    return found


class _Watcher:
    """Looks at all that a bridge shows."""

    def __init__(self, feed: Feed) -> None:
        self._woken = threading.Semaphore(0)
        self._subscription = feed.subscribe(self._woken.release)
        self._thread = threading.Thread(target=self._run)
        self._is_over = False
        self.snapshots = 0
        self._thread.start()

    def _run(self) -> None:
        seen = -1
        while True:
            self._woken.acquire()
            if self._is_over:
                return
            snapshot = self._subscription.take().snapshot
            if snapshot is not None and snapshot.number != seen:
                seen = snapshot.number
                self.snapshots += 1
                ranges_m = snapshot.scan.ranges_m if snapshot.scan else ()
                json.dumps((snapshot.number, snapshot.state, snapshot.components, snapshot.enabled, ranges_m))

    def close(self) -> None:
        self._subscription.close()
        self._is_over = True
        self._woken.release()
        self._thread.join()


class _Pages:
    """The live view of a bridge, with so many pages open; without any, there is none."""

    def __init__(self, machine: Machine, count: int) -> None:
        self.messages: list[int] = []
        self._face = ViewEndpoint(machine.operations, ViewSettings("127.0.0.1:0")) if count else None
        self._open: list[subprocess.Popen[str]] = []
        if self._face is not None:
            self._face.start()
            line = [sys.executable, str(Path(__file__).with_name("open_page.py")), self._face.url]
            for _ in range(count):
                self._open.append(subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))

    def close(self) -> None:
        """End them; each prints how many messages it got."""
        for page in self._open:
            self.messages.append(int(page.communicate(timeout=LIMIT_S)[0]))
        if self._face is not None:
            self._face.stop()


def _await(machine: Machine, state: State) -> None:
    end_s = time.monotonic() + LIMIT_S
    while machine.daemon.state is not state:
        if time.monotonic() > end_s:
            raise TimeoutError(f"the bridge is not {state} within {LIMIT_S:g} s: {machine.daemon.state}")
        time.sleep(0.01)
    time.sleep(SETTLE_S)


def _share(seconds: float) -> float:
    """Return the share of a processor that the process takes during the given time."""
    begin_cpu_s, begin_s = time.process_time(), time.monotonic()
    time.sleep(seconds)
    return (time.process_time() - begin_cpu_s) / (time.monotonic() - begin_s)


def main() -> int:
    """Measure."""
    logging.basicConfig(stream=sys.stderr, level=logging.WARNING)
    model, configuration_file = map(Path, sys.argv[1:3])
    standby_s, running_s = map(float, sys.argv[3:5])
    watchers, count = (int(sys.argv[place]) if len(sys.argv) > place else 0 for place in (5, 6))
    loaded = load(configuration_file)
    supervisor = obtain(Source(model, Deployment.CONTROLLER, None, None), lambda text: None)
    mapping = map_channels(supervisor.model, loaded.configuration, loaded.document)
    machine = assemble(loaded.configuration, mapping, supervisor, NullLog(), starts_itself=True)
    noted_s = _watch_decisions(machine)
    # The bridge would start as soon as the devices are there.
    machine.daemon.post(OperatorCommand.STANDBY)
    loop = threading.Thread(target=machine.run)
    loop.start()
    endpoints = [_Watcher(machine.operations.feed) for _ in range(watchers)]
    pages = _Pages(machine, count)
    try:
        _await(machine, State.STANDBY)
        in_standby = _share(standby_s)
        machine.daemon.post(OperatorCommand.START)
        _await(machine, State.RUNNING)
        noted_s.clear()
        overruns = machine.daemon.overruns
        running = _share(running_s)
        late_s = list(noted_s)
        overruns = machine.daemon.overruns - overruns
    finally:
        pages.close()
        machine.quit()
        loop.join()
        for endpoint in endpoints:
            endpoint.close()
    found = {
        "late_s": late_s,
        "overruns": overruns,
        "standby": in_standby,
        "running": running,
        "snapshots": [endpoint.snapshots for endpoint in endpoints],
        "messages": pages.messages,
        "problem": machine.daemon.problem,
    }
    sys.stdout.write(json.dumps(found) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
