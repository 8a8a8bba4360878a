"""Random goals, missions, preferences and assumptions for a robot that is there already."""

from random import Random

import msgspec

from robosc.automata import ExecutableSystem
from robosc.expressions import Binary, BooleanType, EnumType, EnumValue, Expression, StateTest, Unary, VariableRead
from robosc.model.structure import Assumption, Deployment, Detour, Goal, GoalForm, Mission, Model, Preference
from robosc.strategies import synthesize_strategy
from robosc.supervisor import Supervisor
from support.random_controllers import random_controller


def strategic_controller(seed: int) -> Supervisor | None:
    """Return the supervisor of a random robot with goals and missions that can be reached, or None if they cannot.

    It may keep its assumptions from coming true.
    """
    supervisor = random_controller(seed)
    if supervisor is None:
        return None
    model = with_random_goals(supervisor.model, Random(seed))
    allowed = tuple(msgspec.structs.replace(item, is_allowed=True) for item in model.assumptions)
    model = msgspec.structs.replace(model, assumptions=allowed)
    executable = ExecutableSystem(model, Deployment.CONTROLLER)
    strategy = synthesize_strategy(executable, supervisor.added).strategy
    if strategy is None:
        return None
    certificate = msgspec.structs.replace(supervisor.certificate, goals="not checked")
    return msgspec.structs.replace(supervisor, model=model, strategy=strategy, certificate=certificate)


def with_random_goals(model: Model, dice: Random) -> Model:
    """Return a robot with up to three goals, up to two missions, preferences and up to two assumptions.

    One in two has no missions, and one in five that has some has no goals.
    """

    def item(kind: type[Goal] | type[Assumption], forms: list[GoalForm]) -> Goal | Assumption:
        form = dice.choice(forms)
        trigger = _condition(model, dice) if form is GoalForm.LEADS_TO else None
        return kind(form, _condition(model, dice), trigger)

    goals = tuple(item(Goal, list(GoalForm)) for _ in range(dice.randint(1, 3)))
    if dice.random() < 0.5:
        # A component that has to be in one state again and again, and in another one, must move.
        goals = _rounds(model, dice)
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
    if dice.random() < 0.5:
        visits = tuple(goal.condition for goal in _rounds(model, dice))
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


def _rounds(model: Model, dice: Random) -> tuple[Goal, ...]:
    component = dice.choice([item for item in model.components if item.behaviour])
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
