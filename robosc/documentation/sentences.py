"""Requirements, goals, missions, data of requests and rules of enums in sentences."""

from collections.abc import Sequence

from robosc.documentation.markdown import blocks, bullets, code, codes
from robosc.expressions import Binary, BinaryOperator, Expression, Type, type_text
from robosc.expressions.text import expression_text
from robosc.model.structure import (
    Assumption,
    EnumDefinition,
    Goal,
    GoalForm,
    Invariant,
    Limit,
    Mission,
    ObjectValue,
    Preference,
    Provide,
    ProvidedValue,
    Requirement,
    RequirementForm,
)


def requirement_sentence(requirement: Requirement) -> str:
    """Describe a requirement in a sentence, with a list below where several conditions play together."""
    subject = f"{codes(requirement.communications)} {'is' if len(requirement.communications) == 1 else 'are'}"
    if requirement.form is RequirementForm.NEEDS:
        start, joint = f"{subject} requested only while", _joined(requirement.expression, "and")
        return _listed(start, "all of these hold", joint)
    start, joint = f"{subject} never requested while", _joined(requirement.expression, "or")
    return _listed(start, "any of these holds", joint)


def invariant_sentence(invariant: Invariant) -> str:
    """Describe a state invariant in a sentence, with a list below where it has several parts."""
    if invariant.is_never:
        return _listed("There is never a state with", "any of these", _joined(invariant.expression, "or"))
    return _listed("There are only states with", "all of these", _joined(invariant.expression, "and"))


def goal_sentence(goal: Goal) -> str:
    """Describe a goal in a sentence, with a list below where its condition has several parts."""
    conditions = _joined(goal.condition, "and")
    if goal.trigger is not None:
        trigger = code(expression_text(goal.trigger))
        return _listed(f"Whenever {trigger} held, the robot reaches later, or at once,", _ALL_AT_ONCE, conditions)
    often = "at least once" if goal.form is GoalForm.ONCE else "again and again"
    return _listed(f"The robot reaches {often}", _ALL_AT_ONCE, conditions)


def assumption_sentence(assumption: Assumption) -> str:
    """Describe an assumption in a sentence, with a list below where its condition has several parts."""
    conditions = _joined(assumption.condition, "and")
    allowed = ", unless the robot itself keeps it from coming true," if assumption.is_allowed else ""
    if assumption.trigger is not None:
        trigger = code(expression_text(assumption.trigger))
        start = f"Whenever {trigger} held, the surroundings bring about later, or at once{allowed or ','}"
    else:
        start = f"The surroundings bring about again and again{allowed}"
    return _listed(start, _ALL_AT_ONCE, conditions)


def mission_sentences(mission: Mission) -> str:
    """Describe a mission in sentences: its visits in their order, then its detours."""
    start = f"{code(mission.name)}: "
    if mission.condition is not None:
        start += f"While {code(expression_text(mission.condition))}, the robot reaches, round after round, "
    else:
        start += "The robot reaches, round after round, "
    texts = [f"{start}{_in_turn(mission.visits)}."]
    texts += [
        f"Whenever {code(expression_text(detour.trigger))}, it first reaches {_in_turn(detour.visits)}."
        for detour in mission.detours
    ]
    return " ".join(texts)


def _in_turn(visits: Sequence[Expression]) -> str:
    """Conditions that are reached one after the other."""
    return ", then ".join(code(expression_text(visit)) for visit in visits)


def preference_sentence(preference: Preference) -> str:
    """Describe a preference in a sentence."""
    if not preference.preferred or not preference.others:
        return "A preference without effect: one of its sides names no request."
    verb = "is" if len(preference.preferred) == 1 else "are"
    others = codes(preference.others)
    return f"{codes(preference.preferred)} {verb} requested rather than {others}, where both lead nearer to a goal."


_ALL_AT_ONCE = "a state where all of these hold"


def _joined(expression: Expression, operator: BinaryOperator) -> tuple[Expression, ...]:
    """The operands of the outermost `operator`s, in order; the expression alone where there is none."""
    stack, found = [expression], []
    while stack:
        match stack.pop():
            case Binary(operator=outermost, left=left, right=right) if outermost == operator:
                stack += [right, left]
            case operand:
                found.append(operand)
    return tuple(found)


def _listed(start: str, meaning: str, conditions: Sequence[Expression]) -> str:
    texts = [code(expression_text(condition)) for condition in conditions]
    return f"{start} {texts[0]}." if len(texts) == 1 else f"{start} {meaning}:\n{bullets(texts, depth=1)}"


def provide_sentences(communication: str, provides: Sequence[Provide]) -> str:
    """Describe the data that a request carries: one sentence, or a list of the cases in their order."""
    statements = list(provides)
    # Statements behind one without condition never give the data.
    final = next((number for number, item in enumerate(statements) if item.condition is None), None)
    reached = statements if final is None else statements[: final + 1]
    if final == 0:
        return f"{code(communication)} is sent with {_data(reached[0].value)}."
    cases = [
        f"{_data(item.value)} if {code(expression_text(item.condition))}"
        if item.condition
        else f"otherwise {_data(item.value)}"
        for item in reached
    ]
    if final is None:
        cases.append("otherwise the default of the middleware")
    return f"{code(communication)} is sent with the first of these that applies:\n{bullets(cases, depth=1)}"


def limit_sentence(limit: Limit) -> str:
    """Describe a limit: the bounds of each number, and when they apply."""
    bounds = ", ".join(
        code(f"{'.'.join((limit.communication, *item.path))}: {item.low}..{item.high}") for item in limit.bounds
    )
    condition = "" if limit.condition is None else f" if {code(expression_text(limit.condition))}"
    return f"numbers of {code(limit.communication)} are moved into {bounds}{condition}"


def _data(value: ProvidedValue) -> str:
    return code(value_text(value))


def value_text(value: ProvidedValue) -> str:
    """Data as a user writes it."""
    if not isinstance(value, ObjectValue):
        return expression_text(value)
    inner = ", ".join(f"{name}: {value_text(part)}" for name, part in value.properties)
    return f"{{ {inner} }}" if inner else "{ }"


def enum_sentences(enum: EnumDefinition) -> str:
    """Describe how received data becomes a value of the enum."""
    start = f"Made from a received {code(type_text(enum.source))}"
    otherwise = f"otherwise {code(enum.default)}"
    if not enum.rules:
        return f"{start}: always {code(enum.default)}."
    rules = [f"{code(rule.value)} if {code(expression_text(rule.condition))}" for rule in enum.rules]
    return blocks(f"{start}. The first that applies:", bullets([*rules, otherwise]))


def type_cell(type_: Type | None) -> str:
    """A type for a cell of a table; empty where there is none."""
    return "" if type_ is None else code(type_text(type_))
