"""Codes of values, and where the variables of received data stand."""

import pytest

from robosc.automata import Automaton, DiscreteVariable, InputVariable, System
from robosc.automata.state import Subject
from robosc.expressions import IntegerType, PathStep
from robosc.synthesis import SynthesisStatus, synthesize
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import make_manager
from robosc.synthesis.nodes import count_models
from support.systems import automaton, edge, operation, read, received, system


def integer(count: int) -> System:
    """One variable with `count` values."""
    variable = DiscreteVariable("x", IntegerType(3, 2 + count), (3,))
    return system(automaton("A", ["l -e-> l"], variables=[variable]))


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 6, 7, 8, 9, 15, 16, 17, 1000])
def test_codes_are_the_values_and_nothing_else(engine: str, count: int) -> None:
    encoding = Encoding(integer(count), make_manager(engine))
    bits = encoding.subjects[Subject("A", "x")]
    assert len(bits.names) == (count - 1).bit_length()
    assert count_models(encoding.manager, encoding.valid(bits), bits.names) == count
    all_codes = encoding.any_of(encoding.equals(bits, value) for value in bits.domain)
    assert all_codes == encoding.valid(bits)


def copies(count: int, high: int) -> System:
    """One event that carries a number for each of `count` automata, and one that needs the first three to ascend."""
    values = IntegerType(0, high)
    sensors = [
        automaton(f"S{n}", [edge("l -u_seen-> l", v=received(n))], variables=[DiscreteVariable("v", values, (0,))])
        for n in range(count)
    ]
    monitor = automaton("M", ["off -on-> on", "on -off-> off"])
    ascending = operation(
        operation(read("S0.v"), "<=", read("S1.v")), "and", operation(read("S1.v"), "<=", read("S2.v"))
    )
    inputs = [InputVariable("u_seen", (n,), values) for n in range(count)]
    return system(*sensors, monitor, conditions={"on": ascending}, inputs=inputs)


def test_received_data_stand_beside_what_they_are_written_to(engine: str) -> None:
    encoding = Encoding(copies(3, 7), make_manager(engine))
    for number in range(3):
        place = encoding.subjects[Subject(f"S{number}", "v")]
        data = encoding.inputs_of("u_seen")[number,]
        for written, carried in zip(place.names, data.names, strict=True):
            assert level(encoding, carried) == level(encoding, written) + 2  # the next-state bit stands between


def test_a_known_bit_stands_above_its_datum(engine: str) -> None:
    source = copies(3, 7)
    optional = tuple(InputVariable(item.event, item.path, item.type, may_be_unknown=True) for item in source.inputs)
    encoding = Encoding(System(source.name, source.events, source.automata, optional), make_manager(engine))
    for bits in encoding.inputs_of("u_seen").values():
        assert bits.known is not None
        assert level(encoding, bits.known) < min(level(encoding, name) for name in bits.names)


def level(encoding: Encoding, name: str) -> int:
    return int(encoding.manager.var(name).level)


def test_data_that_nothing_reads_have_a_place_too(engine: str) -> None:
    """An event may carry more than its updates use."""
    unused = InputVariable("e", ("unused",), IntegerType(0, 4))
    plain = integer(4)
    encoding = Encoding(System(plain.name, plain.events, plain.automata, (unused,)), make_manager(engine))
    (bits,) = encoding.inputs_of("e").values()
    assert count_models(encoding.manager, encoding.possible_inputs("e"), bits.names) == 5


def test_many_data_of_one_event_stay_small(engine: str) -> None:
    """Copying 8 numbers of 5 bits at once takes nodes in proportion, not one for each of 2^40 combinations."""
    result = synthesize(copies(8, 31), engine=engine)
    assert result.statistics.states == 32**8 * 2
    assert result.statistics.peak_nodes < 2000


@pytest.mark.parametrize(
    ("paths", "expected"),
    [
        ([("a", 0), ("a", 1), ("a", 2)], 4),  # a prefix of the array
        ([("a", 0), ("b", 0)], 4),  # two arrays
        ([("a", 1, "x"), ("a", 1, "y")], 2),  # one element
        ([("a", 0, "b", 0), ("a", 1, "b", 0)], 4),  # each element has a list of its own length
        ([("a", 0, "b", 0), ("a", 0, "b", 1), ("a", 1, "b", 0)], 6),
    ],
)
def test_arrays_have_no_gaps(engine: str, paths: list[tuple[PathStep, ...]], expected: int) -> None:
    """Check the number of combinations of known and unknown data."""
    inputs = tuple(InputVariable("e", path, IntegerType(0, 0), may_be_unknown=True) for path in paths)
    encoding = Encoding(System("Arrays", integer(2).events, integer(2).automata, inputs), make_manager(engine))
    known = [bits.known for bits in encoding.inputs_of("e").values()]
    names = sorted((name for name in known if name), key=lambda name: level(encoding, name))
    assert count_models(encoding.manager, encoding.possible_inputs("e"), names) == expected


def test_hundreds_of_bits_are_no_depth(engine: str) -> None:
    """Only one of 600 automata moves, but every predicate on the state has a level for each."""
    still = [Automaton(f"A{n}", ("here", "there"), ("here",), frozenset({"here"}), frozenset(), ()) for n in range(600)]
    moving = automaton("M", ["a -go-> b", "b -back-> a", "b -u_jump-> b"], marked=["a"])
    calm = system(moving)
    whole = System("Wide", calm.events, (*still, moving))
    result = synthesize(whole, engine=engine)
    assert (result.status, result.statistics.states) == (SynthesisStatus.SUPERVISOR, 2)
