"""Results show themselves: on one line, as a text, in a notebook; and they cannot be changed."""

import pickle
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

import robosc
from robosc.supervisor import Supervisor as CoreSupervisor
from robosc.tables import MAXIMUM_ROWS, html_table, html_text
from support.lift import LIFT
from support.models import EMPTY, EXAMPLES

NAVIGATION = EXAMPLES / "navigation" / "navigation.rscd"
FORGED = 'robot R { component C { incoming message m with identifier: "<b>&", type: nothing } }'


@pytest.fixture(scope="module")
def supervisor() -> robosc.Supervisor:
    made = robosc.synthesize(NAVIGATION).supervisor
    assert made is not None
    return made


def results() -> Iterator[tuple[object, str]]:
    """Results with what they are on one line."""
    model = robosc.load(NAVIGATION)
    result = robosc.synthesize(model)
    supervisor = result.supervisor
    assert supervisor is not None
    graph, empty, wrong = robosc.explore(model), robosc.load(text=EMPTY), robosc.load(text=FORGED)
    yield result.diagnostics, "<1 warning, 2 notes>"
    yield supervisor, "<supervisor of Navigation: controller, 1044 states, conditions added to 1 event>"
    yield result, f"<Synthesis: {supervisor!r}; 1 warning, 2 notes>"
    yield supervisor.conditions, "<conditions of 9 controllable events; something is added to 1>"
    yield supervisor.conditions["navigate.request"], "<navigate.request needs Navigator.failures <= 2>"
    yield graph, "<Exploration: <graph of Navigation: 1044 states, 6504 transitions>; 1 warning, 2 notes>"
    yield robosc.generate(supervisor, "python"), "<Generation: <1 generated file>; 1 warning, 2 notes>"
    yield robosc.verify(model, "invariant true"), "<Verification: passed: 1 of 1 properties hold>"
    yield robosc.verify(model, "invariant nonsense"), "<Verification: property errors>"
    yield (
        robosc.verify(empty, "invariant true"),
        (
            "<Verification: no supervisor; no supervisor exists: uncontrollable events can lead from the initial state "
            "into states to be avoided>"
        ),
    )
    yield robosc.verify(model, supervisor=supervisor), "<Verification: passed>"
    yield robosc.explain(model, event="navigate"), "<Explained: <explanation: 1 events, 0 remarks>; 1 warning>"
    yield robosc.explain(code="unknown-name"), "<page about unknown-name: A name means nothing here>"
    yield robosc.synthesize(empty).explanation, "<no supervisor: 1 parts of the model are to blame>"
    yield robosc.synthesize(wrong), "<Synthesis: model errors; 1 error>"
    yield robosc.synthesize(wrong).explanation, "<no supervisor: 1 error>"
    yield robosc.simulate(supervisor), "<run of Navigation: 0 steps; allowed are calibrate.request>"


def test_one_line_a_text_and_a_table_for_each() -> None:
    for value, line in results():
        assert repr(value) == line
        assert "\n" not in line
        assert len(line) < 150
        assert str(value)
        assert str(value) != line
        for show in ("_repr_html_", "_repr_markdown_"):
            if hasattr(value, show):
                shown = getattr(value, show)()
                assert shown
                if show == "_repr_html_":
                    ElementTree.fromstring(f"<div>{shown}</div>")
                    assert "<b>" not in shown


def test_a_result_without_a_supervisor_says_why() -> None:
    result = robosc.synthesize(robosc.load(text=FORGED))
    reported = str(result.explanation)
    assert "model.rscd:1:75: error: unknown data type 'nothing' [unknown-name]\n  | robot R {" in reported
    assert str(result) == reported
    empty = robosc.synthesize(robosc.load(text=EMPTY))
    assert str(empty).endswith(str(empty.explanation))
    assert "no supervisor exists: " in str(empty)
    library = robosc.synthesize(robosc.load(text="library L { }"))
    assert (library.supervisor, str(library.explanation)) == (None, "a library has no robot to make a supervisor for")


def test_conditions_are_printed_in_words(supervisor: robosc.Supervisor) -> None:
    condition = supervisor.conditions["navigate.request"]
    assert (str(condition), condition.text, condition.lines) == ("Navigator.failures <= 2",) * 2 + ((),)
    assert condition.diagram == supervisor.added_condition("navigate.request")
    assert supervisor.conditions["navigate.reset"].adds_nothing
    assert "navigate.request needs Navigator.failures <= 2" in str(supervisor.conditions)
    with pytest.raises(KeyError, match=r"no controllable event 'navigate\.response'; did you mean 'navigate\.reset'"):
        supervisor.conditions["navigate.response"]
    assert "navigate.response" not in supervisor.conditions
    assert supervisor.conditions.get("nothing") is None


def test_a_condition_without_a_formula_is_printed_node_by_node(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robosc.conditions.rendering.Formulas.formula", lambda *arguments, **options: None)
    supervisor = robosc.synthesize(NAVIGATION).supervisor
    assert supervisor is not None
    condition = supervisor.conditions["navigate.request"]
    assert (condition.formula, condition.text) == (None, "a decision diagram of 1 node")
    assert str(condition).splitlines() == [
        "a decision diagram of 1 node, to be read from [1] on:",
        "[1] Navigator.failures <= 2",
    ]


def test_a_supervisor_in_figures(supervisor: robosc.Supervisor) -> None:
    summary = supervisor.summary
    assert (summary.states, summary.transitions) == (supervisor.states, supervisor.transitions) == (1044, 6504)
    assert summary.controllable_events == len(supervisor.conditions) == 9
    assert dict(summary.added)["navigate.request"] == "Navigator.failures <= 2"
    assert str(supervisor) == str(summary) == summary.text.rstrip()
    assert repr(CoreSupervisor(supervisor.model, supervisor.deployment, (), supervisor.certificate)) == (
        "<supervisor of Navigation: controller, 1044 states, conditions added to 0 events>"
    )


def test_goals_and_what_is_chosen_for_them_are_told(tmp_path: Path) -> None:
    made = robosc.synthesize(robosc.load(text=LIFT)).supervisor
    assert made is not None and made.strategy is not None
    assert repr(made).endswith(", a strategy for 1 goal>")
    (goal,) = made.goals
    assert (goal.goal, [item.event for item in goal.choices]) == ("once Base.inside", ["call.request", "enter.request"])
    assert (
        str(made.goals)
        == """\
once Base.inside:
  call.request where Lift.away
  enter.request where Lift.here
  nothing otherwise"""
    )
    assert (repr(made.goals), repr(goal)) == ("<1 goal>", "<once Base.inside: requests call.request, enter.request>")
    assert repr(goal.choices[0]) == "<call.request where Lift.away>"
    assert "enter.request" in made.goals._repr_html_() and made.goals._repr_html_() in made._repr_html_()
    assert re.search(r">goals</td><td[^>]*>passed<", made._repr_html_())
    assert "for goal 1, once Base.inside" in str(made)
    for again in (robosc.Supervisor.read(made.write(tmp_path / "lift.rsup")), pickle.loads(pickle.dumps(made))):
        assert (again.strategy, again.goals) == (made.strategy, made.goals)
        assert robosc.simulate(again).chosen == "call.request"


def test_a_choice_without_a_formula_is_told_node_by_node(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robosc.conditions.rendering.Formulas.formula", lambda *arguments, **options: None)
    made = robosc.synthesize(robosc.load(text=LIFT)).supervisor
    assert made is not None
    assert """
  enter.request where a decision diagram of 1 node, to be read from [1] on:
[1] Lift.here
""" in str(made.goals)


def test_without_goals_none_are_told(supervisor: robosc.Supervisor) -> None:
    assert (supervisor.strategy, len(supervisor.goals), str(supervisor.goals)) == (None, 0, "no goals")
    assert repr(supervisor.goals) == "<no goals>"
    assert "goal" not in repr(supervisor) + str(supervisor) + supervisor._repr_html_()


def test_values_cannot_be_changed_and_can_be_pickled(supervisor: robosc.Supervisor) -> None:
    for value, name in ((supervisor, "added"), (robosc.check(NAVIGATION)[0], "code"), (supervisor.summary, "states")):
        with pytest.raises(AttributeError):
            setattr(value, name, None)
        assert pickle.loads(pickle.dumps(value)) == value
    copied = pickle.loads(pickle.dumps(supervisor))
    assert copied.diagnostics == supervisor.diagnostics != ()


def test_findings_are_a_tuple_by_severity() -> None:
    found = robosc.check(robosc.load(text=FORGED))
    assert found == tuple(found)
    assert (found.has_errors, len(found.errors), len(found.warnings), len(found.notes)) == (True, 1, 0, 0)
    assert robosc.explain(found[0]).code == "unknown-name"
    assert repr(found.warnings) == "<no findings>"
    assert str(pickle.loads(pickle.dumps(found))) == str(found)


def test_a_wrong_code_names_the_nearest() -> None:
    with pytest.raises(robosc.UnknownCodeError, match="'unknown-nam'; did you mean 'unknown-name'"):
        robosc.explain(code="unknown-nam")
    with pytest.raises(TypeError, match="either a model or finding, or code="):
        robosc.explain()  # type: ignore[call-overload]
    with pytest.raises(robosc.RequestError, match="unknown event 'nevigate'; did you mean 'navigate'"):
        robosc.explain(NAVIGATION, event="nevigate")


def test_what_a_target_refuses_is_refused_with_the_supervisor_alone() -> None:
    text = """robot R {
        component A { outgoing message a with identifier: "/x", type: boolean }
        component B { incoming message b with identifier: "/x", type: double }
    }"""
    result = robosc.synthesize(robosc.load(text=text))
    assert result.supervisor is not None
    generation = robosc.generate(result.supervisor, "python")
    assert (generation.status, generation.files) == (robosc.SynthesisStatus.MODEL_ERRORS, None)
    assert [item.code for item in generation.diagnostics if item.severity is robosc.Severity.ERROR] == [
        "conflicting-topic"
    ]
    with pytest.raises(robosc.NothingGeneratedError):
        generation.write("never")
    with pytest.raises(robosc.UnknownTargetError, match="unknown target 'ros'; did you mean"):
        robosc.generate(result.supervisor, "ros")


def test_files_that_somebody_changed_are_kept(supervisor: robosc.Supervisor, tmp_path: Path) -> None:
    generation = robosc.generate(supervisor, "python")
    (file,) = generation.write(tmp_path).files
    file.write_text("mine")
    with pytest.raises(robosc.OverwriteError):
        generation.write(tmp_path)
    assert file.read_text() == "mine"
    generation.write(tmp_path, force=True)
    assert file.read_text() == next(iter(generation.files.values())) if generation.files else False


def test_progress_is_reported_and_work_can_be_stopped() -> None:
    reported: list[robosc.Progress] = []
    robosc.synthesize(NAVIGATION, on_progress=reported.append)
    assert [item.stage for item in reported][:: len(reported) - 1] == ["check", "controller"]
    for use in (robosc.synthesize, robosc.explore, robosc.explain):
        with pytest.raises(robosc.SynthesisCancelled):
            use(NAVIGATION, should_stop=lambda: True)


def test_tables_escape_and_end() -> None:
    table = html_table(("<a>",), [(number,) for number in range(MAXIMUM_ROWS + 5)], caption="&")
    assert "&lt;a&gt;" in table
    assert table.count("<tr>") == 1 + MAXIMUM_ROWS + 1
    assert "... and 5 more" in table
    assert html_text("<") == "<pre>&lt;</pre>\n"


def test_cells_of_a_table_hold_their_values_and_nothing_else() -> None:
    table = html_table(("name", "value"), [("a<b", 1), ("c", "d")])
    assert re.sub(r' style="[^"]*"', "", table).split("\n")[1:-1] == [
        "<thead><tr><th>name</th><th>value</th></tr></thead>",
        "<tbody>",
        "<tr><td>a&lt;b</td><td>1</td></tr>",
        "<tr><td>c</td><td>d</td></tr>",
        "</tbody>",
        "</table>",
    ]
