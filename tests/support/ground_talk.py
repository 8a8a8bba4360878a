"""A conversation with a ground station, both ends played, on a clock that the test sets."""

from dataclasses import dataclass, field
from typing import Any

from robosc_bridge.daemon.states import State
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.ground_station.session import StationSession
from robosc_bridge.ground_station.settings import GroundSettings
from support.ground import PlayedDaemon, Station, of_type

BEGIN_S = 100.0
FASTEST = Velocity(0.2, 2.0)
OPEN = GroundSettings("udpin:127.0.0.1:0", FASTEST, accepts_unsigned=True)


@dataclass
class Talk:
    """A session with a station, both played."""

    daemon: PlayedDaemon = field(default_factory=PlayedDaemon)
    settings: GroundSettings = OPEN
    station: Station = field(default_factory=Station)
    now_s: float = BEGIN_S

    def __post_init__(self) -> None:
        self.session = StationSession(self.daemon.operations, self.settings, self.now_s)

    def say(self, data: bytes = b"", after_s: float = 0.0) -> list[Any]:
        """Return the answers."""
        self.now_s += after_s
        return self.station.hear(self.session.step(self.now_s, data))

    def live(self, seconds: float, step_s: float = 0.05, *, is_fresh: bool = True) -> list[Any]:
        """Return everything that comes within some time, while the loop runs or hangs."""
        found = []
        for _ in range(round(seconds / step_s)):
            if is_fresh:
                self.daemon.show()
            found += self.say(after_s=step_s)
        return found

    def ask(self, number: int, *parameters: float, **how: Any) -> list[Any]:
        return self.say(self.station.command(number, *parameters, **how))

    def results(self, number: int, *parameters: float, **how: Any) -> list[int]:
        return [item.result for item in of_type("COMMAND_ACK", self.ask(number, *parameters, **how))]


def layer_talk(**values: Any) -> Talk:
    """A talk about a supervision layer that is executed."""
    found = Talk(PlayedDaemon(is_layer=True))
    found.daemon.show(state=State.RUNNING, **values)
    found.say()
    return found
