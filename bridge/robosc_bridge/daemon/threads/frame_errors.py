"""Number of damaged frames of a scanner, second by second."""

from dataclasses import dataclass

from robosc_bridge.devices.interface import ScannerCounters

WINDOW_S = 1.0
"""Time in which frames are counted, at least."""

_SOUND_SHARE = 0.5


@dataclass(frozen=True)
class FrameErrorReport:
    """Report that the line of a scanner has become noisy, or is sound again.

    Attributes:
        is_noisy: True if it has become noisy; False if it is sound again.
        text: Text with the numbers, for a person.
    """

    is_noisy: bool
    text: str


class FrameErrorMonitor:
    """Monitor of the share of damaged frames, with hysteresis: the line is sound again below half of the limit.

    Args:
        counters: Counters of the scanner, which only grow.
        limit_share: Share of damaged frames in a window above which the line is noisy.
    """

    def __init__(self, counters: ScannerCounters, limit_share: float) -> None:
        self._counters = counters
        self._limit_share = limit_share
        self._is_noisy = False
        self._begin_s: float | None = None
        self._frames = self._bad = 0

    def poll(self, now_s: float) -> FrameErrorReport | None:
        """Return a report if the line has become noisy or sound since the last call; None: it has not changed."""
        if self._begin_s is None:
            self._begin(now_s)
            return None
        time_s = now_s - self._begin_s
        if time_s < WINDOW_S:
            return None
        bad = self._counters.bad_frames - self._bad
        frames = self._counters.frames - self._frames + bad
        self._begin(now_s)
        if frames == 0:
            return None
        share = bad / frames
        is_noisy = share > self._limit_share * (_SOUND_SHARE if self._is_noisy else 1.0)
        if is_noisy == self._is_noisy:
            return None
        self._is_noisy = is_noisy
        what = "many frames are damaged" if is_noisy else "its frames are sound again"
        return FrameErrorReport(is_noisy, f"{what}: {bad} of {frames} in {time_s:.1f} s ({share:.1%})")

    def _begin(self, now_s: float) -> None:
        self._begin_s = now_s
        self._frames, self._bad = self._counters.frames, self._counters.bad_frames
