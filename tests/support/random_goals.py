"""Random goals and assumptions for a robot that is there already."""

from random import Random

import msgspec

from robosc.automata import ExecutableSystem
from robosc.expressions import Binary, BooleanType, EnumType, EnumValue, Expression, StateTest, Unary, VariableRead
from robosc.model.structure import Assumption, Deployment, Goal, GoalForm, Model
from robosc.strategies import synthesize_strategy
from robosc.supervisor import Supervisor
from support.random_controllers import random_controller


def strategic_controller(seed: int) -> Supervisor | None:
    """Return the supervisor of a random robot with goals that can be reached, or None if they cannot.

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
    """Return a robot with one to three goals and up to two assumptions."""

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
    return msgspec.structs.replace(model, goals=goals, assumptions=assumptions)


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
