"""Warning when all connections are taken: gRPC refuses callers without a report."""

import logging
from pathlib import Path

_log = logging.getLogger(__name__)

_TABLES = (Path("/proc/self/net/tcp"), Path("/proc/self/net/tcp6"))
"""proc(5), /proc/pid/net/tcp: a heading, then a line for each socket: number, own address, the other's, state."""

_ESTABLISHED = "01"


class ConnectionSlots:
    """Monitor that logs once that all connections are taken, and again only after half of them were free.

    Args:
        port: Port on which callers come.
        most: Number of places.
    """

    def __init__(self, port: int, most: int) -> None:
        self._ending = f":{port:04X}"
        self._most = most
        self._is_full = False

    def poll(self) -> None:
        """Count the connections, and report once that all places are taken; never on a system without these tables."""
        taken = sum(map(self._taken, _TABLES))
        if taken >= self._most and not self._is_full:
            self._is_full = True
            _log.error(
                "all %d connections of the remote endpoint are taken: callers are refused, even those who want to stop "
                "the robot; keys and signals stop it all the same",
                self._most,
            )
        elif taken <= self._most // 2:
            self._is_full = False

    def _taken(self, table: Path) -> int:
        try:
            lines = table.read_text(encoding="ascii").splitlines()[1:]
        except OSError:
            return 0
        rows = [line.split(None, 4) for line in lines]
        return sum(row[1].endswith(self._ending) and row[3] == _ESTABLISHED for row in rows)
