"""Robots with missions for tests: conditions are written as goals, and then become visits."""

from collections.abc import Callable, Sequence
from typing import Any

import msgspec

from robosc.automata import ExecutableSystem, to_automata
from robosc.expressions import Expression
from robosc.model.structure import Deployment, Model
from robosc.strategies import StrategyResult, synthesize_strategy
from robosc.supervisor import Supervisor
from robosc.synthesis import SynthesisStatus, synthesize
from support.execution import supervisor_of
from support.models import model_of


def with_conditions(text: str, conditions: Sequence[str], **parts: Callable[[Sequence[Expression]], Any]) -> Model:
    """Return the model of a text with other parts, which are made of conditions over its states.

    Args:
        text: Text of a robot.
        conditions: The conditions, as a user writes them.
        parts: Functions from the conditions to the parts, by their names: `missions`, `goals`, `preferences`.
    """
    lines = "".join(f"goal once {item}\n" for item in conditions)
    model = model_of(text.rstrip().removesuffix("}") + lines + "}\n")
    split = len(model.goals) - len(conditions)
    found = [goal.condition for goal in model.goals[split:]]
    plain: dict[str, Any] = {"goals": model.goals[:split]}
    return msgspec.structs.replace(model, **(plain | {name: make(found) for name, make in parts.items()}))


def strategy_result(model: Model) -> StrategyResult:
    """Return the result of synthesizing a strategy for a model that has a supervisor."""
    result = synthesize(to_automata(model, Deployment.CONTROLLER))
    assert result.status is not SynthesisStatus.EMPTY
    return synthesize_strategy(ExecutableSystem(model, Deployment.CONTROLLER), result.added)


def strategic(model: Model) -> Supervisor:
    """Return the supervisor of a model whose goals and missions can be reached."""
    result = synthesize(to_automata(model, Deployment.CONTROLLER))
    strategy = strategy_result(model).strategy
    assert strategy is not None
    supervisor = supervisor_of(model, added=result.added)
    certificate = msgspec.structs.replace(supervisor.certificate, goals="not checked")
    return msgspec.structs.replace(supervisor, strategy=strategy, certificate=certificate)
