"""Random robots that have something to do: machines that are told to, callers who want it, and goals about both.

A machine is a switch, a door, a service or an action. Most goals can be reached, and need requests. There are missing
assumptions, requirements, taus and sensors by chance, too, so that not all can.
"""

from random import Random

import msgspec

from robosc.expressions import BooleanType, Expression, NoneType, Received, StateTest, Unary, VariableRead
from robosc.model.structure import (
    Assumption,
    Behaviour,
    Communication,
    CommunicationKind,
    Component,
    Goal,
    GoalForm,
    Interface,
    Model,
    Requirement,
    RequirementForm,
    State,
    Transition,
    Update,
    Variable,
)

NONE = NoneType()

_KIND = CommunicationKind
_LINKS = {_KIND.SERVICE: Interface("Empty", "std_srvs"), _KIND.ACTION: Interface("Fibonacci", "test_msgs")}


class _Robot:
    """A robot under way."""

    def __init__(self, dice: Random) -> None:
        self.dice = dice
        self.components: list[Component] = []
        self.communications: list[Communication] = []
        self.machines: list[str] = []
        self.owed: list[Assumption] = []

    def communication(self, name: str, owner: str, kind: CommunicationKind) -> Communication:
        """A communication of a component, which is added."""
        is_received = kind is not _KIND.OUTGOING_MESSAGE
        answers = kind is not _KIND.INCOMING_MESSAGE
        made = Communication(
            name,
            owner,
            kind,
            f"/{name}",
            request=NONE if is_received else None,
            response=NONE if answers else None,
            feedback=NONE if kind is _KIND.ACTION else None,
            interface=_LINKS.get(kind),
        )
        self.communications.append(made)
        return made

    def component(self, name: str, states: list[str], *transitions: Transition) -> None:
        """Add a component, which begins in its first state; another one may be marked, too."""
        also = self.dice.choice(states)
        found = tuple(State(item, place == 0, place == 0 or item == also) for place, item in enumerate(states))
        self.components.append(Component(name, Behaviour((), found, transitions)))

    def machine(self, number: int) -> None:
        """Add a machine: at rest, perhaps busy, or done."""
        name = f"M{number}"
        self.machines.append(name)
        kind = self.dice.choice((_KIND.INCOMING_MESSAGE, _KIND.OUTGOING_MESSAGE, _KIND.SERVICE, _KIND.ACTION))
        found = [Transition("done", f"back{number}.request", None, (), "rest")]
        if kind is _KIND.INCOMING_MESSAGE:
            self.communication(f"go{number}", name, kind)
            found.append(Transition("rest", f"go{number}.request", None, (), "done"))
        else:
            is_door = kind is _KIND.OUTGOING_MESSAGE
            answer = f"went{number}" if is_door else f"go{number}"
            self.communication(f"go{number}", name, _KIND.INCOMING_MESSAGE if is_door else kind)
            if is_door:
                self.communication(answer, name, kind)
            found += [
                Transition("rest", f"go{number}.request", None, (), "busy"),
                Transition("busy", f"{answer}.response", None, (), "done"),
            ]
            if not is_door:
                found.append(Transition("busy", f"{answer}.error", None, (), "rest"))
            if kind is _KIND.ACTION:
                found.append(Transition("busy", f"{answer}.cancel", None, (), "rest"))
            if self.dice.random() < 0.95:
                self.owed.append(Assumption(GoalForm.LEADS_TO, StateTest(name, "done"), StateTest(name, "busy")))
        self.communication(f"back{number}", name, _KIND.INCOMING_MESSAGE)
        if self.dice.random() < 0.15:
            found.append(Transition("done", f"{name}.tau_1", self.condition(), (), "rest"))
        self.component(name, ["rest", "done"] if kind is _KIND.INCOMING_MESSAGE else ["rest", "busy", "done"], *found)

    def caller(self, number: int) -> None:
        """Add somebody who wants something until a machine is told to do something."""
        name = f"C{number}"
        self.communication(f"call{number}", name, _KIND.OUTGOING_MESSAGE)
        events = [item.events[0] for item in self.communications if item.kind is not _KIND.OUTGOING_MESSAGE]
        awaited = self.dice.choice(events)
        found = [
            Transition("quiet", f"call{number}.response", None, (), "waiting"),
            Transition("waiting", awaited, None, (), "quiet"),
        ]
        if self.dice.random() < 0.8:
            # Without it, the request would be disabled while nobody calls.
            found.append(Transition("quiet", awaited, None, (), None))
        self.component(name, ["quiet", "waiting"], *found)

    def sensor(self) -> None:
        """Add a sensor with a variable."""
        name = "Sensor"
        made = self.communication("seen", name, _KIND.OUTGOING_MESSAGE)
        self.communications[-1] = msgspec.structs.replace(made, response=BooleanType())
        update = Transition(None, "seen.response", None, (Update("is_clear", Received()),), None)
        variables = (Variable("is_clear", BooleanType(), self.dice.random() < 0.5, True),)
        self.components.append(Component(name, Behaviour(variables, (State("on", True, True),), (update,))))

    def condition(self) -> Expression:
        """A condition over one of the components that there are so far."""
        if not self.components:
            return StateTest(self.machines[0], "rest")
        component = self.dice.choice(self.components)
        assert component.behaviour is not None
        found: Expression = StateTest(component.name, self.dice.choice(component.behaviour.states).name)
        if component.behaviour.variables:
            found = VariableRead(component.name, component.behaviour.variables[0].name)
        return Unary("not", found) if self.dice.random() < 0.3 else found

    def goal(self) -> Goal:
        """A goal about a machine, for somebody who waits or by itself."""
        machine = self.dice.choice(self.machines)
        done = StateTest(machine, self.dice.choice(("done", "done", "rest")))
        callers = [item.name for item in self.components if item.name.startswith("C")]
        match self.dice.randrange(5):
            case 0 | 1 if callers:
                return Goal(GoalForm.LEADS_TO, done, StateTest(self.dice.choice(callers), "waiting"))
            case 2:
                return Goal(GoalForm.ONCE, done)
            case 3:
                return Goal(GoalForm.LEADS_TO, done, self.condition())
            case _:
                return Goal(GoalForm.ALWAYS_EVENTUALLY, done)


def random_errands(seed: int) -> Model:
    """Return a random robot with goals and assumptions, the same for the same seed."""
    dice = Random(f"errands {seed}")
    robot = _Robot(dice)
    for number in range(dice.randint(1, 2)):
        robot.machine(number)
    for number in range(dice.choice((0, 1, 1, 2))):
        robot.caller(number)
    if dice.random() < 0.3:
        robot.sensor()
    events = [item.name for item in robot.communications if item.kind is not _KIND.OUTGOING_MESSAGE]
    requirements = tuple(
        Requirement((dice.choice(events),), dice.choice(list(RequirementForm)), robot.condition())
        for _ in range(dice.choice((0, 0, 0, 1, 2)))
    )
    return Model(
        name="Errands",
        components=tuple(robot.components),
        communications=tuple(robot.communications),
        enums=(),
        objects=(),
        requirements=requirements,
        provides=(),
        invariants=(),
        goals=tuple(robot.goal() for _ in range(dice.randint(1, 3))),
        assumptions=tuple(robot.owed),
    )
