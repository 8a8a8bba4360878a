"""Flags of event parameters: what is done with a channel, against every combination of them."""

from itertools import combinations, permutations

import pytest

from robosc.cif import check_cif
from robosc.source import Bundle, SourceFile

USES = "!?~"
FLAGS = ["".join(flags) for count in range(4) for flags in combinations(USES, count)]
BODIES = {"!": "edge f!1;", "?": "edge f?;", "~": "edge f;"}


def is_accepted(text: str) -> bool:
    """Return True if a text has no errors."""
    plant = " plant p: controllable z; location: initial; marked; edge z; end"
    return check_cif(Bundle(SourceFile("m.cif", text + plant))).system is not None


def allowed(flags: str) -> set[str]:
    """The uses that flags allow."""
    return set(flags or USES)


@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("flags", FLAGS)
def test_an_edge_uses_what_the_flags_allow(flags: str, use: str) -> None:
    for order in permutations(flags):
        text = f"plant def B(event int f{''.join(order)}): location: initial; marked; {BODIES[use]} end"
        assert is_accepted(text) is (use in allowed(flags))


@pytest.mark.parametrize("outer", FLAGS)
@pytest.mark.parametrize("inner", FLAGS)
def test_a_parameter_passes_on_what_it_allows(inner: str, outer: str) -> None:
    text = f"group def A(event int e{outer}): b: B(e); end group def B(event int f{inner}): end"
    assert is_accepted(text) is (allowed(inner) <= allowed(outer))


@pytest.mark.parametrize("flags", FLAGS)
def test_an_alphabet_synchronizes(flags: str) -> None:
    text = f"plant def B(event int f{flags}): alphabet f; location: initial; marked; end"
    assert is_accepted(text) is ("~" in allowed(flags))


@pytest.mark.parametrize("flags", FLAGS)
def test_any_channel_may_be_given(flags: str) -> None:
    assert is_accepted(f"controllable int c; group def A(event int e{flags}): end a: A(c);")
    assert is_accepted("controllable int c; group def A(event e): end a: A(c);")
    assert not is_accepted(f"controllable c; group def A(event int e{flags}): end a: A(c);")
    assert not is_accepted(f"controllable int[0..3] c; group def A(event int e{flags}): end a: A(c);")
