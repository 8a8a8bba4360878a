"""Random goals and assumptions for a robot that is there already."""

from random import Random

import msgspec

from robosc.automata import ExecutableSystem, to_automata
from robosc.expressions import Binary, BooleanType, EnumType, EnumValue, Expression, StateTest, Unary, VariableRead
from robosc.model.structure import Assumption, Component, Deployment, Goal, GoalForm, Model
from robosc.strategies import synthesize_strategy
from robosc.supervisor import Supervisor
from robosc.synthesis import SynthesisStatus, synthesize
from support.execution import supervisor_of
from support.failing import made, model_files
from support.random_controllers import random_controller
from support.random_errands import random_errands


def strategic_controller(seed: int) -> Supervisor | None:
    """Return the supervisor of a random robot with goals that can be reached, or None if they cannot.

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
    """Return a robot with one to three goals and up to two assumptions."""

    def item(kind: type[Goal] | type[Assumption], forms: list[GoalForm]) -> Goal | Assumption:
        form = dice.choice(forms)
        trigger = _condition(model, dice) if form is GoalForm.LEADS_TO else None
        return kind(form, _condition(model, dice), trigger)

    goals = tuple(item(Goal, list(GoalForm)) for _ in range(dice.randint(1, 3)))
    moving = [item for item in model.components if item.behaviour and len(item.behaviour.states) > 1]
    if moving and dice.random() < 0.5:
        # A component that has to be in one state again and again, and in another one, must move.
        goals = _rounds(dice.choice(moving), dice)
    owed = [GoalForm.ALWAYS_EVENTUALLY, GoalForm.LEADS_TO]
    assumptions = tuple(item(Assumption, owed) for _ in range(dice.randint(0, 2)))
    return msgspec.structs.replace(model, goals=goals, assumptions=assumptions)


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
