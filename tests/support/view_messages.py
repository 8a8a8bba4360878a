"""Messages of a live view's server about robots that were made up for tests."""

from collections.abc import Mapping, Sequence
from typing import Any

Message = dict[str, Any]
Arc = tuple[str, str, str, str]
"""From, to, label, kind."""

BEGIN_S = 1_750_000_000.0
"""The time of the first event, in seconds since 1970."""

_MIDDLE, _HEIGHT, _GAP = 85.0, 38.0, 130.0
_UP, _DOWN = "controllable", "uncontrollable"


def graph(states: Sequence[str], arcs: Sequence[Arc], first_id: int = 1) -> Message:
    """States in a row; what goes to the right stands above it, what goes to the left below."""
    width = float(max(90, *(12 + 9 * len(name) for name in states)))
    at = {name: 40 + width / 2 + i * (width + _GAP) for i, name in enumerate(states)}
    placed = [
        {"name": name, "x": x, "y": _MIDDLE, "width": width, "height": _HEIGHT, "is_initial": not i, "is_marked": not i}
        for i, (name, x) in enumerate(at.items())
    ]
    edges = [_edge(first_id + i, at, arc) for i, arc in enumerate(arcs)]
    return {"width": at[states[-1]] + width / 2 + 40, "height": 2 * _MIDDLE, "states": placed, "edges": edges}


def _edge(number: int, at: Mapping[str, float], arc: Arc) -> Message:
    source, target, label, kind = arc
    x1, x2 = at[source], at[target]
    if source == target:
        top, far = _MIDDLE - _HEIGHT / 2, _MIDDLE - 50
        points, label_y = [[x1 - 16, top], [x1 - 16, far], [x1 + 16, far], [x1 + 16, top]], far - 10
    else:
        far = _MIDDLE + (-48 if x2 > x1 else 48)
        points, label_y = [[x1, _MIDDLE], [(x1 + x2) / 2, far], [x2, _MIDDLE]], far + (-6 if x2 > x1 else 6)
    return {
        "id": number,
        "from": source,
        "to": target,
        "label": label,
        "kind": kind,
        "points": points,
        "label_x": (x1 + x2) / 2,
        "label_y": label_y,
    }


def component(name: str, communications: Sequence[str], drawn: Message | None) -> Message:
    """A component with its graph, or without a behaviour."""
    return {"name": name, "communications": list(communications), "graph": drawn}


def communication(name: str, owner: str, kind: str) -> Message:
    """One that is mapped to a topic of its name."""
    return {"name": name, "component": owner, "kind": kind, "identifier": f"/{name}", "channel": "grpc"}


def definition(**changes: Any) -> Message:
    """A small robot with a gripper, a base, and a sensor without behaviour."""
    gripper: list[Arc] = [
        ("open", "closing", "grip.request", _UP),
        ("closing", "closed", "gripped.response", _DOWN),
        ("closed", "open", "", "silent"),
    ]
    base: list[Arc] = [
        ("still", "driving", "move.request", _UP),
        ("driving", "still", "halted.response", _DOWN),
        ("driving", "driving", "move.request", _UP),
    ]
    message = {
        "type": "definition",
        "robot": "Carrier",
        "version": "0.1.0",
        "deployment": "controller",
        "source": "bridge",
        "can_command": True,
        "has_token": True,
        "components": [
            component("Gripper", ["grip", "gripped"], graph(["open", "closing", "closed"], gripper)),
            component("Base", ["move", "halted", "go", "dock"], graph(["still", "driving"], base, first_id=10)),
            component("Sensor", ["scan"], None),
        ],
        "communications": [
            communication("grip", "Gripper", "incoming message"),
            communication("gripped", "Gripper", "outgoing message"),
            communication("move", "Base", "incoming message"),
            communication("halted", "Base", "outgoing message"),
            communication("go", "Base", "action"),
            communication("dock", "Base", "service"),
            communication("scan", "Sensor", "outgoing message"),
        ],
        "requests": ["grip.request", "move.request", "go.request", "dock.request"],
        "log": None,
        "scene": None,
    }
    return {**message, **changes}


def update(**changes: Any) -> Message:
    """The robot while nothing is wrong."""
    message = {
        "type": "update",
        "number": 1,
        "time_s": BEGIN_S,
        "state": "running",
        "problem": "",
        "reasons": [],
        "warnings": [],
        "stops": [],
        "devices": {"base": True, "scanner": True},
        "components": {
            "Gripper": {"state": "open", "variables": {}},
            "Base": {"state": "still", "variables": {"speed": 0.22, "is_loaded": False}},
        },
        "communications": {"go": "idle", "dock": "waiting"},
        "enabled": ["grip.request", "move.request"],
        "disabled": [
            {"event": "go.request", "why": ["Gripper must be in closed, it is in open."]},
            {"event": "dock.request", "why": ["dock is waiting for its response.", "Base must be in still."]},
        ],
        "drive": drive(0.5, 0.25, 0.6),
        "age_s": 0.01,
    }
    return {**message, **changes}


def progress(**changes: Any) -> Message:
    """Two goals of which one is approached, and an assumption that is owed."""
    message = {
        "aims": [
            {
                "name": "goal 1",
                "words": "Caller.waiting leads to Base.inside",
                "is_met": False,
                "times": 1,
                "unmet_s": 5.2,
                "mission": None,
            },
            {
                "name": "goal 2",
                "words": "always eventually Base.outside",
                "is_met": True,
                "times": 3,
                "unmet_s": None,
                "mission": None,
            },
        ],
        "assumptions": [
            {
                "name": "assumption 1",
                "words": "Door.opening leads to Door.ajar",
                "is_met": False,
                "times": 0,
                "unmet_s": 4,
                "mission": None,
            },
        ],
        "overdue": [],
        "is_followed": True,
        "approached": "goal 1",
        "chosen": "open",
        "missions": [],
    }
    return {**message, **changes}


def drive(x_m: float, y_m: float, heading_rad: float) -> Message:
    """A drive base at a pose."""
    return {
        "pose": [x_m, y_m, heading_rad],
        "linear_m_s": 0.2,
        "angular_rad_s": 0.1,
        "battery_v": 11.8,
        "is_torque_on": True,
    }


def entry(number: int, **changes: Any) -> Message:
    """An event of the model, a hundredth of a second after the one before."""
    message = {
        "number": number,
        "time_s": BEGIN_S + number / 100,
        "kind": "event",
        "event": "move.request",
        "controllable": True,
        "text": f"number {number}",
        "transitions": [],
    }
    return {**message, **changes}


def events(entries: Sequence[Mapping[str, Any]], lost: int = 0) -> Message:
    """A batch of entries, before which others were lost."""
    return {"type": "events", "entries": [dict(item) for item in entries], "lost": lost}


def taken(name: str, number: int) -> Message:
    """A transition of a component, as entries have them."""
    return {"component": name, "id": number}


def many(count: int) -> Message:
    """A robot of so many components; part `i` has two states and the transitions `2 i + 1` and `2 i + 2`."""
    components, communications = [], []
    for i in range(count):
        do, done, part = f"do{i}", f"done{i}", f"Part{i}"
        arcs: list[Arc] = [("idle", "busy", f"{do}.request", _UP), ("busy", "idle", f"{done}.response", _DOWN)]
        components.append(component(part, [do, done], graph(["idle", "busy"], arcs, first_id=2 * i + 1)))
        communications += [
            communication(do, part, "incoming message"),
            communication(done, part, "outgoing message"),
        ]
    return definition(
        robot=f"Robot of {count} parts",
        components=components,
        communications=communications,
        requests=[f"do{i}.request" for i in range(count)],
    )
