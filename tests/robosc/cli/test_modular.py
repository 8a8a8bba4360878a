"""Robots taken apart on the command line: `--modular`."""

import json
from pathlib import Path

import pytest

from robosc.cli.main import main
from robosc.supervisor import decode, encode
from robosc.targets import available_targets

COMPONENT = """
component C{0} {{
  incoming message go{0} with identifier: "/go{0}", type: none
  incoming message back{0} with identifier: "/back{0}", type: none
  outgoing message done{0} with identifier: "/done{0}", type: none
  behaviour {{
    initial marked state idle {{ on request to go{0} goto busy }}
    state busy {{ on response from done{0} goto out }}
    state out {{ on request to back{0} goto idle }}
  }}
}}
"""


def robot(count: int, *more: str) -> str:
    """No two neighbours in a row are ever out."""
    rules = (f"requirement never C{number}.out and C{number + 1}.out\n" for number in range(count - 1))
    return f"robot Row {{ {''.join(map(COMPONENT.format, range(count)))} {''.join(rules)} {' '.join(more)} }}"


@pytest.fixture
def model(tmp_path: Path) -> str:
    path = tmp_path / "row.rscd"
    path.write_text(robot(4))
    return str(path)


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = main(list(arguments))
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_modules_are_told(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "synth", model, "--modular", "--statistics")
    lines = out.splitlines()
    assert status == 0
    assert "  it was synthesized in 3 modules" in lines
    place = lines.index("    1, 5 states: C0, C1")
    assert lines[place + 1] == "      requirement never C0.out and C1.out"
    assert "    nonblocking together, as found on abstractions: 1, 2, 3" in lines
    document = json.loads(run(capsys, "synth", model, "--modular", "--json")[1])
    modules = document["summary"]["modules"]
    assert modules[0] == {
        "components": ["C0", "C1"],
        "requirements": ["requirement never C0.out and C1.out"],
        "states": 5,
        "group": 1,
    }
    assert sorted({text for item in modules for text in item["requirements"]}) == [
        f"requirement never C{number}.out and C{number + 1}.out" for number in range(3)
    ]
    whole = json.loads(run(capsys, "synth", model, "--json")[1])["summary"]
    assert (whole["modules"], whole["added"]) == ([], document["summary"]["added"])
    assert whole["states"] == document["summary"]["states"]


def test_a_file_of_modules_is_verified(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Modules show that nothing more is forbidden, where the whole is too large for the limits."""
    Path(model).write_text(robot(8))
    output = tmp_path / "row.rsup"
    assert run(capsys, "synth", model, "--modular", "-o", str(output))[0] == 0
    limits = ("--strict", "--limit", "2000")
    status, out, _ = run(capsys, "verify", str(output), model, *limits)
    assert status == 0
    assert "safe and maximally permissive by explicit search of 3 modules" in out
    assert encode(decode(output.read_bytes())) == output.read_bytes()
    weaker = output.with_name("weaker.rsup")
    document = json.loads(output.read_text())
    removed = document["supervisor"]["added"].pop()
    weaker.write_text(json.dumps(document))
    status, out, _ = run(capsys, "verify", str(weaker), model)
    assert (status, "  safe                  failed" in out.splitlines()) == (1, True)
    stronger = output.with_name("stronger.rsup")
    document["supervisor"]["added"].append({**removed, "condition": {"nodes": [], "root": 0}})
    stronger.write_text(json.dumps(document))
    assert run(capsys, "verify", str(stronger), model, *limits)[0] == 1


def test_modules_of_a_file_are_of_its_model(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "row.rsup"
    run(capsys, "synth", model, "--modular", "-o", str(output))
    for field, value, problem in (
        ("automata", ["C9"], "automata or requirements"),
        ("invariants", [3], "automata or requirements"),
        ("requirements", [0], "automata or requirements"),
        ("states", "0", "states of a module"),
        ("group", 0, "group"),
    ):
        document = json.loads(output.read_text())
        document["supervisor"]["modules"][0][field] = value
        other = output.with_name("other.rsup")
        other.write_text(json.dumps(document))
        status, out, err = run(capsys, "verify", str(other), model)
        assert (status, problem in out + err) == (1, True), (field, out, err)


def test_a_large_robot_is_certified_in_modules(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "row.rscd"
    path.write_text(robot(60))
    status, out, _ = run(capsys, "synth", str(path), "--modular", "--json")
    certificate = json.loads(out)["summary"]["certificate"]
    assert status == 0
    checks = ("safe", "controllable", "nonblocking", "maximally_permissive")
    assert [certificate[name] for name in checks] == ["passed"] * 4
    whole = json.loads(run(capsys, "synth", str(path), "--json")[1])["summary"]
    assert whole["certificate"]["maximally_permissive"] == "not checked"
    assert whole["states"] == json.loads(out)["summary"]["states"]


def test_no_supervisor_names_the_module(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "row.rscd"
    path.write_text(robot(5, "requirement always C3.busy or C4.busy"))
    for command in ("synth", "explain-synthesis"):
        status, out, err = run(capsys, command, str(path), "--modular")
        assert status == 1
        assert "no supervisor exists" in out + err
        assert "requirement always C3.busy or C4.busy" in out + err
        assert "C0" not in out + err


def test_events_are_explained_in_their_modules(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "explain-synthesis", model, "--modular", "--event", "go1")
    assert status == 0
    assert "go1.request, in the module of C0, C1 alone: restricted" in out.splitlines()
    assert "'requirement never C0.out and C1.out' is broken" in out
    document = json.loads(run(capsys, "explain-synthesis", model, "--modular", "--json")[1])
    events = document["explanation"]["events"]
    assert {item["event"] for item in events} == {f"{verb}{n}.request" for verb in ("go", "back") for n in range(4)}
    assert all(len(item["module"]) == 2 for item in events)
    status, _, err = run(capsys, "explain-synthesis", model, "--modular", "--state", "C0.out")
    assert (status, err.count("\n"), "--modular explains events" in err) == (2, 1, True)


@pytest.mark.parametrize("target", sorted(item.name for item in available_targets()))
def test_every_target_takes_modules(
    target: str, model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folders = {}
    for option in ("--modular", "--force"):
        folder = tmp_path / option.strip("-")
        status, _, err = run(capsys, "generate", model, "--target", target, "-o", str(folder), option)
        assert status == 0, err
        folders[option] = {
            str(item.relative_to(folder)): item.read_bytes() for item in folder.rglob("*") if item.is_file()
        }
    assert folders["--modular"].keys() == folders["--force"].keys()
