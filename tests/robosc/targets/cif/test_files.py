"""The two files are well-formed CIF and say what the supervisor says."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from robosc.certification import make_supervisor
from robosc.cli.main import main
from robosc.errors import UnsupportedModelError
from robosc.expressions import Binary, Constant, Expression, StateTest, VariableRead, conjunction
from robosc.language import load_bundle
from robosc.model.structure import Deployment, Requirement, RequirementForm
from robosc.source import Bundle
from robosc.supervisor import Supervisor
from robosc.targets import GenerateOptions, generate
from robosc.targets.cif import supervisor as supervisor_module
from support.cif_parser import CifError
from support.cif_supported import problems
from support.cif_system import CifSystem
from support.cif_twin import assert_same_control, assert_same_problem
from support.effort import examples
from support.execution import unsupervised
from support.generated import example_supervisor
from support.models import EXAMPLE_DEPLOYMENTS, EXAMPLE_NAMES, EXAMPLES, bundle_of, example_bundle
from support.random_models import models
from support.random_supervisors import random_supervisor


def made(text: str, deployment: Deployment = Deployment.CONTROLLER, **libraries: str) -> Supervisor:
    """The supervisor of a model's text."""
    result = make_supervisor(bundle_of(text, **libraries), deployment=deployment)
    assert result.supervisor is not None, (result.reason, result.diagnostics)
    return result.supervisor


def layered(supervisor: Supervisor) -> Supervisor:
    """A random supervisor for the layer, in which cancel is not ours to restrict."""
    added = tuple(item for item in supervisor.added if not item.event.endswith(".cancel"))
    return replace(supervisor, deployment=Deployment.LAYER, added=added)


@pytest.mark.parametrize(("name", "deployment"), EXAMPLE_DEPLOYMENTS)
def test_examples(name: str, deployment: Deployment) -> None:
    supervisor = example_supervisor(name, deployment)
    states = int(supervisor.certificate.states)
    assert problems(generate(supervisor, "cif")["controller.cif"]) == []
    assert assert_same_problem(supervisor, reachable=states + 1) > 1
    # Exactly the states that are reachable under the supervisor.
    assert assert_same_control(supervisor, reachable=10 * states) >= states


@pytest.mark.parametrize(
    "file",
    [item for item in sorted(EXAMPLES.rglob("*.rscd")) if item.parent.name != "shared"],
    ids=lambda item: item.stem,
)
def test_synthesis_of_cif_takes_every_example(file: Path) -> None:
    found = make_supervisor(load_bundle(file), verify_limit=0, allow_livelock=True).supervisor
    assert found is not None
    assert problems(generate(found, "cif")["controller.cif"]) == []


@pytest.mark.parametrize(
    ("update", "is_taken"),
    [
        ("n - 1", True),
        ("n + 1 - n", True),
        ("n - (n + 1)", True),
        ("n - if n = 2: 1 else 0 end", True),
        ("n - 1 + 1", False),
        ("n - 1 - 1", False),
        ("if n = 2: n - 1 else n end", False),
        ("n * n", False),
        ("2 * 3 - 1", True),
        ("1 - 2", False),
        ("n mod 2", True),
        ("n mod n", False),
    ],
)
def test_the_checker_of_what_synthesis_takes(update: str, is_taken: bool) -> None:
    text = f"""plant automaton p:
  controllable c;
  disc int[0..5] n = 0;
  location a:
    initial; marked;
    edge c do n := {update};
end
"""
    assert (problems(text) == []) is is_taken
    assert problems(text.replace("do n", "when n - 1 = 0 do n")) != []
    assert problems(text.replace("0..5", f"0..{2**31 - 1}")) != []


GOLDEN = Path(__file__).parents[2] / "supervisor" / "golden"


@pytest.mark.parametrize(
    ("name", "test"),
    [
        ("capacity", "component_Bolts.v_n + component_Nuts.v_m <= 19"),
        # The file has 0 for -2 of the model.
        ("follower", "component_First.v_at >= component_Second.v_at"),
        ("house", "component_Cat.v_room != component_Mouse.v_room"),
    ],
)
def test_relations_between_variables(name: str, test: str) -> None:
    supervisor = made((GOLDEN / f"{name}.rscd").read_text(encoding="utf-8"))
    assert test in generate(supervisor, "cif")["supervisor.cif"]
    assert assert_same_control(supervisor, reachable=100, others=50) >= 100


@settings(max_examples=examples(15))
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_random_supervisors(seed: int, is_layer: bool) -> None:
    supervisor = layered(random_supervisor(seed)) if is_layer else random_supervisor(seed)
    try:
        generate(supervisor, "cif")
    except UnsupportedModelError as error:
        assert "target cif: the update of" in str(error)
        assume(False)
    assert problems(generate(supervisor, "cif")["controller.cif"]) == []
    assert_same_problem(supervisor, reachable=20, others=10)
    assert_same_control(supervisor, reachable=20, others=10)


@settings(max_examples=examples(10))
@given(st.integers(0, 2**32 - 1))
def test_random_supervisors_as_diagrams(seed: int) -> None:
    supervisor = random_supervisor(seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(supervisor_module, "FORMULA_LIMIT", 0)
        try:
            generate(supervisor, "cif")
        except UnsupportedModelError:
            return
        assert_same_control(supervisor, reachable=20, others=20)


def test_a_condition_that_is_too_large_for_a_formula_is_a_diagram(monkeypatch: pytest.MonkeyPatch) -> None:
    supervisor = random_supervisor(11)
    assert "alg bool" not in generate(supervisor, "cif")["supervisor.cif"]
    monkeypatch.setattr(supervisor_module, "FORMULA_LIMIT", 0)
    text = generate(supervisor, "cif")["supervisor.cif"]
    assert "\nalg bool bdd_1 = if " in text
    # Equal nodes are shared.
    nodes = [line.partition(" = ")[2] for line in text.splitlines() if line.startswith("alg ")]
    assert len(set(nodes)) == len(nodes)


@settings(max_examples=examples(8))
@given(models(), st.sampled_from(Deployment))
def test_random_models(bundle: Bundle, deployment: Deployment) -> None:
    supervisor = make_supervisor(bundle, deployment=deployment).supervisor
    assume(supervisor is not None)
    assert supervisor is not None
    assert problems(generate(supervisor, "cif")["controller.cif"]) == []
    assert_same_problem(supervisor, reachable=20, others=10)
    assert_same_control(supervisor, reachable=20, others=10)


EVERYTHING = """robot R {
    interface link use Scan from my_msgs
    datatype object Scan { flags: array(boolean) levels: array(integer(-2..2)) grid: array(integer(0..1)) }
    datatype object Reply { level: integer(-3..3) on_: boolean }
    component Lift {
        outgoing message scan with type: Scan links link
        service call with request: none, response: Reply links link
        action ride with request: none, response: Reply, feedback: Reply links link
        incoming message move with type: double
        behaviour {
            variable level: integer(-3..3) = -1
            variable flag: boolean = true
            variable tries: integer(0..3)
            variable half: integer(-2..2)
            initial marked state ^initial {
                on request to move
                on request to call do tries := tries + 1 goto always
                on response from scan do flag := value.flags[3] and !value.flags[0],
                    level := clamp(value.levels[1] + level, -3, 3), half := integer(double(level) / 2)
            }
            state always {
                on response from call do level := value.level, flag := if value.on_ then !flag else level > 0
                    goto ^initial
                on error from call goto ^initial
            }
            on feedback from ride do level := max(value.level, -level)
            transition if tries = 3 and !(double(level) / 3 > 0.5) goto ^initial
        }
    }
    requirement ride needs Lift.level >= -1 and Lift.flag
    requirement Lift.tries * Lift.level > 2 disables { move, ride }
    requirement never Lift.level - Lift.tries < -5
    requirement always double(Lift.half) / 4 < 0.75
    provide move with 1.0 if Lift.flag
    provide move with -1.0 if Lift.level < 0
}"""


@pytest.mark.parametrize("deployment", Deployment)
def test_a_model_with_everything(deployment: Deployment) -> None:
    supervisor = made(EVERYTHING, deployment)
    assert assert_same_problem(supervisor, reachable=30, others=20) >= 30
    assert assert_same_control(supervisor, reachable=30, others=20) >= 30
    text = generate(supervisor, "cif")["controller.cif"]
    for line in (
        "  disc int[0..6] v_level = 2;",
        "  input int[0..2] i_response_flags_known;",
        "  location $initial:",
    ):
        assert f"\n{line}\n" in text
    assert problems(text) == []
    # A product of variables is none for synthesis of CIF: it is written case by case.
    assert "component_Lift.v_tries *" not in text
    assert ("\n  uncontrollable c_cancel;\n" in text) == (deployment is Deployment.LAYER)
    assert ("disables action_ride.c_cancel" in text or "action_ride.c_cancel needs" in text) == (
        deployment is Deployment.CONTROLLER
    )


def test_an_update_that_always_leaves_its_range() -> None:
    supervisor = made(
        """robot R { interface link use Trigger from std_srvs
        component C {
            service call with request: none, response: none links link
            behaviour {
                variable n: integer(-1..1)
                initial marked state a { on request to call do n := 7  transition if C.n = 0 goto b }
                marked state b { on request to call do n := n + 1 }
            }
        } }"""
    )
    assert_same_problem(supervisor, reachable=20, others=20)
    assert_same_control(supervisor, reachable=20, others=20)
    files = generate(supervisor, "cif")
    assert "do v_n := if v_n < 2: 3 else v_n + 1 end;" in files["controller.cif"]
    assert "service_call.c_trigger when not component_C.a and (component_C.b =>" in files["supervisor.cif"].replace(
        "\n      ", " "
    )


def test_a_requirement_without_a_value_never_holds() -> None:
    """Unknown is not true, and not false either."""
    supervisor = made(
        """robot R { component C {
            incoming message go with type: none
            incoming message stop with type: none
            incoming message turn with type: none
            outgoing message seen with type: boolean
            behaviour {
                variable n: integer(0..2)
                initial marked state a { on response from seen do n := if value then 0 else 2 }
            } }
        requirement go needs 1 / double(C.n) > 0
        requirement 1 / double(C.n) > 0 disables stop
        requirement turn needs !(1 / double(C.n) > 0) or C.n = 0
        }"""
    )
    assert_same_problem(supervisor, reachable=20)
    text = generate(supervisor, "cif")["controller.cif"]
    assert "requirement message_go.c_trigger needs component_C.v_n >= 1;" in text
    assert "requirement message_stop.c_trigger needs false;" in text
    assert "requirement message_turn.c_trigger needs component_C.v_n = 0;" in text


@pytest.mark.parametrize("size", [3, 3000])
def test_long_chains(size: int) -> None:
    """Chains are as deep as they are long, leaning left: written flat, without deep recursion."""
    supervisor = unsupervised(SMALL)
    level, near, up = VariableRead("Lift", "level"), VariableRead("Lift", "near"), StateTest("Lift", "up")
    condition: Expression = up
    total: Expression = level
    alternating: Expression = near
    for number in range(size):
        condition = Binary("and", condition, Binary("!=", level, Constant(number - 1)))
        total = Binary("+" if number % 3 else "-", total, level)
        alternating = Binary("or" if number % 2 else "and", alternating, (near, up)[number % 3 % 2])
    wanted = conjunction(condition, Binary("<", total, Constant(5)), Binary("=", near, alternating))
    requirement = Requirement(("call",), RequirementForm.NEEDS, wanted)
    supervisor = replace(supervisor, model=replace(supervisor.model, requirements=(requirement,)))
    if size == 3:
        assert_same_problem(supervisor, reachable=20, others=10)
        return
    text = generate(supervisor, "cif")["controller.cif"]
    assert "requirement service_call.c_trigger needs component_Lift.up and " in text


@pytest.mark.parametrize(
    ("variable", "requirement", "message"),
    [
        (
            "integer(-2000000000..2000000000)",
            "C.n > 0",
            "the range -2000000000..2000000000 of C.n exceeds 32 bits once it starts at 0, as CIF synthesis wants it; "
            "make it smaller",
        ),
        (
            "integer(0..99000)",
            "C.n * C.m > 2147483647",
            "the requirement on go.request computes with too many values to be written in CIF: "
            "'C.n * C.m > 2147483647'; make the ranges of what it reads smaller, or split it up",
        ),
    ],
)
def test_what_cif_cannot_say_is_refused(variable: str, requirement: str, message: str) -> None:
    supervisor = unsupervised(
        f"""robot R {{ component C {{
            incoming message go with type: none
            behaviour {{ variable n: {variable} variable m: {variable} initial marked state a {{ }} }} }}
            requirement go needs {requirement}
        }}"""
    )
    with pytest.raises(UnsupportedModelError) as caught:
        generate(supervisor, "cif")
    assert str(caught.value) == f"target cif: {message}"


def test_it_makes_no_package() -> None:
    with pytest.raises(UnsupportedModelError, match="no package"):
        generate(example_supervisor(EXAMPLE_NAMES[0]), "cif", GenerateOptions(package="x"))


def test_too_many_provide_statements() -> None:
    supervisor = example_supervisor(EXAMPLE_NAMES[0])
    statement = supervisor.model.provides[0]
    model = replace(supervisor.model, provides=(statement,) * 400)
    with pytest.raises(UnsupportedModelError, match=r"^target cif: move has 400 provide statements"):
        generate(replace(supervisor, model=model), "cif")


def test_texts_of_the_model_end_no_comment() -> None:
    supervisor = made(
        """robot R { component C { incoming message say with type: string
            behaviour { initial marked state a { on request to say } } }
            provide say with "*/ \\n end \u2028 \\u0000 é // plant automaton x: location: initial; end"
        }"""
    )
    text = generate(supervisor, "cif")["controller.cif"]
    (line,) = [line for line in text.splitlines() if "plant automaton x" in line]
    assert line.startswith("// ") and "*/" not in text
    assert_same_problem(supervisor, reachable=5)


def test_the_same_bytes_whatever_the_engine_and_the_hash_seed(tmp_path: Path) -> None:
    model = EXAMPLES / "maze_solver/maze_solver.rscd"
    folder = tmp_path / "out"
    command = [sys.executable, "-m", "robosc.cli.main", "generate", str(model), "--target", "cif", "-o", str(folder)]
    environment = {**os.environ, "PYTHONHASHSEED": "7"}
    subprocess.run(command, env=environment, check=True, capture_output=True)
    for engine in ("cudd", "oxidd", "autoref"):
        supervisor = make_supervisor(example_bundle("maze_solver/maze_solver"), engine=engine).supervisor
        assert supervisor is not None
        for path, text in generate(supervisor, "cif").items():
            assert (folder / path).read_text() == text


def test_the_command_writes_both_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = str(EXAMPLES / "line_follower/line_follower.rscd")
    assert main(["generate", model, "--target", "cif", "-o", str(tmp_path)]) == 0
    assert capsys.readouterr().out.split() == [str(tmp_path / "controller.cif"), str(tmp_path / "supervisor.cif")]


def test_the_text_is_about_as_long_as_the_paper_says() -> None:
    """About 1.5 times the model's lines for the line follower and 2 times for the maze solver."""
    for name in ("line_follower/line_follower", "maze_solver/maze_solver"):
        lines = [
            line for line in (EXAMPLES / f"{name}.rscd").read_text().splitlines() if line and not line.startswith("//")
        ]
        files = generate(example_supervisor(name), "cif")
        written = [line for line in files["controller.cif"].splitlines() if line and not line.startswith("//")]
        assert 1.2 < len(written) / len(lines) < 2.2


SMALL = """robot R {
    interface link use Scan from my_msgs
    datatype object Scan { near: boolean level: integer(-1..1) }
    component Lift {
        outgoing message scan with type: Scan links link
        service call with request: none, response: none links link
        behaviour {
            variable level: integer(-1..1)
            variable near: boolean
            initial marked state down { on request to call goto up on response from scan do near := value.near }
            state up {
                on response from scan do level := value.level
                on response from call goto down
                transition if near goto down
            }
        }
    }
    requirement call needs Lift.level >= 0 and Lift.near
    requirement never Lift.level > 0 and Lift.near and Lift.down
}"""


@pytest.mark.parametrize("path", ["controller.cif", "supervisor.cif"])
def test_a_file_without_any_one_of_its_lines_is_noticed(path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither the grammar nor the comparison lets anything pass: every line matters."""
    supervisor = unsupervised(SMALL)
    lines = generate(supervisor, "cif")[path].splitlines()
    compare = assert_same_problem if path == "controller.cif" else assert_same_control
    unnoticed = []
    for number, line in enumerate(lines):
        # Edges show the supervisor's alphabet too: it is written for readers.
        if not line or (line.startswith("//") and " = " not in line) or line.startswith("  alphabet"):
            continue
        text = "\n".join([*lines[:number], *lines[number + 1 :]]) + "\n"
        monkeypatch.setattr("support.cif_twin.generate", lambda *_, text=text: {path: text})
        try:
            compare(supervisor, reachable=10, others=20)
        except (CifError, AssertionError, KeyError, ValueError):
            continue
        unnoticed.append(line)
    assert unnoticed == []


_DECLARED_TWICE = "plant automaton x: location a: initial; end plant automaton x: location a: initial; end"


@pytest.mark.parametrize(
    "text",
    [
        "plant automaton x: location a: initial end",
        "plant automaton x: location a: end",
        "plant automaton x: location a: marked; end",
        "plant automaton x: location: initial; location: marked; end",
        "plant automaton x: location initial: initial; end",
        "plant automaton x: uncontrollable a; location a: initial; end",
        "plant automaton x: location a: initial; edge e; end",
        "plant automaton x: controllable e; location a: initial; edge e goto b; end",
        "plant automaton x: controllable e; location a: initial; edge e when v; end",
        "plant automaton x: controllable e; location a: initial; edge e when 1; end",
        "plant automaton x: disc int[0..3] v = 4; location a: initial; end",
        "plant automaton x: disc int[-1..3] v = 0; location a: initial; end",
        "plant automaton x: disc int[0..3] v = true; location a: initial; end",
        "plant automaton x: disc int[0..3] v; location a: initial; end",
        "plant automaton x: disc y v = 0; location a: initial; end",
        "plant automaton x: controllable e; disc int[0..3] v = 0; location a: initial; edge e do v := 4; end",
        "plant automaton x: controllable e; disc int[0..3] v = 0; location a: initial; edge e do v := v = 1; end",
        "plant automaton x: controllable e; disc bool v = true; location a: initial; edge e do v := a, v := a; end",
        "plant automaton x: controllable e; input bool i; location a: initial; edge e when i; end",
        "plant automaton x: controllable e; alphabet f; location a: initial; edge e; end",
        "enum e = a, b; enum f = b, c;",
        "enum e = a; plant automaton x: location a: initial; end",
        "enum e = a; plant automaton x: disc e v = b; location l: initial; end",
        "requirement invariant y.z;",
        "requirement x.e needs true;",
        "plant automaton x: location a: initial; end requirement invariant x.a + 1 > 0;",
        "plant automaton x: location a: initial; end requirement invariant x.a = true = true;",
        "alg bool a = b; alg bool b = true;",
        "plant automaton x: location a: initial; // é\nend",
        _DECLARED_TWICE,
    ],
)
def test_what_is_no_cif_is_refused(text: str) -> None:
    with pytest.raises(CifError):
        CifSystem(f"{text}\n")


def test_what_is_cif_is_read() -> None:
    CifSystem(f"// é comes from elsewhere\n{_DECLARED_TWICE.partition(' end ')[0]} end\n".replace("é", "e"))


def test_a_file_that_would_grow_beyond_the_limit_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    supervisor = example_supervisor("maze_solver/maze_solver")
    largest = max(map(len, generate(supervisor, "cif").values()))
    # The package gives the module's name to its function.
    module = sys.modules["robosc.targets.cif.generate"]
    monkeypatch.setattr(module, "MAXIMUM_BYTES", largest + 10)
    generate(supervisor, "cif")
    monkeypatch.setattr(module, "MAXIMUM_BYTES", largest - 10)
    with pytest.raises(UnsupportedModelError, match="target cif: a file would have more than"):
        generate(supervisor, "cif")
