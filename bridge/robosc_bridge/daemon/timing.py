"""Times of the bridge, measured by itself as histograms.

Each histogram is filled by one thread, and read by any, without waiting: a reader may miss a time that is being added.
Percentiles are the upper bounds of their buckets, which are a tenth wide, so that they are never below the true value,
and at most a tenth above it; times below the first bound count as that bound.
"""

from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

_FIRST_S, _FACTOR, _COUNT = 0.00025, 1.1, 95

BOUNDS_S = tuple(round(_FIRST_S * _FACTOR**index, 6) for index in range(_COUNT))
"""Upper bounds of the buckets, 0.25 ms to 1.95 s; what is longer is in one more."""

SHOWN_S = 1.0
"""Time between figures that are worked out."""

MEANINGS = {
    "scan_to_wheel": "from the last byte of a revolution until the bytes of the new velocity that was decided on it "
    "have been written to the line of the drive base; if its driver does not report that, until the exchange ends",
    "scan_to_decision": "from the last byte of a revolution until the supervisor has decided on it",
    "decision_period": "from one decision of the supervisor to the next",
    "queueing": "from the last byte of a reading until the loop takes it up",
    "exchange": "one exchange with the drive base",
}
"""Histograms by name, with what they measure."""


@dataclass(frozen=True)
class Latency:
    """Values of a histogram at one time.

    Attributes:
        name: Key of `MEANINGS`.
        counts: Number of times in each bucket, the last of them without a bound.
        sum_s: Sum of all.
        max_s: Longest since the start.
    """

    name: str
    counts: tuple[int, ...]
    sum_s: float
    max_s: float

    @property
    def count(self) -> int:
        """Number of times that were measured."""
        return sum(self.counts)

    def share_s(self, share: float) -> float:
        """Return the quantile for a share of all times, as the upper bound of its bucket; 0: there are no times."""
        wanted, seen = share * self.count, 0
        for count, bound_s in zip(self.counts, BOUNDS_S, strict=False):
            seen += count
            if seen and seen >= wanted:
                return min(bound_s, self.max_s)
        return self.max_s


class Histogram:
    """Histogram that one thread fills.

    Args:
        name: Key of `MEANINGS`.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._counts = [0] * (len(BOUNDS_S) + 1)
        self._sum_s = self._max_s = 0.0

    def observe(self, seconds: float) -> None:
        """Add a time to the histogram."""
        self._counts[bisect_left(BOUNDS_S, seconds)] += 1
        self._sum_s += seconds
        self._max_s = max(self._max_s, seconds)

    @property
    def latency(self) -> Latency:
        """Present values of the histogram."""
        return Latency(self.name, tuple(self._counts), self._sum_s, self._max_s)


@dataclass(frozen=True)
class TimingFigures:
    """Figures of the bridge's times and lines.

    Attributes:
        latencies: Histograms.
        lines: Counts of each device's line, by device and name, since it was opened.
    """

    latencies: tuple[Latency, ...] = ()
    lines: Mapping[str, Mapping[str, int]] = field(default_factory=dict)


class Timing:
    """Measurement of the times of the loop, and of those from a scan through the loop to the wheels.

    The loop reports when it has taken up a scan, decides, and commands another velocity; the thread of the drive base
    reports that it has written a velocity, and the end of an exchange.

    Args:
        clock: Clock that returns the time, in seconds.
        lines: Functions that return the counts of a device's line, by device.
        decides_at_once: True if the supervisor has decided on a scan once it has received it.
    """

    def __init__(
        self,
        clock: Callable[[], float],
        lines: Mapping[str, Callable[[], Mapping[str, int]]] | None = None,
        *,
        decides_at_once: bool = False,
    ) -> None:
        self._clock = clock
        self._decides_at_once = decides_at_once
        self._lines = lines or {}
        self._histograms = {name: Histogram(name) for name in MEANINGS}
        # Scan that the loop has not decided on yet, and whether it is deciding.
        self._scan_s: float | None = None
        self._is_deciding = False
        self._decided_s: float | None = None
        # From the loop to the drive base's thread.
        self._commanded_s: float | None = None
        self._figures = TimingFigures()
        self._due_s = clock()

    def scan_taken(self, time_s: float) -> None:
        """Note that the loop takes up a scan of that time."""
        self._scan_s = time_s
        self._is_deciding = True

    def scan_passed(self) -> None:
        """Note that the executor has received the scan; with decisions at each event, it has also decided."""
        if self._decides_at_once:
            self.decided()
        self._is_deciding = False

    def reading_taken(self, time_s: float) -> None:
        """Note that the loop has taken up a reading of that time."""
        self._histograms["queueing"].observe(max(self._clock() - time_s, 0.0))

    def deciding(self) -> None:
        """Note that the supervisor begins to decide."""
        now_s = self._clock()
        if self._decided_s is not None:
            self._histograms["decision_period"].observe(now_s - self._decided_s)
        self._decided_s = now_s
        self._is_deciding = True

    def decided(self) -> None:
        """Note that the supervisor has decided."""
        self._is_deciding = False
        if self._scan_s is not None:
            self._histograms["scan_to_decision"].observe(max(self._clock() - self._scan_s, 0.0))
            self._scan_s = None

    def rested(self) -> None:
        """Note that no supervisor is executed: the next decision has no period before it."""
        self._decided_s = self._scan_s = None

    def commanding(self) -> None:
        """Note that the loop is about to command another velocity."""
        if self._is_deciding and self._scan_s is not None:
            self._commanded_s = self._scan_s

    def take_command(self) -> float | None:
        """Return the time of the scan behind the velocity about to be sent; None: no scan, or returned before."""
        commanded_s, self._commanded_s = self._commanded_s, None
        return commanded_s

    def written(self, scan_s: float) -> None:
        """Note that the line has taken the velocity of the scan whose time `take_command` has returned."""
        self._histograms["scan_to_wheel"].observe(max(self._clock() - scan_s, 0.0))

    def exchanged(self, began_s: float) -> None:
        """Note the end of an exchange that began at that time."""
        self._histograms["exchange"].observe(self._clock() - began_s)

    def figures(self) -> TimingFigures:
        """Return the figures, at most `SHOWN_S` old; called by the loop."""
        now_s = self._clock()
        if now_s >= self._due_s:
            self._due_s = now_s + SHOWN_S
            self._figures = TimingFigures(
                tuple(histogram.latency for histogram in self._histograms.values()),
                {device: dict(counts()) for device, counts in self._lines.items()},
            )
        return self._figures


def shown(latencies: Sequence[Latency]) -> list[tuple[str, float, float, float]]:
    """Return name, median, 99th percentile and maximum in milliseconds of each time that was measured."""
    return [
        (one.name, one.share_s(0.5) * 1e3, one.share_s(0.99) * 1e3, one.max_s * 1e3) for one in latencies if one.count
    ]
