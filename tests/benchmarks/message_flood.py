"""A generated ROS 2 node under 1,000 messages a second on one topic: what is lost, what it takes, how long it waits.

Usage: message_flood.py [SECONDS [DEPTH [period|event]]]

The line follower is sent corrections that are numbers one after the other; each that it takes stands in its event log.
DEPTH is how many messages the topic's queue holds; the model's own 10 would be a hundredth of a second. With `event`,
the node also decides and publishes at each message, 1,000 times a second.
"""

import json
import signal
import statistics
import sys
import tempfile
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from robosc.certification import make_supervisor
from robosc.targets import generate, write_files
from support.models import EXAMPLES, bundle_of
from support.ros2 import Peer, RosProcess, environment, own_domain

RATE_HZ = 1000
SECONDS = 60.0
DEPTH = 1000
LIMIT_S = 20.0
_WARM_UP = 2000
_POLL_S = 0.02
_TAIL = 20_000
_CORRECTION = 'identifier: "/line/correction", type: double'


@dataclass(frozen=True)
class Soak:
    """Results of the measurement.

    Attributes:
        sent: Messages that were sent.
        received: Number of them that stand in the node's event log.
        dropped: Entries that the log lost.
        resident_kb: Memory of the node in kB, after a warm-up and at the end.
        cpu_s: Time of a processor that it took in between, in seconds.
        latencies_s: Times from sending a message to the entry in the log, in seconds.
        seconds: Duration of sending them, in seconds.
    """

    sent: int
    received: int
    dropped: int
    resident_kb: tuple[int, int]
    cpu_s: float
    latencies_s: list[float]
    seconds: float

    def __str__(self) -> str:
        centiles = statistics.quantiles(self.latencies_s, n=1000)
        begin, end = self.resident_kb
        return "\n".join(
            [
                f"sent {self.sent} in {self.seconds:.1f} s ({self.sent / self.seconds:.0f}/s), "
                f"received {self.received}, lost {self.sent - self.received}",
                f"event log: {self.dropped} entries lost",
                f"resident memory: {begin} kB after the warm-up, {end} kB at the end, {end - begin:+d} kB",
                f"processor: {self.cpu_s / self.sent * 1e6:.0f} us a message",
                "latency in ms: "
                + ", ".join(f"p{n / 10:g} {centiles[n - 1] * 1e3:.2f}" for n in (500, 900, 990, 999))
                + f", max {max(self.latencies_s) * 1e3:.2f}",
            ]
        )


class _Driver:
    """Sends numbers at a rate, and waits until the node has taken them."""

    def __init__(self, peer: Peer, node: RosProcess, log: Path, depth: int) -> None:
        from std_msgs.msg import Float32

        self._node = node
        self._log = log
        self._message = Float32()
        self._publisher = peer.publisher(Float32, "/line/correction", depth)
        self.sent_s: dict[int, float] = {}

    def send(self, first: int, count: int) -> float:
        """Send numbers, and wait for the last one: how long sending took."""
        began = time.monotonic()
        for number in range(first, first + count):
            left = began + (number - first) / RATE_HZ - time.monotonic()
            if left > 0.0:
                time.sleep(left)
            self._message.data = float(number)
            self.sent_s[number] = time.time()
            self._publisher.publish(self._message)
        took = time.monotonic() - began
        deadline = time.monotonic() + LIMIT_S
        last = f'"value":{float(first + count - 1)}}}'
        while last not in self._end_of_log() and time.monotonic() < deadline and self._node.is_running:
            time.sleep(_POLL_S)
        return took

    def _end_of_log(self) -> str:
        with self._log.open("rb") as log:
            log.seek(max(0, self._log.stat().st_size - _TAIL))
            return log.read().decode(errors="replace")

    def received(self) -> tuple[dict[int, float], int]:
        """Return the time at which each number was taken and the count of lost log entries, after the node's end."""
        entries = [json.loads(line) for line in self._log.read_text(encoding="utf-8").splitlines()]
        taken = {
            int(entry["data"]["value"]): float(entry["time"])
            for entry in entries
            if entry.get("event") == "correction.response"
        }
        return taken, sum(entry["count"] for entry in entries if entry["kind"] == "dropped")


def soak(seconds: float, depth: int = DEPTH, every: str = "period") -> Soak:
    """Measure a node while messages are sent to it.

    Args:
        seconds: Duration of sending, in seconds.
        depth: Messages that the topic's queue holds.
        every: Occasion at which the node decides.
    """
    text = (EXAMPLES / "line_follower" / "line_follower.rscd").read_text(encoding="utf-8")
    made = make_supervisor(bundle_of(text.replace(_CORRECTION, f"{_CORRECTION}, depth: {depth}"))).supervisor
    assert made is not None
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        write_files(generate(made, "ros2"), folder / "package")
        domain = stack.enter_context(own_domain())
        variables = environment(domain, folder)
        peer = stack.enter_context(Peer(domain, variables))
        parameters = (f"every:={every}", f"log_folder:={folder / 'events'}")
        arguments = [item for parameter in parameters for item in ("-p", parameter)]
        command = ["-m", "line_follower_controller.node", "--ros-args", *arguments]
        node = stack.enter_context(RosProcess(command, variables, folder / "run", [folder / "package"]))
        peer.wait_for_peers(["/line/correction", "/cmd_vel"])
        driver = _Driver(peer, node, next((folder / "events").iterdir()), depth)
        driver.send(1, _WARM_UP)
        begin_kb, begin_s = node.resident_kb(), node.processor_s()
        count = round(seconds * RATE_HZ)
        took = driver.send(1 + _WARM_UP, count)
        end_kb, end_s = node.resident_kb(), node.processor_s()
        node.signal(signal.SIGTERM)
        node.wait()
        taken, dropped = driver.received()
    numbers = [number for number in range(1 + _WARM_UP, 1 + _WARM_UP + count) if number in taken]
    latencies = [taken[number] - driver.sent_s[number] for number in numbers]
    return Soak(count, len(numbers), dropped, (begin_kb, end_kb), end_s - begin_s, latencies, took)


def main() -> int:
    """Print what was measured; 1 if anything was lost."""
    found = soak(*(kind(word) for kind, word in zip((float, int, str), sys.argv[1:] or [str(SECONDS)], strict=False)))
    sys.stdout.write(f"{found}\n")
    return int(found.sent != found.received)


if __name__ == "__main__":
    sys.exit(main())
