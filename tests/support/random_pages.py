"""Random models for documentation, with the names, texts and shapes that could break a page.

They need not make sense as robots: a page is made from any value of the model's types. A model is drawn
from a seed with `random.Random`.
"""

from random import Random

from hypothesis import strategies as st

from robosc.expressions import (
    Binary,
    BinaryOperator,
    BooleanType,
    Constant,
    DoubleType,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    ObjectType,
    StateTest,
    StringType,
    Type,
    Unary,
    Value,
    VariableRead,
)
from robosc.model.structure import (
    EVENT_KINDS,
    Behaviour,
    Communication,
    CommunicationKind,
    Component,
    EnumDefinition,
    EnumRule,
    Interface,
    Invariant,
    Model,
    ObjectDefinition,
    ObjectValue,
    Property,
    Provide,
    Requirement,
    RequirementForm,
    State,
    Transition,
    Update,
    Variable,
)
from support.failing import made, model_files

NAMES = (
    "end", "state", "note", "End", "END", "END_", "_end", "__init__", "_", "direction", "class", "classDef", "any",
    "fork", "join", "choice", "hide", "as", "s1", "default", "stateDiagram", "a_b", "x" * 255,
)  # fmt: skip

TEXTS = (
    "/scan", "a|b", "`", "``` ", "a\nb", "<b>x</b>", "&amp;", "\\", "\\|", "| --- |", " lead", "trail ", "a  b", "#35;",
    "[x](http://x.y)", "--> s1 : x", '"', "*/ [*] %% ; end", "\u202eabc", "\u2028", "\r\n```\n", "🤖 ü", "\x00",
    "$x$", "~~a~~", "http://a.b", "_a_", "{}", "é" * 255, "<!--", "</code>", "%%{init: {}}%%",
)  # fmt: skip

COLOUR = EnumType("Colour", ("red", "green"))
TWIST = ObjectType("Library.Twist")


def models() -> st.SearchStrategy[Model]:
    """Models with hostile names and texts."""
    return st.integers(0, 2**32 - 1).map(_of_seed)


def _of_seed(seed: int) -> Model:
    model = _Builder(Random(seed)).model()
    made("random_page", seed, lambda: model_files(model))
    return model


class _Builder:
    def __init__(self, random: Random) -> None:
        self._random = random

    def model(self) -> Model:
        random = self._random
        names = random.sample(NAMES, random.randint(1, 4))
        communications = tuple(
            self._communication(f"{name}_{number}"[-255:], random.choice(names))
            for number, name in enumerate(random.choices(NAMES, k=random.randint(0, 5)))
        )
        components = tuple(Component(name, self._behaviour(name, communications)) for name in names)
        sendable = [item.name for item in communications]
        provides = [self._provide(random.choice(sendable)) for _ in range(random.randint(0, 4)) if sendable]
        return Model(
            name=random.choice(NAMES),
            components=components,
            communications=communications,
            enums=(self._enum(),),
            objects=(ObjectDefinition(TWIST.name, tuple(Property(item, DoubleType()) for item in names[:2])),),
            requirements=tuple(self._requirement(sendable) for _ in range(random.randint(0, 3)) if sendable),
            provides=tuple(provides),
            invariants=tuple(
                Invariant(random.random() < 0.5, self._expression(2)) for _ in range(random.randint(0, 2))
            ),
        )

    def _text(self) -> str:
        return "".join(self._random.choices(TEXTS, k=self._random.randint(1, 2)))[:255]

    def _communication(self, name: str, component: str) -> Communication:
        random = self._random
        kind = random.choice(list(CommunicationKind))
        type_ = random.choice((BooleanType(), COLOUR, TWIST))
        return Communication(
            name,
            component,
            kind,
            self._text(),
            request=None if kind is CommunicationKind.OUTGOING_MESSAGE else type_,
            response=None if kind is CommunicationKind.INCOMING_MESSAGE else type_,
            feedback=type_ if kind is CommunicationKind.ACTION else None,
            interface=Interface("Twist", "geometry_msgs"),
            max_age=random.choice((None, 0.5)),
            frame=random.choice((None, "", self._text())),
            when=random.choice((None, self._expression(2))),
        )

    def _behaviour(self, component: str, communications: tuple[Communication, ...]) -> Behaviour | None:
        random = self._random
        if random.random() < 0.2:
            return None
        names = random.sample(NAMES, random.randint(1, 5))
        states = tuple(State(name, number == 0, random.random() < 0.5) for number, name in enumerate(names))
        variables = tuple(self._variable(f"v{number}") for number in range(random.randint(0, 3)))
        events = [item.event(kind) for item in communications for kind in EVENT_KINDS[item.kind]]
        transitions = []
        for number in range(random.randint(0, random.choice((6, 6, 6, 130)))):
            is_tau = not events or random.random() < 0.3
            transitions.append(
                Transition(
                    source=random.choice((None, *names)),
                    event=f"{component}.tau_{number + 1}" if is_tau else random.choice(events),
                    guard=self._expression(3) if is_tau else None,
                    updates=tuple(
                        Update(item.name, self._expression(2)) for item in variables if random.random() < 0.3
                    ),
                    target=random.choice((None, *names)),
                )
            )
        return Behaviour(variables, states, tuple(transitions))

    def _variable(self, name: str) -> Variable:
        random = self._random
        choices: tuple[tuple[Type, Value], ...] = (
            (BooleanType(), True),
            (COLOUR, "green"),
            (StringType(), self._text()),
            (StringType(), ""),
            (IntegerType(-3, 3), -2),
            (DoubleType(), 1e-300),
        )
        type_, initial = random.choice(choices)
        return Variable(name, type_, initial, random.random() < 0.5)

    def _enum(self) -> EnumDefinition:
        rules = tuple(EnumRule(self._expression(2), "red") for _ in range(self._random.randint(0, 2)))
        return EnumDefinition(COLOUR.name, StringType(), COLOUR.values, rules, "green")

    def _requirement(self, names: list[str]) -> Requirement:
        chosen = tuple(self._random.sample(names, self._random.randint(1, len(names))))
        return Requirement(chosen, self._random.choice(list(RequirementForm)), self._expression(3))

    def _provide(self, name: str) -> Provide:
        value = ObjectValue((("linear", ObjectValue((("x", self._expression(1)),))), ("end", ObjectValue(()))))
        return Provide(
            name,
            self._random.choice((value, self._expression(2))),
            self._random.choice((None, self._expression(2))),
        )

    def _expression(self, depth: int) -> Expression:
        random = self._random
        if depth == 0 or random.random() < 0.3:
            return random.choice(
                (
                    Constant(self._text()),
                    Constant(-1.5),
                    EnumValue(COLOUR.name, "red"),
                    StateTest(random.choice(NAMES), random.choice(NAMES)),
                    VariableRead(random.choice(NAMES), "v1"),
                )
            )
        if random.random() < 0.2:
            return Unary("not", self._expression(depth - 1))
        operators: tuple[BinaryOperator, ...] = ("and", "or", "=", "<", "implies", "+", "*", "/")
        operator = random.choice(operators)
        return Binary(operator, self._expression(depth - 1), self._expression(depth - 1))
