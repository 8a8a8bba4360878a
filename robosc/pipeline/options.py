"""Options for making a supervisor, on this machine or on a server."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from robosc.model.structure import Deployment

if TYPE_CHECKING:
    from robosc.synthesis import EngineOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class SynthesisOptions:
    """Options for making a supervisor.

    Attributes:
        deployment: Deployment of the supervisor: controller or supervision layer.
        engine: Name of the engine for decision diagrams, or `auto`, the fastest that is installed.
        allow_livelock: True if a supervisor is made even if silent steps of its controller never end.
        allow_reordering: True if the engine may change the order of its variables while it works.
        maximum_nodes: Maximum number of nodes of decision diagrams; None: only the limit of the engine.
        verified_states: States up to which the supervisor is verified state by state; None: 200,000.
        condition_seconds: Seconds after which synthesis on this machine shortens no further condition, for each module
            separately; None: only steps limit this work, and every run gives the same result.

    Raises:
        ValueError: There is no such deployment.
    """

    deployment: Deployment = Deployment.CONTROLLER
    engine: str = "auto"
    allow_livelock: bool = False
    allow_reordering: bool = False
    maximum_nodes: int | None = None
    verified_states: int | None = None
    condition_seconds: float | None = None

    def __post_init__(self) -> None:
        # A text equals its deployment without being it, and would silently be taken for the other one.
        object.__setattr__(self, "deployment", Deployment(self.deployment))

    def engine_options(self) -> "EngineOptions":
        """The options for the engine of this machine.

        Raises:
            ValueError: No diagram fits into so few nodes, or the seconds are negative.
        """
        from robosc.synthesis import EngineOptions

        if self.maximum_nodes is not None and self.maximum_nodes < 1:
            raise ValueError(f"maximum_nodes is {self.maximum_nodes}, and must be at least 1")
        if self.condition_seconds is not None and not self.condition_seconds >= 0:
            raise ValueError(f"condition_seconds is {self.condition_seconds}, and must be at least 0")
        return EngineOptions(self.engine, self.allow_reordering, self.maximum_nodes, self.condition_seconds)


DEFAULT_OPTIONS = SynthesisOptions()

FOREIGN_STATES = 1_000_000
"""States up to which an untrusted supervisor is verified state by state: about a minute at most."""
