"""A node as the live view hears it."""

from pathlib import Path
from random import Random

from robosc.automata.plants import PLANT_LOCATIONS
from robosc.supervisor import Supervisor
from robosc.targets import generate
from support.generated import imported


class Node:
    """The part of a generated node that makes the texts of the topic."""

    def __init__(self, supervisor: Supervisor, folder: Path) -> None:
        files = generate(supervisor, "ros2")
        (path,) = (path for path in files if path.endswith("/state_topic.py"))
        module = path.removesuffix(".py").replace("/", ".")
        with imported(files, folder, module) as found:
            self.system = found.RecordingSupervisor()
        self._model = supervisor.model
        self._dice = Random(1)

    def step(self) -> str | None:
        """An event, if the state takes it."""
        events = [event for item in self._model.communications for event in item.events]
        event = self._dice.choice(events)
        if event.endswith(".request") and not self.system.enabled(event):
            return None
        return event if self.take(event, self._dice.randint(0, 3)) else None

    def take(self, event: str, data: int = 0) -> bool:
        """Let an event happen; False: the state does not take it."""
        reading = self.system.read(event, data) if event.endswith((".response", ".feedback")) else None
        return self.system.step(event, reading) is not None

    def places(self) -> dict[str, str]:
        """Return the locations of services and actions."""
        called = [item for item in self._model.communications if item.kind in PLANT_LOCATIONS]
        return {item.name: self.system.location(item.name) for item in called}

    def enabled(self) -> list[str]:
        names = [f"{item.name}.request" for item in self._model.communications]
        return [name for name in names if name in self._requests() and self.system.enabled(name)]

    def _requests(self) -> list[str]:
        return [event for item in self._model.communications for event in item.events if event.endswith(".request")]
