"""Meaning of each name of a text: the place where what it names is defined (language A.4)."""

from robosc.language import syntax
from robosc.source import Location


class Bindings:
    """Names and their definitions, noted by the checks while they resolve them.

    Attributes:
        uses: Place of a definition, by each place that names it; the definition itself is no use of it.
        communications: Place where each communication of the robot is defined, by name.
    """

    def __init__(self) -> None:
        self.uses: dict[Location, Location] = {}
        self.communications: dict[str, Location] = {}

    def bind(self, name: syntax.Name, definition: Location | None) -> None:
        """Note what a name means; None where nothing is defined that it could mean."""
        if definition is not None and definition != name.location:
            self.uses[name.location] = definition

    def bind_communication(self, name: syntax.Name) -> None:
        """Note that a name is a communication's."""
        self.bind(name, self.communications.get(name.text))
