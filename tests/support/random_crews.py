"""Random robots of several small components, as texts: each requirement is about few of them, so modules are many.

Their services and actions fail, their silent steps may lead where nothing leads back, and their requirements may hold
each other up: modules conflict, and some robots have no supervisor.
"""

from random import Random

from robosc.source import Bundle, SourceFile
from support.failing import made

_MESSAGES = """
  incoming message go{0} with identifier: "{1}", type: none
  incoming message back{0} with identifier: "/back{0}", type: none
  outgoing message done{0} with identifier: "/done{0}", type: {2}
"""

_KINDS = {
    "message": (
        _MESSAGES,
        {"idle": ["request to go{0} goto busy"], "busy": ["response from done{0} goto away"],
         "away": ["request to back{0} goto idle"]},
    ),
    "choice": (
        _MESSAGES,
        {"idle": ["request to go{0} goto busy", "request to back{0} goto away"],
         "busy": ["request to back{0} goto away", "response from done{0} goto idle"],
         "away": ["request to go{0} goto idle"]},
    ),
    "counter": (
        _MESSAGES,
        {"idle": ["request to go{0} goto busy"], "busy": ["response from done{0} do n := {3} goto away"],
         "away": ["request to back{0} goto idle"]},
    ),
    "service": (
        '  service go{0} with identifier: "{1}", request: none, response: none links i\n',
        {"idle": ["request to go{0} goto busy"],
         "busy": ["response from go{0} goto away", "error from go{0} goto {4}"],
         "away": ["request to go{0} goto idle"]},
    ),
    "action": (
        '  action go{0} with identifier: "{1}", request: none, response: none, feedback: none links i\n',
        {"idle": ["request to go{0} goto busy"],
         "busy": ["response from go{0} goto away", "error from go{0} goto {4}", "cancel to go{0} goto {4}"],
         "away": []},
    ),
}  # fmt: skip
"""For each kind of component its communications, and the transitions of its states."""


def random_crew(seed: int) -> Bundle:
    """The robot of a seed, of three to five components."""
    text = _Author(Random(seed)).robot()
    made("random_crew", seed, lambda: {"crew.rscd": text})
    return Bundle(SourceFile("crew.rscd", text), ())


class _Author:
    def __init__(self, dice: Random) -> None:
        self._dice = dice
        self._states: dict[str, list[str]] = {}
        self._counters: set[str] = set()
        self._requests: dict[str, list[str]] = {}
        self._replies: list[str] = []
        self._kinds = sorted(_KINDS)
        self._share = 0.25

    def _chance(self, share: float) -> bool:
        return self._dice.random() < share

    def robot(self) -> str:
        is_ring = self._chance(0.25)
        if is_ring:
            # No other way leads back.
            self._kinds, self._share = ["counter", "message"], 0.0
        components = [self._component(f"C{number}") for number in range(self._dice.randint(3, 5))]
        names = list(self._states)
        following = [*names[1:], names[0]]
        if is_ring:
            # Each waits for the next one: where all have begun, none can go on.
            word, state = self._dice.choice((("back", "idle"), ("back", "idle"), ("go", "idle"), ("go", "away")))
            pairs = zip(names, following, strict=True)
            rules = [f"requirement {self._request(name, word)} needs {after}.{state}\n" for name, after in pairs]
        else:
            # Mostly about neighbours, so that there are chains and rings of modules.
            rules = [
                self._requirement(name, other)
                for name, after in zip(names, following, strict=True)
                for other in sorted({after, self._dice.choice(names)} - {name})
                if self._chance(0.6)
            ]
        interface = "interface i use Thing from own_msgs\n"
        return f"robot Crew {{\n{interface}{''.join(components)}{''.join(rules)}}}\n"

    def _component(self, name: str) -> str:
        """A component that goes out and comes back, or does not."""
        kind = self._dice.choice(self._kinds)
        declared, transitions = _KINDS[kind]
        identifier = self._dice.choice((f"/go{name}", "/go"))
        count = self._dice.choice(("min(n + 1, 2)", "n + 1", "2 - n", "if value then 0 else min(n + 1, 2)"))
        parts = (
            name,
            identifier,
            "boolean" if kind == "counter" else "none",
            count,
            self._dice.choice(("idle", "away")),
        )
        steps = {state: [f"on {item}" for item in items] for state, items in transitions.items()}
        states = self._states[name] = list(steps)
        if kind == "counter":
            self._counters.add(name)
        if kind == "action" or self._chance(self._share):
            guard = "if n > 0 " if kind == "counter" else ""
            steps["away"].append(f"transition {guard}goto idle")
        if self._chance(self._share / 2):
            steps["away"].append("transition goto stuck")
            steps["stuck"] = [f"on request to go{name} goto idle"]
            states.append("stuck")
        if self._replies and self._chance(self._share):
            # It hears what another component waits for: the two are one part.
            steps[self._dice.choice(states)].append(f"on {self._dice.choice(self._replies)} goto busy")
        called = kind in ("service", "action")
        self._requests[name] = [f"go{name}"] if called else [f"go{name}", f"back{name}"]
        self._replies.append(f"response from {'go' if called else 'done'}{name}")
        text = "".join(
            f"{self._kind_of(state)}state {state} {{\n  {'\n  '.join(items)}\n}}\n" for state, items in steps.items()
        )
        variable = "variable n: integer(0..2) = 0\n" if kind == "counter" else ""
        whole = f"component {name} {{\n{declared}behaviour {{\n{variable}{text}}}\n}}\n"
        for place, part in enumerate(parts):
            whole = whole.replace(f"{{{place}}}", part)
        return whole

    def _kind_of(self, state: str) -> str:
        if state == "idle":
            return "initial marked "
        return "marked " * self._chance(self._share)

    def _request(self, name: str, word: str) -> str:
        """A request of a component: the one that begins so, if there is one."""
        return next((item for item in self._requests[name] if item.startswith(word)), self._requests[name][0])

    def _atom(self, name: str) -> str:
        if name in self._counters and self._chance(0.5):
            return f"{name}.n {self._dice.choice(('=', '<'))} {self._dice.randint(1, 2)}"
        return f"{'' if self._chance(0.7) else '!'}{name}.{self._dice.choice(self._states[name])}"

    def _requirement(self, name: str, other: str) -> str:
        mine, theirs = (self._dice.choice(self._requests[item]) for item in (name, other))
        match self._dice.randint(0, 4):
            case 0:
                return f"requirement never {name}.{self._dice.choice(('busy', 'away'))} and {self._atom(other)}\n"
            case 1:
                return f"requirement {self._atom(other)} disables {mine}\n"
            case 2:
                return f"requirement {{{mine}, {theirs}}} needs {self._atom(other)} or {self._atom(name)}\n"
            case 3:
                return f"requirement always {self._atom(other)} or {self._atom(name)}\n"
            case _:
                return f"requirement {mine} needs {self._atom(other)}\n"
