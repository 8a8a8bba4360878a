"""Random goals, missions, preferences and assumptions for a robot that is there already."""

from random import Random

import msgspec

from robosc.automata import ExecutableSystem, to_automata
from robosc.expressions import Binary, BooleanType, EnumType, EnumValue, Expression, StateTest, Unary, VariableRead
from robosc.model.structure import (
    Assumption,
    Component,
    Deployment,
    Detour,
    Goal,
    GoalForm,
    Mission,
    Model,
    Preference,
)
from robosc.strategies import synthesize_strategy
from robosc.supervisor import Supervisor
from robosc.synthesis import SynthesisStatus, synthesize
from support.execution import supervisor_of
from support.failing import made, model_files
from support.random_controllers import random_controller
from support.random_errands import random_errands


def strategic_controller(seed: int) -> Supervisor | None:
    """Return the supervisor of a random robot with goals and missions that can be reached, or None if they cannot.

    It may keep its assumptions from coming true.
    """
    supervisor, model = wanting_robot(seed)
    if supervisor is None:
        return None
    allowed = tuple(msgspec.structs.replace(item, is_allowed=True) for item in model.assumptions)
    model = msgspec.structs.replace(model, assumptions=allowed)
    executable = ExecutableSystem(model, Deployment.CONTROLLER)
    strategy = synthesize_strategy(executable, supervisor.added).strategy
    if strategy is None:
        return None
    certificate = msgspec.structs.replace(supervisor.certificate, goals="not checked")
    return msgspec.structs.replace(supervisor, model=model, strategy=strategy, certificate=certificate)


def wanting_robot(seed: int) -> tuple[Supervisor | None, Model]:
    """Return the supervisor of a random robot, or None if there is none, and its model with goals.

    Of five robots four are of those that have something to do.
    """
    if seed % 5:
        model = random_errands(seed)
        result = synthesize(to_automata(model, Deployment.CONTROLLER))
        made("random_errands", seed, lambda: model_files(model))
        is_empty = result.status is SynthesisStatus.EMPTY
        return None if is_empty else supervisor_of(model, added=result.added), model
    supervisor = random_controller(seed)
    if supervisor is None:
        return None, random_errands(seed)
    return supervisor, with_random_goals(supervisor.model, Random(seed))


def with_random_goals(model: Model, dice: Random) -> Model:
    """Return a robot with up to three goals, up to two missions, preferences and up to two assumptions.

    One in two has no missions, and one in five that has some has no goals.
    """

    def item(kind: type[Goal] | type[Assumption], forms: list[GoalForm]) -> Goal | Assumption:
        form = dice.choice(forms)
        trigger = _condition(model, dice) if form is GoalForm.LEADS_TO else None
        return kind(form, _condition(model, dice), trigger)

    goals = tuple(item(Goal, list(GoalForm)) for _ in range(dice.randint(1, 3)))
    moving = _moving(model)
    if moving and dice.random() < 0.5:
        # A component that has to be in one state again and again, and in another one, must move.
        goals = _rounds(dice.choice(moving), dice)
    owed = [GoalForm.ALWAYS_EVENTUALLY, GoalForm.LEADS_TO]
    assumptions = tuple(item(Assumption, owed) for _ in range(dice.randint(0, 2)))
    model = msgspec.structs.replace(model, goals=goals, assumptions=assumptions, preferences=_preferences(model, dice))
    return with_random_missions(model, dice) if dice.random() < 0.5 else model


def with_random_missions(model: Model, dice: Random) -> Model:
    """Return a robot with one or two missions beside its goals, or instead of them."""
    missions = tuple(_mission(model, dice, name) for name in ("rounds", "errands")[: dice.choice((1, 1, 1, 2))])
    return msgspec.structs.replace(model, missions=missions, goals=() if dice.random() < 0.2 else model.goals)


def _mission(model: Model, dice: Random, name: str) -> Mission:
    visits = tuple(_condition(model, dice) for _ in range(dice.randint(1, 3)))
    moving = _moving(model)
    if moving and dice.random() < 0.5:
        visits = tuple(goal.condition for goal in _rounds(dice.choice(moving), dice))
    detours = tuple(
        Detour(_condition(model, dice), tuple(_condition(model, dice) for _ in range(dice.randint(1, 2))))
        for _ in range(dice.choice((0, 0, 1, 2)))
    )
    return Mission(name, visits, _condition(model, dice) if dice.random() < 0.3 else None, detours)


def _preferences(model: Model, dice: Random) -> tuple[Preference, ...]:
    """Preferences that are no circle: each is of a request over some that come before it in a random order."""
    names = [item.name for item in model.communications if item.request is not None]
    dice.shuffle(names)
    return tuple(
        Preference((name,), tuple(dice.sample(names[:place], dice.randint(1, place))))
        for place, name in enumerate(names)
        if place and dice.random() < 0.5
    )


def _moving(model: Model) -> list[Component]:
    """The components with several states."""
    return [item for item in model.components if item.behaviour and len(item.behaviour.states) > 1]


def random_text(dice: Random) -> str:
    """Return a robot whose components go on by requests and by responses, with requirements and goals."""
    sizes = [dice.randint(2, 4) for _ in range(dice.randint(2, 3))]
    lines: list[str] = []
    requests: list[str] = []
    for number, size in enumerate(sizes):
        messages, states = [], []
        for state in range(size):
            marks = "initial marked" if state == 0 else "marked"
            steps = ""
            for place in range(dice.randint(1, 2)):
                name, target = f"m{number}{state}{place}", (state + 1) % size if place == 0 else dice.randrange(size)
                is_request = dice.random() < 0.8
                messages.append(f"{'incoming' if is_request else 'outgoing'} message {name} with type: none")
                steps += f" on {'request to' if is_request else 'response from'} {name} goto s{target}"
                requests += [name] if is_request else []
            states.append(f"{marks} state s{state} {{{steps} }}")
        lines.append(f"component C{number} {{ {' '.join(messages)} behaviour {{ {' '.join(states)} }} }}")

    def test() -> str:
        number = dice.randrange(len(sizes))
        return f"C{number}.s{dice.randrange(sizes[number])}"

    lines += [f"requirement {name} needs {test()}" for name in dice.sample(requests, min(len(requests), 5))]
    if dice.random() < 0.6:
        lines.append(f"requirement never {test()} and {test()}")
    lines += [f"goal always eventually {test()} and {test()}" for _ in range(dice.randint(1, 2))]
    lines += [f"assume {test()} leads to {test()}" for _ in range(dice.randint(0, 1))]
    return "robot R {\n" + "\n".join(lines) + "\n}"


def _rounds(component: Component, dice: Random) -> tuple[Goal, ...]:
    assert component.behaviour
    states = dice.sample([state.name for state in component.behaviour.states], 2)
    return tuple(Goal(GoalForm.ALWAYS_EVENTUALLY, StateTest(component.name, state)) for state in states)


def _condition(model: Model, dice: Random) -> Expression:
    found = _test(model, dice)
    if dice.random() < 0.3:
        found = Unary("not", found)
    return Binary(dice.choice(("and", "or")), found, _test(model, dice)) if dice.random() < 0.3 else found


def _test(model: Model, dice: Random) -> Expression:
    component = dice.choice([item for item in model.components if item.behaviour])
    assert component.behaviour
    variables = [item for item in component.behaviour.variables if item.is_synthesis]
    if variables and dice.random() < 0.3:
        variable = dice.choice(variables)
        read = VariableRead(component.name, variable.name)
        if isinstance(variable.type, BooleanType):
            return read
        if isinstance(variable.type, EnumType):
            return Binary("=", read, EnumValue(variable.type.name, dice.choice(variable.type.values)))
    return StateTest(component.name, dice.choice(component.behaviour.states).name)
