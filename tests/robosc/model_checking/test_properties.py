"""The language of properties: what it takes, what it means, and what it says about the rest."""

import pytest

from robosc.errors import LanguageError
from robosc.language.limits import MAXIMUM_SYNTAX_ERRORS
from robosc.model.structure import Model
from robosc.model_checking import formula_text, properties_of
from robosc.source import SourceFile
from support.models import marked_place, model_of

MODEL = model_of("""robot R {
    interface trigger use Trigger from std_srvs
    datatype enum Mode from integer to { value > 3 -> AG value > 2 -> U value > 1 -> invariant default -> E }
    component A {
        outgoing message mode with type: Mode
        behaviour {
            variable mode: Mode
            variable n: integer(0..3)
            variable heard: integer
            on response from mode do mode := value, heard := heard + 1
            initial marked state G { transition if n = 0 and mode = AG goto X }
            marked state X { transition goto G }
        }
    }
    component call { behaviour { initial marked state idle { transition goto busy } marked state busy { } } }
    component EX { behaviour { initial marked state up { } } }
    component S {
        service call with request: none, response: none links trigger
        service other with request: none, response: none links trigger
    }
}""")


def read(text: str, model: Model = MODEL) -> str:
    (found,) = properties_of(model, [SourceFile("p", text)])
    return formula_text(found.formula, {item.name for item in model.components})


def faults(text: str, model: Model = MODEL) -> list[str]:
    with pytest.raises(LanguageError) as error:
        properties_of(model, [SourceFile("p", text)])
    return [f"{item.location} {item.message} [{item.code}]" for item in error.value.diagnostics]


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("A.G", "A.G"),
        ("AG A.G", "AG A.G"),
        ("A G A.G", "AG A.G"),
        ("E F E X A.X", "EF EX A.X"),
        ("AG A.G or A.X", "AG A.G or A.X"),
        ("AG (A.G or A.X)", "AG (A.G or A.X)"),
        ("!AG !A.G", "!AG !A.G"),
        ("AG !EF A.X", "AG !EF A.X"),
        ("not AG not A.G", "!AG !A.G"),
        ("AG not(EF A.X)", "AG !EF A.X"),
        ("not A G not not A.X", "!AG !!A.X"),
        ("A[not A.G U not E[not A.X U A.G]]", "A[!A.G U !E[!A.X U A.G]]"),
        ("invariant not service call.waiting", "AG (!service call.waiting)"),
        ("not if A.G then A.X else not (A.n > 1)", "!(if A.G then A.X else !(A.n > 1))"),
        ("AG (A.G => EF A.X)", "AG (!A.G or EF A.X)"),
        ("A[A.G U A.X]", "A[A.G U A.X]"),
        ("E[A.G and A.n < 2 U EG A.X]", "E[A.G and A.n < 2 U EG A.X]"),
        ("A[E[A.G U A.X] U A.X]", "A[E[A.G U A.X] U A.X]"),
        ("invariant A.G or A.X", "AG (A.G or A.X)"),
        ("reachable A.n = 3 and EG A.G", "EF ((A.n = 3) and EG A.G)"),
        ("EF enabled(call.request)", "EF enabled(call.request)"),
        ("enabled(A.tau_1) and enabled(mode.response)", "enabled(A.tau_1) and enabled(mode.response)"),
        # A component wins over a service of the same name.
        ("call.busy", "call.busy"),
        ("service call.waiting", "service call.waiting"),
        ("AG (service call.waiting or EF call.busy)", "AG ((service call.waiting) or EF call.busy)"),
        ("other.waiting or service other.failed", "other.waiting or other.failed"),
        # Words of ours that are names of the model.
        ("AG (A.mode = ^AG)", "AG (A.mode = AG)"),
        ("AG (A.mode = Mode.AG)", "AG (A.mode = AG)"),
        ("A.mode = AG", "A.mode = AG"),
        ("A.mode = AG or AG A.G", "(A.mode = AG) or AG A.G"),
        ("EX EX.up", "EX EX.up"),
        ("invariant = A.mode", "invariant = A.mode"),
        ("A[A.mode = U U A.mode = E]", "A[A.mode = U U A.mode = E]"),
        ("E[true U E = A.mode]", "E[true U E = A.mode]"),
        ("if A.G then A.X else A.n > 1", "if A.G then A.X else A.n > 1"),
        ("AG /* all */ A.G // yes", "AG A.G"),
    ],
)
def test_meaning(text: str, meaning: str) -> None:
    assert read(text) == meaning
    if "call" not in text and "AG)" not in text and "= AG" not in text:
        # Said in the model's words, a service or an enum value may be taken for something else.
        assert read(meaning) == meaning


NAMED_NOT = model_of("""robot R { component not { behaviour {
    variable not: integer(0..2)
    initial marked state U { transition if not = 0 goto not_ }
    marked state not_ { transition if not = 1 goto U }
} } }""")


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("A[not.U U not.not = 1]", "A[not.U U not.not = 1]"),
        ("AG not.U", "AG not.U"),
        ("not not.U", "!not.U"),
        ("not: not.U", "not.U"),
        ("invariant not.not - 1 = 0", "AG (not.not - 1 = 0)"),
    ],
)
def test_what_is_called_not_keeps_its_name(text: str, meaning: str) -> None:
    assert read(text, NAMED_NOT) == read(meaning, NAMED_NOT)


@pytest.mark.parametrize(
    "text",
    [
        "§",
        "(§",
        "AG §(A.G",
        "A[A.G U§",
        "E[A.G§]",
        "AG A.§Y",
        "AG §B.G",
        "§A.heard = 3",
        "AG A.n §= 3",
        "AG §A.n",
        "§not",
        "AG not §U",
        "§not A.n = 3",
        "AG A.G §&& A.X",
        "EF enabled(§mode.request)",
        "EF enabled(mode§)",
        "service call.§waitin",
        "A.G §A.X",
        "AG §value",
        "§- AG A.G",
        "§if AG A.G then A.X else A.G",
        "§'never closed",
        "§/* never closed",
        "A.G §# all",
    ],
)
def test_faults_have_their_place(text: str) -> None:
    plain, line, column = marked_place(text)
    assert any(fault.startswith(f"p:{line}:{column} ") for fault in faults(plain)), faults(plain)


def test_misspelt_names() -> None:
    assert "did you mean 'busy'?" in faults("EF call.bussy")[0]
    assert "did you mean 'mode.response'?" in faults("enabled(mode.respons)")[0]
    assert "code-only" in faults("EF (A.heard = 1)")[0]
    assert "the end of the property" in faults("AG (A.G or")[0]


def test_words_of_requirements_are_printed_as_a_claim() -> None:
    for written, meant in (("always A.G", "invariant A.G"), ("never A.G and A.X", "invariant !(A.G and A.X)")):
        with pytest.raises(LanguageError) as error:
            properties_of(MODEL, [SourceFile("p", written)], [])
        (found,) = error.value.diagnostics
        assert found.fix == f"Write '{meant}' instead of '{written}'."
        assert len(properties_of(MODEL, [SourceFile("p", meant)], [])) == 1


def test_listings() -> None:
    text = "# don't read \"this\nfirst: AG A.G # why\n\n   // nothing\n  EF A.X // x\r\nrequest: A.G"
    found = properties_of(MODEL, [], [SourceFile("f", text)])
    assert [(item.name, item.text, item.location.line) for item in found] == [
        ("first", "AG A.G", 2),
        ("", "EF A.X", 5),
        ("request", "A.G", 6),
    ]
    with pytest.raises(LanguageError) as error:
        properties_of(MODEL, [], [SourceFile("f", "AG A.G\nAG A.Y\n x: EF\nEF B.x")])
    assert [str(item.location) for item in error.value.diagnostics] == ["f:2:6", "f:3:5", "f:4:4"]


def test_depth_and_size_are_bounded() -> None:
    assert "nested deeper" in faults("AG " * 1000 + "A.G")[0]
    assert "nested deeper" in faults("(" * 1000 + "A.G")[0]
    assert "nested deeper" in faults("AG !" * 150 + "A.G")[0]
    assert "AG" in read("AG " * 150 + "A.G")
    chain = " and ".join(["EF A.X", "A.G"] * 5_000)
    assert len(read(chain)) > 50_000
    assert len(read("AG (" + " or ".join(["A.n = 1"] * 10_000) + ")")) > 50_000


def test_faults_are_reported_up_to_a_limit() -> None:
    with pytest.raises(LanguageError) as error:
        properties_of(MODEL, [], [SourceFile("f", "AG A.Y\n" * 10_000)])
    assert len(error.value.diagnostics) == MAXIMUM_SYNTAX_ERRORS
    with pytest.raises(LanguageError) as error:
        properties_of(MODEL, [], [SourceFile("f", "AG (\n" * 10_000)])
    assert len(error.value.diagnostics) == MAXIMUM_SYNTAX_ERRORS
