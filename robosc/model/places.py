"""Places of the parts of a checked model in the text, for findings of later stages."""

import msgspec

from robosc.source import Location


class Places(msgspec.Struct, frozen=True):
    """Locations by the names of the model; lists follow the model's own order.

    Attributes:
        robot: The robot's name.
        components: By name.
        communications: By name.
        states: By component and state.
        variables: By component and variable.
        enums: By model name.
        objects: By model name.
        transitions: By component, in the order of its behaviour's transitions.
        requirements: In the order of the model's requirements.
        provides: In the order of the model's provide statements.
        invariants: In the order of the model's invariants.
        goals: In the order of the model's goals.
        assumptions: In the order of the model's assumptions.
        missions: In the order of the model's missions.
        visits: For each mission the places of its visits, then those of each detour's visits.
        preferences: In the order of the model's preferences.
        limits: In the order of the model's limits.
        identifiers: By communication; where its identifier is written, or its name.
    """

    robot: Location
    components: dict[str, Location] = msgspec.field(default_factory=dict)
    communications: dict[str, Location] = msgspec.field(default_factory=dict)
    states: dict[tuple[str, str], Location] = msgspec.field(default_factory=dict)
    variables: dict[tuple[str, str], Location] = msgspec.field(default_factory=dict)
    enums: dict[str, Location] = msgspec.field(default_factory=dict)
    objects: dict[str, Location] = msgspec.field(default_factory=dict)
    transitions: dict[str, tuple[Location, ...]] = msgspec.field(default_factory=dict)
    requirements: list[Location] = msgspec.field(default_factory=list)
    provides: list[Location] = msgspec.field(default_factory=list)
    invariants: list[Location] = msgspec.field(default_factory=list)
    goals: list[Location] = msgspec.field(default_factory=list)
    assumptions: list[Location] = msgspec.field(default_factory=list)
    missions: list[Location] = msgspec.field(default_factory=list)
    visits: list[tuple[Location, ...]] = msgspec.field(default_factory=list)
    preferences: list[Location] = msgspec.field(default_factory=list)
    limits: list[Location] = msgspec.field(default_factory=list)
    identifiers: dict[str, Location] = msgspec.field(default_factory=dict)
