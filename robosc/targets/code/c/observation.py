"""Generated function that takes in a stable state: goals and assumptions as bits of words, all of a word at once."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from robosc.automata.goal_memory import MEMORY, holds, judgement
from robosc.expressions import EnumType, Expression, StateTest, VariableRead, leaves
from robosc.expressions.evaluate import evaluate
from robosc.model.structure import Assumption, Goal, GoalForm
from robosc.targets.code.c.layout import Layout
from robosc.targets.code.c.naming import CNamer
from robosc.targets.code.c.statements import unused
from robosc.targets.code.c.unit import Reading, Unit
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, Code, Sort, integer, literal, operation, variable
from robosc.targets.code.statements import Assign, Let, Statement
from robosc.targets.code.strategy import observing, seen
from robosc.targets.text import indent

_WORD = 32

IS_SEEN = """\
/* Whether something is seen in a stable state: bit `number`. */
static bool is_seen(const uint32_t *seen, int number)
{
    return (seen[(unsigned)number / 32U] >> ((unsigned)number % 32U) & 1U) != 0;
}""".splitlines()


class _Judged(NamedTuple):
    """A goal or an assumption.

    Attributes:
        number: Number of its bit among what is seen.
        item: As it is written.
        name: Its name.
    """

    number: int
    item: Goal | Assumption
    name: str

    @property
    def bit(self) -> int:
        """Bit of it in its word."""
        return 1 << self.number % _WORD

    @property
    def place(self) -> str | None:
        """Name of its place of the memory; None: it needs none."""
        place = judgement(self.item, self.name).place
        return None if place is None else place.name


def _judged(layout: Layout) -> list[_Judged]:
    model, aims = layout.model, len(layout.executable.obligations.aims)
    goals = [_Judged(number, item, f"goal {number + 1}") for number, item in enumerate(model.goals)]
    assumptions = enumerate(model.assumptions)
    return [*goals, *(_Judged(aims + number, item, f"assumption {number + 1}") for number, item in assumptions)]


def remembered_places(layout: Layout) -> list[str]:
    """Return the places of the memory that the state has members for, if there is a strategy.

    Of goals and assumptions, what is seen tells as much: only those that the strategy reads have members.
    """
    strategy = layout.supervisor.strategy
    if strategy is None:
        return []
    nodes = (node for mode in strategy.modes for choice in mode for node in choice.condition.nodes)
    read = {node.variable for node in nodes if node.automaton == MEMORY}
    told = {item.place for item in _judged(layout)} - read
    return [place.name for place in layout.executable.obligations.places if place.name not in told]


def observation(unit: Unit) -> list[list[str]]:
    """Return what is seen before the first stable state, and the function that takes in each."""
    judged = _judged(unit.layout)
    scope, conditions = Reading(unit), seen(unit.layout.executable, Reading(unit))
    words = -(-len(conditions) // _WORD)
    nothing = [_mask(_of(judged, word), GoalForm.LEADS_TO) for word in range(words)]
    namer = CNamer(frozenset({"s", "before", "seen"}))
    writer = _Words(unit, scope, namer)
    block: list[Statement] = [*unused("s", "before")]
    for word in range(words):
        block += writer.judged(word, _of(judged, word))
    told = {item.number for item in judged}
    places = {item.place for item in judged if item.place is not None}
    block += observing(unit.layout.executable, scope, namer, besides=places)
    block += [
        Assign(variable(f"seen[{number // _WORD}]"), operation("if", code, _hex(1 << number % _WORD), integer(0)), "|")
        for number, code in enumerate(conditions)
        if number not in told
    ]
    head = "static void observe_for_strategy(state_t *s, const uint32_t *before, uint32_t *seen)"
    first, brace, *rest = unit.definition(head, block)
    values = ", ".join(_hex(item).word for item in nothing)
    return [
        [
            "/* What counts as seen before the first stable state: nothing is owed. */",
            f"static const uint32_t NOTHING_OWED[] = {{{values}}};",
        ],
        [
            "/* Take in a stable state. `before`: what was seen in the one before; `seen`: all zeros. */",
            *(first, brace, *indent(writer.tables), *rest),
        ],
    ]


def _is_true(condition: Expression, value: str) -> bool:
    """Return True if a condition is true where all that it reads has a value."""
    return evaluate(condition, lambda _component, _variable: value, lambda _automaton: value) is True


def _of(judged: Iterable[_Judged], word: int) -> list[_Judged]:
    return [item for item in judged if item.number // _WORD == word]


def _mask(judged: Iterable[_Judged], form: GoalForm) -> int:
    return sum(item.bit for item in judged if item.item.form is form)


def _hex(bits: int) -> Code:
    return literal(f"UINT32_C({bits:#x})", Sort.INTEGER)


class _Words:
    """Writer of the words of goals and assumptions.

    Args:
        unit: The file.
        scope: Writer of expressions over the state.
        namer: Namer of the function.

    Attributes:
        tables: Declarations of tables so far.
    """

    def __init__(self, unit: Unit, scope: Reading, namer: CNamer) -> None:
        self._layout = unit.layout
        self._scope = scope
        self._namer = namer
        self.tables: list[str] = []

    def judged(self, word: int, judged: Sequence[_Judged]) -> Iterator[Statement]:
        """Yield the statements that judge the goals and assumptions of a word."""
        if not judged:
            return
        always, once, owing = (_mask(judged, form) for form in _FORMS)
        before, seen_word = f"before[{word}]", variable(f"seen[{word}]")
        met = self._named("met", word)
        yield from self._collected(met, [(item.bit, holds(item.item.condition)) for item in judged])
        if always:
            yield Assign(seen_word, _bits(f"{met.word} & {_hex(always).word}"), "|")
        if once:
            yield Assign(seen_word, _bits(f"({before} | {met.word}) & {_hex(once).word}"), "|")
        if owing:
            asked, owed = self._named("asked", word), self._named("owed", word)
            answers = [item for item in judged if item.item.form is GoalForm.LEADS_TO]
            triggers = ((item.bit, item.item.trigger) for item in answers)
            conditions = [(bit, None if trigger is None else holds(trigger)) for bit, trigger in triggers]
            yield from self._collected(asked, conditions)
            mask = _hex(owing).word
            yield Let(owed, _bits(f"((~{before} & {mask}) | {asked.word}) & ~{met.word}"), "const uint32_t")
            yield Assign(seen_word, _bits(f"~{owed.word} & {mask}"), "|")
        yield from self._remembered(judged, seen_word.word)

    def _remembered(self, judged: Iterable[_Judged], seen_word: str) -> Iterator[Statement]:
        places = remembered_places(self._layout)
        for item in judged:
            if item.place in places:
                test = "==" if item.item.form is GoalForm.LEADS_TO else "!="
                value = _bits(f"({seen_word} & {_hex(item.bit).word}) {test} 0")
                yield Assign(self._scope.variable_place(MEMORY, item.place), value)

    def _named(self, kind: str, word: int) -> Code:
        return variable(self._namer.name(kind if word == 0 else f"{kind}_{word}"))

    def _collected(self, target: Code, conditions: Iterable[tuple[int, Expression | None]]) -> Iterator[Statement]:
        """Yield the statements that collect the bits whose conditions are true; None is true."""
        fixed = 0
        tables: dict[Code, dict[str, int]] = {}
        others: list[tuple[int, Code]] = []
        for bit, condition in conditions:
            code = TRUE_CODE if condition is None else self._scope.truth(condition)
            values = None if condition is None else self._truths(condition)
            if code == TRUE_CODE:
                fixed |= bit
            elif values is not None:
                subject, truths = values
                table = tables.setdefault(subject, dict.fromkeys(truths, 0))
                for value, is_true in truths.items():
                    table[value] |= bit if is_true else 0
            elif code != FALSE_CODE:
                others.append((bit, code))
        yield Let(target, _hex(fixed), "uint32_t")
        for subject, table in tables.items():
            yield Assign(target, operation("item", variable(self._table(target, subject, table)), subject), "|")
        for bit, code in others:
            yield Assign(target, operation("if", code, _hex(bit), integer(0)), "|")

    def _table(self, target: Code, subject: Code, table: Mapping[str, int]) -> str:
        """Declare a table of bits, and return its name."""
        name = self._namer.name(f"{target.word}_by_{subject.word.rpartition('>')[2]}")
        entries = ", ".join(f"[{value}] = {_hex(bits).word}" for value, bits in table.items())
        self.tables.append(f"static const uint32_t {name}[] = {{{entries}}};")
        return name

    def _truths(self, condition: Expression) -> tuple[Code, dict[str, bool]] | None:
        """Return a location or an enum, and for each of its values if a condition is true, if it reads that alone."""
        read = {
            (leaf.component, leaf.variable if isinstance(leaf, VariableRead) else None)
            for leaf in leaves(condition)
            if isinstance(leaf, VariableRead | StateTest)
        }
        if len(read) != 1:
            return None
        ((component, name),) = read
        layout = self._layout
        if name is None:
            if component not in layout.locations:
                return None
            names = {value: text for (owner, value), text in layout.location_names.items() if owner == component}
            subject = self._scope.location_place(component)
        else:
            _, type_ = layout.variables[component, name]
            if not isinstance(type_, EnumType):
                return None
            names = {value: layout.values[type_.name, value] for value in type_.values}
            subject = self._scope.variable_place(component, name)
        return subject, {text: _is_true(condition, value) for value, text in names.items()}


_FORMS = (GoalForm.ALWAYS_EVENTUALLY, GoalForm.ONCE, GoalForm.LEADS_TO)


def _bits(text: str) -> Code:
    return literal(text, Sort.INTEGER)
