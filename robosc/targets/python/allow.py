"""Generated methods that tell whether a controllable event is allowed now."""

from robosc.automata.plants import communication_plant_name
from robosc.expressions import (
    TRUE,
    Expression,
    IntegerType,
    StateTest,
    conjuncts,
)
from robosc.expressions.text import expression_text
from robosc.model.structure import Behaviour, EventKind, Transition, Variable, is_tau
from robosc.targets.events import has_plant_location, plant_step, split, taken_transition
from robosc.targets.python.expressions import (
    FALSE_CODE,
    TRUE_CODE,
    Code,
    Precedence,
    Unknown,
    both,
    either,
    falsity,
    negated,
    truth,
    value,
)
from robosc.targets.python.text import comment, docstring, indent
from robosc.targets.python.writer import Writer
from robosc.targets.words import requirement_text

Condition = tuple[str, Code]
"""Words that explain a condition, and its code."""


def allow_method(writer: Writer, event: str) -> list[str]:
    """The method that tells whether `event` is allowed: plants, ranges, requirements, then the supervisor."""
    conditions = [item for item in _conditions(writer, event) if item[1] != TRUE_CODE]
    return [
        f"def {writer.layout.methods['allow', event]}(self):",
        f"    {docstring(f'Whether {event} is allowed now.')}",
        *indent(_return_all(conditions)),
    ]


def requirements_method(writer: Writer, communication: str) -> list[str]:
    """The method that tells for each requirement whether it holds."""
    requirements = writer.model.requirements_on(communication)
    body = []
    for requirement in requirements:
        body += comment(requirement_text(requirement))
        body.append(f"{truth(requirement.condition, writer.scope).text},")
    return _tuple_method(writer, ("requirements", communication), f"Which requirements on {communication} hold.", body)


def conjuncts_method(writer: Writer, communication: str) -> list[str]:
    """The method that tells for each top-level conjunct of the requirements whether it holds."""
    body = [
        f"{truth(part, writer.scope).text},"
        for requirement in writer.model.requirements_on(communication)
        for part in conjuncts(requirement.condition)
    ]
    words = f"Which top-level conjuncts of the requirements on {communication} hold."
    return _tuple_method(writer, ("conjuncts", communication), words, body)


def _tuple_method(writer: Writer, key: tuple[str, str], words: str, body: list[str]) -> list[str]:
    result = ["return (", *indent(body), ")"] if body else ["return ()"]
    return [f"def {writer.layout.methods[key]}(self):", f"    {docstring(words)}", *indent(result)]


def _return_all(conditions: list[Condition]) -> list[str]:
    if not conditions:
        return ["return True"]
    lines = ["return ("]
    for place, (words, code) in enumerate(conditions):
        text = code.text if len(conditions) == 1 else code.within(Precedence.AND)
        lines += indent([*comment(words), text if place == 0 else f"and {text}"])
    return [*lines, ")"]


def accepted(writer: Writer, event: str) -> list[Condition]:
    """Where the behaviours accept a controllable event, without leaving a range of a synthesis variable."""
    if is_tau(event):
        return _tau_conditions(writer, event)
    return [
        condition
        for component, behaviour in writer.layout.behaviours
        for condition in _component_conditions(writer, component, behaviour, event)
    ]


def _conditions(writer: Writer, event: str) -> list[Condition]:
    name, kind = split(event)
    result: list[Condition] = []
    if is_tau(event):
        result.append(_changes_something(writer, event))
    else:
        communication = writer.model.communication(name)
        if has_plant_location(communication):
            sources, _ = plant_step(communication, EventKind(kind))
            plant = communication_plant_name(communication)
            result.append((f"{plant} is {' or '.join(sources)}", _in_one_of(writer, plant, sources)))
    result += accepted(writer, event)
    if kind == EventKind.REQUEST:
        result += [
            (requirement_text(item), truth(item.condition, writer.scope)) for item in writer.model.requirements_on(name)
        ]
    elif kind == EventKind.CANCEL:
        result += _cancel_condition(writer, name)
    return [*result, *_added_condition(writer, event)]


def _cancel_condition(writer: Writer, action: str) -> list[Condition]:
    """Cancel only where at least one requirement does not hold; without requirements, and as a layer, anywhere."""
    requirements = writer.model.requirements_on(action)
    if not requirements or writer.layout.supervisor.deployment == "layer":
        return []
    all_hold = TRUE_CODE
    for requirement in requirements:
        all_hold = both(all_hold, truth(requirement.condition, writer.scope))
    return [("at least one of the action's requirements does not hold", negated(all_hold))]


def _tau(writer: Writer, event: str) -> tuple[str, Transition]:
    """The component and the transition of a tau."""
    component, _ = split(event)
    behaviour = next(item for name, item in writer.layout.behaviours if name == component)
    return component, next(item for item in behaviour.transitions if item.event == event)


def _tau_conditions(writer: Writer, event: str) -> list[Condition]:
    component, transition = _tau(writer, event)
    code = TRUE_CODE
    if transition.source is not None:
        code = truth(StateTest(component, transition.source), writer.scope)
    guard = transition.guard if transition.guard is not None else TRUE
    source = f"in {transition.source}: " if transition.source else ""
    condition = f" if {expression_text(guard)}" if transition.guard is not None else ""
    target = f" goto {transition.target}" if transition.target else ""
    return [(f"{component}: {source}transition{condition}{target}", both(code, truth(guard, writer.scope)))]


def _changes_something(writer: Writer, event: str) -> Condition:
    """A tau that would change nothing is not taken."""
    component, transition = _tau(writer, event)
    if transition.target is None or transition.target == transition.source:
        return "it would change nothing", FALSE_CODE
    if transition.source is not None:
        return "", TRUE_CODE
    return f"{component} is elsewhere", falsity(StateTest(component, transition.target), writer.scope)


def _in_one_of(writer: Writer, automaton: str, names: tuple[str, ...]) -> Code:
    if len(names) == 1:
        return truth(StateTest(automaton, names[0]), writer.scope)
    return Code(f"{writer.scope.location(automaton)} in {names!r}", Precedence.COMPARISON)


def _component_conditions(writer: Writer, component: str, behaviour: Behaviour, event: str) -> list[Condition]:
    """Where a component accepts a request, and that no update of a synthesis variable leaves its range."""
    if not any(item.event == event for item in behaviour.transitions):
        return []
    chosen = {state.name: taken_transition(behaviour, event, state.name) for state in behaviour.states}
    accepting = tuple(state for state, transition in chosen.items() if transition is not None)
    result: list[Condition] = []
    if len(accepting) < len(chosen) and split(event)[1] == EventKind.REQUEST:
        words = f"{component} accepts it in {', '.join(accepting)}"
        result.append((words, _in_one_of(writer, component, accepting)))
    for state in accepting:
        transition = chosen[state]
        if transition is not None:
            result += _range_conditions(writer, component, behaviour, state, transition)
    return result


def _range_conditions(
    writer: Writer, component: str, behaviour: Behaviour, state: str, transition: Transition
) -> list[Condition]:
    variables = {variable.name: variable for variable in behaviour.variables}
    result = []
    for update in transition.updates:
        fits = _fits(writer, variables[update.variable], update.expression)
        if fits == TRUE_CODE:
            continue
        if len(behaviour.states) > 1:
            fits = either(falsity(StateTest(component, state), writer.scope), fits)
        words = f"{component}.{update.variable} := {expression_text(update.expression)} stays in its range"
        result.append((words, fits))
    return result


def _fits(writer: Writer, variable: Variable, expression: Expression) -> Code:
    """Whether an update keeps a synthesis variable in its range; an unknown value leaves the variable alone."""
    if not variable.is_synthesis or not isinstance(variable.type, IntegerType):
        return TRUE_CODE
    low, high = variable.type.low, variable.type.high
    code = value(expression, writer.scope)
    if low is None or high is None:
        return TRUE_CODE
    if code.unknown is not Unknown.NEVER:
        writer.used.add("stays_in_range")
        return Code(f"stays_in_range({code.text}, {low}, {high})")
    if low <= code.low and code.high <= high:
        return TRUE_CODE
    return Code(f"{low} <= {code.within(Precedence.SUM)} <= {high}", Precedence.COMPARISON)


def _added_condition(writer: Writer, event: str) -> list[Condition]:
    diagram = writer.layout.supervisor.added_condition(event)
    if diagram is None:
        return []
    words, code = writer.diagrams.condition(diagram)
    return [(f"added by the supervisor: {words}", code)]
