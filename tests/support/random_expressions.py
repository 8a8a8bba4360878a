"""Random well-typed expressions over one small system, with everything that can make a value unknown."""

from hypothesis import strategies as st

from robosc.automata import Automaton, DiscreteVariable, Edge, Event, InputVariable, System
from robosc.expressions import (
    Binary,
    BinaryOperator,
    BooleanType,
    Call,
    Conditional,
    Constant,
    EnumType,
    EnumValue,
    Expression,
    Function,
    IntegerType,
    Received,
    StateTest,
    Unary,
    VariableRead,
    children,
)

COLOUR = EnumType("Colour", ("red", "green", "blue"))
SMALL, WIDE = IntegerType(-2, 3), IntegerType(2147483640, 2147483647)

SYSTEM = System(
    name="Expressions",
    events=(Event("e", False),),
    automata=(
        Automaton(
            name="A",
            locations=("on", "off", "broken"),
            initial=("on",),
            marked=frozenset({"on"}),
            alphabet=frozenset({"e"}),
            edges=(Edge("on", "e", "off"), Edge("off", "e", "broken")),
            variables=(
                DiscreteVariable("flag", BooleanType(), (False,)),
                DiscreteVariable("small", SMALL, (0,)),
                DiscreteVariable("wide", WIDE, (2147483640,)),
                DiscreteVariable("colour", COLOUR, ("red",)),
            ),
        ),
    ),
    inputs=(
        InputVariable("e", ("list", 1), IntegerType(0, 2), may_be_unknown=True),
        InputVariable("e", ("seen",), BooleanType()),
    ),
)

_whole = st.one_of(
    st.sampled_from([VariableRead("A", "small"), VariableRead("A", "wide"), Received(("list", 1))]),
    st.sampled_from([-1, 0, 1, 2, 7, 2147483647, -2147483648]).map(Constant),
)
_double = st.sampled_from([0.0, 0.5, -1.5, 2.0]).map(Constant)


_kinds: st.SearchStrategy[Function] = st.sampled_from(["integer", "double"])


def _numbers(children: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    return st.one_of(
        st.builds(Binary, st.sampled_from(["+", "-", "*", "+", "-", "/"]), children, children),
        st.builds(Unary, st.just("-"), children),
        st.builds(lambda name, child: Call(name, (child,)), st.sampled_from(["abs", "integer", "double"]), children),
        st.builds(_pair, st.sampled_from(["min", "max", "if"]), _kinds, children, children),
        st.builds(_whole_pair, st.sampled_from(["div", "mod"]), children, children),
        st.builds(_clamped, children, children, children),
    )


def _whole_pair(operator: BinaryOperator, left: Expression, right: Expression) -> Expression:
    return Binary(operator, Call("integer", (left,)), Call("integer", (right,)))


def _clamped(*parts: Expression) -> Expression:
    return Call("clamp", tuple(Call("integer", (part,)) for part in parts))


def _pair(name: str, kind: Function, left: Expression, right: Expression) -> Expression:
    """Two numbers of one type together."""
    first, second = Call(kind, (left,)), Call(kind, (right,))
    if name == "if":
        return Conditional(Binary("<", left, right), second, first)
    return Call("min" if name == "min" else "max", (first, second))


numbers: st.SearchStrategy[Expression] = st.recursive(st.one_of(_whole, _whole, _double), _numbers, max_leaves=4)
_colours = st.one_of(
    st.just(VariableRead("A", "colour")), st.sampled_from(COLOUR.values).map(lambda value: EnumValue("Colour", value))
)
_atoms = st.one_of(
    st.sampled_from(["on", "off", "broken"]).map(lambda state: StateTest("A", state)),
    st.just(VariableRead("A", "flag")),
    st.just(Received(("seen",))),
    st.booleans().map(Constant),
    st.builds(Binary, st.sampled_from(["=", "!="]), _colours, _colours),
    st.builds(Binary, st.sampled_from(["=", "!=", "<", "<=", ">", ">="]), numbers, numbers),
)


def _conditions(children: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    return st.one_of(
        st.builds(Binary, st.sampled_from(["and", "or", "implies", "=", "!="]), children, children),
        st.builds(Unary, st.sampled_from(["not", "holds"]), children),
        st.builds(Conditional, children, children, children),
    )


conditions: st.SearchStrategy[Expression] = st.recursive(_atoms, _conditions, max_leaves=6)


def _is_of_the_language(expression: Expression) -> bool:
    """Return True if RoboSC has words for all of it: only automata divide whole numbers."""
    if isinstance(expression, Binary) and expression.operator in ("div", "mod"):
        return False
    return all(_is_of_the_language(item) for item in children(expression))


language_conditions = conditions.filter(_is_of_the_language)
