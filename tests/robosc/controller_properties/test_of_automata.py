"""Controller properties of automata: small models by hand, and random ones beside the definitions written out."""

import json
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

import robosc
from robosc.cli.main import main
from robosc.controller_properties import AutomataProperties
from support.automata_properties import assert_as_defined, checked, system_of
from support.effort import examples
from support.random_cif import random_controller, random_model
from support.random_plain import random_plain


def model(text: str) -> AutomataProperties:
    system = system_of(text)
    assert system is not None
    return checked(system)


SENSOR = "plant S: uncontrollable u_on, u_off; location Off: initial; marked; edge u_on goto On; location On: marked; edge u_off goto Off; end "  # noqa: E501


def test_events_of_one_kind_may_follow_each_other_for_ever() -> None:
    found = model(
        f"""{SENSOR} plant A: controllable c_on, c_off;
        location Off: initial; marked; edge c_on when S.On goto On;
        location On: edge c_off when S.Off goto Off; end"""
    )
    assert (found.controllable.bound, found.uncontrollable.bound) == (1, None)
    assert set(found.uncontrollable.events) == {"S.u_on", "S.u_off"}
    assert found.checks == {
        "bounded_response": False,
        "finite_response": True,
        "confluence": True,
        "nonblocking_under_control": True,
    }


def test_input_variables_change_only_in_between() -> None:
    text = """input bool start, stop; plant M: controllable c_on, c_off;
    location Off: initial; marked; edge c_on when start goto On;
    location On: marked; edge c_off when stop goto Off; end"""
    found = model(text)
    assert (found.uncontrollable.bound, found.controllable.bound) == (0, None)
    assert sorted(found.controllable.events) == ["M.c_off", "M.c_on"]
    found = model(text.replace("when stop", "when stop and not start"))
    assert (found.uncontrollable.bound, found.controllable.bound) == (0, 1)


def test_the_longest_run_is_shown() -> None:
    found = model(
        """plant P: controllable c; uncontrollable u; disc int[0..4] n;
        location: initial; marked; edge c when n < 3 do n := n + 1; edge u when n = 3 do n := 4; end"""
    )
    assert (found.controllable.bound, found.controllable.trace, found.controllable.events) == (3, (), ("P.c",) * 3)
    assert (found.uncontrollable.bound, found.uncontrollable.trace) == (1, ("P.c",) * 3)


# A supervisor must come to rest in a marked state, and takes no uncontrollable event while it is busy.
ORDERS = """controllable c_one, c_two; uncontrollable u_push;
supervisor P: monitor u_push;
  location start: initial; edge c_one goto one; edge c_two goto two;
  location one: {one} edge c_two goto both;
  location two: edge c_one goto both;
  location both: {both} edge u_push goto start;
end
plant Q: location: initial; marked; edge u_push; end
"""


@pytest.mark.parametrize(
    ("one", "both", "holds"), [("", "marked;", True), ("marked;", "", False), ("edge u_push goto rest;", "", False)]
)
def test_nonblocking_under_control(one: str, both: str, holds: bool) -> None:
    text = ORDERS.format(one=one, both=both)
    if "rest" in one:
        text = text.replace("end\nplant", "  location rest: marked;\nend\nplant")
    found = model(text)
    assert found.checks["nonblocking_under_control"] is holds
    assert found.checks["confluence"]


def test_orders_that_never_meet_again() -> None:
    found = model(
        """plant P: controllable a, b, d; uncontrollable u; location x: initial; marked; edge u goto y;
        location y: edge a goto one; edge b goto two; location one: marked; location two: edge d goto three;
        location three: marked; end"""
    )
    assert found.disagreement is not None
    assert found.disagreement.trace == ("P.u",)
    assert {order[0] for order in found.disagreement.orders} == {"P.a", "P.b"}


@pytest.mark.random
@pytest.mark.parametrize("seed", range(examples(60)))
@pytest.mark.parametrize("make", [random_model, random_controller])
def test_random_models(seed: int, make: Callable[[Random], str]) -> None:
    system = system_of(make(Random(seed)).replace("requirement", "supervisor"))
    if system is not None:
        assert_as_defined(system)


@pytest.mark.random
def test_random_plain_automata() -> None:
    outcomes = {(name, holds) for seed in range(examples(150))
                if (found := assert_as_defined(random_plain(Random(seed)))) is not None
                for name, holds in found.checks.items()}  # fmt: skip
    assert len(outcomes) == 8


MODEL = """plant P: controllable a, b; location x: initial; marked; edge a goto one; edge b goto two;
location one: marked; edge a; location two: marked; end
"""


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.cif"
    path.write_text(MODEL)
    assert main(["verify", str(path)]) == 0
    capsys.readouterr()
    assert main(["verify", str(path), "--controller"]) == 1
    out = capsys.readouterr().out
    assert "no finite response: controllable events can follow each other for ever: P.a, after P.a" in out
    assert "no confluence: controllable events can happen in orders that never meet again" in out
    assert main(["verify", str(path), "--controller", "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert report["status"] == "failed"
    assert report["controller"]["controllables_bound"] is None
    assert [item["check"] for item in report["controller"]["faults"]] == [
        "bounded_response", "finite_response", "confluence", "nonblocking_under_control"]  # fmt: skip
    path.write_text(MODEL.replace("edge a;", "").replace("edge b goto two;", ""))
    assert main(["verify", str(path), "--controller"]) == 0
    assert "at most 0 uncontrollable and 1 controllable events in a row" in capsys.readouterr().out
    rsup = tmp_path / "m.rsup"
    assert main(["synth", str(path), "-o", str(rsup)]) == 0
    assert main(["verify", str(rsup), str(path), "--controller"]) == 0
    assert "nonblocking under control passed" in capsys.readouterr().out
    assert main(["verify", str(path), "--controller", "--limit", "1"]) == 1
    assert "not checked: more than 1 states" in capsys.readouterr().out


def test_robots_have_another_command_for_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.rscd"
    path.write_text("robot R { }")
    assert main(["verify", str(path), "--controller"]) == 2
    assert "--controller is for automata" in capsys.readouterr().err
    with pytest.raises(TypeError, match="controller= is for automata"):
        robosc.verify(path, controller=True)
    assert main(["verify", str(path), "--as-is"]) == 2
    assert "--as-is is for automata" in capsys.readouterr().err
    with pytest.raises(TypeError, match="as_is= is for automata"):
        robosc.verify(path, as_is=True)


def test_automata_as_they_stand(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Synthesis would keep the plants from blocking, and the requirement from being broken."""
    path = tmp_path / "m.cif"
    path.write_text("plant P: controllable a, b; location x: initial; marked; edge a goto y; edge b goto z;\n"
                    "location y: marked; location z; end")  # fmt: skip
    assert main(["verify", str(path), "--controller"]) == 0
    capsys.readouterr()
    assert main(["verify", str(path), "--controller", "--as-is"]) == 1
    out = capsys.readouterr().out
    assert "not nonblocking: no marked state can be reached, after P.b" in out
    assert "no confluence" in out
    text = (
        "plant P: uncontrollable u; location x: initial; marked; edge u goto y; location y: marked; end "
        "requirement R: location r: initial; marked; edge P.u; end requirement invariant not P.y;"
    )
    model = robosc.load(text=text, name="m.cif")
    assert not robosc.verify(model).report.get("faults")
    found = robosc.verify(model, as_is=True)
    assert [item["message"] for item in found.report["faults"]] == ["'not P.y' is not true"]
    made = robosc.synthesize(robosc.load(text="plant P: location x: initial; marked; end", name="m.cif")).supervisor
    assert made is not None
    with pytest.raises(TypeError, match="as_is= need a model"):
        robosc.verify(made, as_is=True)
    rsup = tmp_path / "m.rsup"
    made.write(rsup)
    assert main(["verify", str(rsup), str(path), "--as-is"]) == 2
    assert "--as-is: the supervisor is FILE.rsup" in capsys.readouterr().err


def test_a_supervisor_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.cif"
    path.write_text("supervisor S: controllable a; uncontrollable u; location x: initial; marked; edge a goto y;\n"
                    "location y: marked; edge u goto x; end")  # fmt: skip
    assert main(["verify", str(path), "--controller"]) == 1
    out = capsys.readouterr().out
    assert "not safe: S.u can happen against the supervisor, after nothing" in out
    assert "at most 1 uncontrollable and 1 controllable events in a row" in out
    path.write_text("supervisor invariant true;")
    assert main(["verify", str(path)]) == 1
    assert "there is no plant automaton" in capsys.readouterr().err
