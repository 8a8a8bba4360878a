"""The results of the Python API are those that the command line prints, document by document and file by file."""

import json
import pickle
import tempfile
from pathlib import Path
from typing import Any

import pytest

import robosc
from robosc.cli.main import main
from robosc.explanation import document
from robosc.json_documents import diagnostics_json
from support.models import EMPTY, EXAMPLE_DEPLOYMENTS, EXAMPLES, UNSUPPORTED

WRONG = "robot R { component C { outgoing message m with type: nothing } requirement n needs C.s }"
LIBRARY = "library L { datatype object Pair { a: double } }"
LIVELOCK = """robot R {
    component C {
        outgoing message tick with type: boolean
        behaviour {
            variable on: boolean
            on response from tick do on := value
            initial marked state a { transition goto b }
            state b { transition goto a }
        }
    }
}"""
TEXTS = {"empty": EMPTY, "unsupported": UNSUPPORTED, "wrong": WRONG, "library": LIBRARY, "livelock": LIVELOCK}
PROPERTIES = ("reachable true", "invariant false", "first: AG EF true")


@pytest.fixture(params=[*EXAMPLE_DEPLOYMENTS, *TEXTS], ids=str)
def given(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, robosc.SynthesisOptions]:
    """A model's file, and options for it."""
    if isinstance(request.param, str):
        path = tmp_path / f"{request.param}.rscd"
        path.write_text(TEXTS[request.param], encoding="utf-8")
        return path, robosc.SynthesisOptions()
    name, deployment = request.param
    return EXAMPLES / f"{name}.rscd", robosc.SynthesisOptions(deployment=deployment)


def printed(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, Any]:
    """The exit status of a command, and the document that it prints."""
    status = main([*map(str, arguments), "--json"])
    return status, json.loads(capsys.readouterr().out)


def through_json(values: object) -> Any:
    return json.loads(json.dumps(values))


def reasons(result: robosc.Synthesis | robosc.Exploration) -> dict[str, Any]:
    """The fields that say why there is no supervisor."""
    found = result.explanation
    is_explained = found is not None and not isinstance(found, robosc.NoSupervisor)
    return {
        "status": str(result.status),
        "reason": result.reason,
        "explanation": document(found) if found is not None and is_explained else None,  # type: ignore[arg-type]
        **diagnostics_json(result.diagnostics),
    }


def test_check(capsys: pytest.CaptureFixture[str], given: tuple[Path, robosc.SynthesisOptions]) -> None:
    path, _ = given
    status, expected = printed(capsys, "check", path)
    found = robosc.check(path)
    assert through_json({"file": str(path), **found.to_json()}) == expected
    assert found.has_errors == (status == 1)
    assert main(["check", str(path)]) == status
    captured = capsys.readouterr()
    assert str(found) + "\n" == (captured.err or captured.out.partition(": ")[2])


def test_synthesize(
    capsys: pytest.CaptureFixture[str], given: tuple[Path, robosc.SynthesisOptions], tmp_path: Path
) -> None:
    path, options = given
    file = tmp_path / "command.rsup"
    status, expected = printed(capsys, "synth", path, "--deployment", options.deployment, "-o", file)
    result = robosc.synthesize(path, options)
    if result.status is robosc.SynthesisStatus.UNSUPPORTED_MODEL:
        assert result.reason == expected["error"]["message"]
        assert str(result.explanation).endswith(result.reason)
        return
    summary = result.supervisor.to_json() if result.supervisor else None
    found = {**reasons(result), "summary": summary, "file": str(file) if result.supervisor else None}
    assert through_json(found) == expected
    assert (result.supervisor is None) == (status == 1)
    assert (result.supervisor is None) == (result.explanation is not None) == (not file.exists())
    if result.supervisor is not None:
        assert result.supervisor.write(tmp_path / "api.rsup").read_bytes() == file.read_bytes()
        assert robosc.Supervisor.read(file) == result.supervisor
        assert {event: item.text for event, item in result.supervisor.conditions.items()} == expected["summary"][
            "added"
        ]


def test_explore(capsys: pytest.CaptureFixture[str], given: tuple[Path, robosc.SynthesisOptions]) -> None:
    path, options = given
    status, expected = printed(capsys, "explore", path, "--deployment", options.deployment)
    found = robosc.explore(path, options)
    if found.graph is not None:
        assert through_json(found.graph.to_json()) == expected
        assert main(["explore", str(path), "--deployment", options.deployment, "--dot"]) == status == 0
        assert capsys.readouterr().out == found.graph.dot
    elif found.status is robosc.SynthesisStatus.UNSUPPORTED_MODEL:
        assert found.reason == expected["error"]["message"]
    else:
        assert through_json(reasons(found)) == expected


def test_explain(capsys: pytest.CaptureFixture[str], given: tuple[Path, robosc.SynthesisOptions]) -> None:
    path, options = given
    status, expected = printed(capsys, "explain-synthesis", path, "--deployment", options.deployment)
    found = robosc.explain(path, options)
    if found.status is robosc.SynthesisStatus.UNSUPPORTED_MODEL:
        assert found.reason == expected["error"]["message"]
        assert isinstance(found.explanation, robosc.NoSupervisor)
        assert found.explanation.reason == found.reason
        return
    assert (str(found.status), found.reason) == (expected["status"], expected.get("reason", ""))
    assert through_json(diagnostics_json(found.diagnostics)) == {
        key: expected[key] for key in ("errors", "warnings", "notes", "diagnostics")
    }
    if isinstance(found.explanation, robosc.NoSupervisor):
        assert expected["explanation"] is None
        assert found.explanation.reason == found.reason
    elif isinstance(found.explanation, robosc.GoalExplanation):
        assert through_json(found.explanation.document()) == expected["goals"]
        assert main(["explain-synthesis", str(path), "--deployment", options.deployment]) == status
        assert str(found.explanation) in capsys.readouterr().out
    else:
        assert through_json(document(found.explanation)) == expected["explanation"]
        assert main(["explain-synthesis", str(path), "--deployment", options.deployment]) == status
        assert capsys.readouterr().out.endswith(str(found.explanation) + "\n")


def test_properties(capsys: pytest.CaptureFixture[str], given: tuple[Path, robosc.SynthesisOptions]) -> None:
    path, options = given
    asked = [argument for text in PROPERTIES for argument in ("--property", text)]
    deployment = ("--deployment", options.deployment)
    status, expected = printed(capsys, "verify", path, *deployment, *asked)
    found = robosc.verify(path, PROPERTIES, options=options)
    if found.status is robosc.VerificationStatus.UNSUPPORTED_MODEL:
        assert found.reason == expected["error"]["message"]
        return
    assert through_json(found.report) == expected
    assert found.passed == (status == 0) is False
    assert found.holds in ((True, False, True), ())
    if found.holds:
        assert main(["verify", str(path), *deployment, *asked]) == status
        assert str(found) + "\n" == capsys.readouterr().out


def test_a_supervisor(
    capsys: pytest.CaptureFixture[str], given: tuple[Path, robosc.SynthesisOptions], tmp_path: Path
) -> None:
    path, options = given
    navigation = robosc.synthesize(EXAMPLES / "navigation" / "navigation.rscd").supervisor
    assert navigation is not None
    own = robosc.synthesize(path, options).supervisor
    for supervisor in filter(None, (navigation, own)):
        file = supervisor.write(tmp_path / "some.rsup")
        status, expected = printed(capsys, "verify", file, path)
        for handed in (supervisor, file, file.read_bytes()):
            found = robosc.verify(path, supervisor=handed)
            assert through_json(found.report) == expected
            assert found.passed == (status == 0) == (supervisor is own or "navigation" in path.name)
        if "library" not in path.name:
            main(["verify", str(file), str(path)])
            message = (
                capsys.readouterr().out.replace(f"{file}: ", f"{supervisor.model.name}: ").replace(f"{path}", path.name)
            )
            assert str(found).endswith(message.rstrip())


def test_a_supervisor_alone_is_checked_against_its_model() -> None:
    path = EXAMPLES / "navigation" / "navigation.rscd"
    supervisor = robosc.synthesize(path).supervisor
    assert supervisor is not None
    alone, of_the_model = robosc.verify(supervisor), robosc.verify(path)
    assert alone.passed
    assert (alone.status, alone.report) == (of_the_model.status, of_the_model.report)
    assert alone.report == robosc.verify(path, supervisor=supervisor).report
    broken = robosc.verify(supervisor.supervising(supervisor.executable, (), supervisor.certificate))
    assert broken.status is robosc.VerificationStatus.FAILED


def test_generate(
    capsys: pytest.CaptureFixture[str], given: tuple[Path, robosc.SynthesisOptions], tmp_path: Path
) -> None:
    path, options = given
    folder = tmp_path / "command"
    arguments = ("generate", path, "--deployment", options.deployment, "--target", "all", "-o", folder)
    status, expected = printed(capsys, *arguments)
    found = robosc.generate(path, "all", options=options)
    assert (found.files is not None) == (status == 0)
    if found.files is None:
        reason = expected["error"]["message"] if "error" in expected else expected["reason"]
        assert found.reason == reason
        if isinstance(found.explanation, robosc.GoalExplanation):
            assert through_json(found.explanation.document()) == expected["goals"]
        else:
            explanation = document(found.explanation) if found.explanation else None
            assert through_json(explanation) == expected.get("explanation")
        with pytest.raises(robosc.NothingGeneratedError, match="nothing was generated: "):
            found.write(tmp_path / "nothing")
        assert not (tmp_path / "nothing").exists()
        return
    written = found.write(tmp_path / "api")
    assert [str(item.relative_to(tmp_path / "api")) for item in written.files] == [
        str(Path(item).relative_to(folder)) for item in expected["files"]
    ]
    assert list(written.left_out) == expected["left_out"]
    for item in written.files:
        assert item.read_bytes() == (folder / item.relative_to(tmp_path / "api")).read_bytes()
    # The supervisor alone brings its findings along: targets see the same.
    supervisor = robosc.synthesize(path, options).supervisor
    assert supervisor is not None
    assert robosc.generate(supervisor, "all").files == found.files


def test_nothing_is_generated_where_findings_that_forbid_it_are_not_known(tmp_path: Path) -> None:
    model = EXAMPLES / "maze_solver" / "maze_solver.rscd"
    made = robosc.synthesize(model).supervisor
    assert made is not None and made.diagnostics == ()
    assert robosc.generate(made, "python").files
    read = robosc.Supervisor.read(made.write(tmp_path / "made.rsup"))
    assert (read, read.diagnostics) == (made, None)
    for unknown in (read, pickle.loads(pickle.dumps(read))):
        refused = robosc.generate(unknown, "python")
        assert (refused.files, refused.status) == (None, robosc.SynthesisStatus.UNSUPPORTED_MODEL)
        assert refused.reason.endswith(
            "generate from the model, or from the supervisor that robosc.synthesize returned"
        )
        with pytest.raises(robosc.NothingGeneratedError, match="generate from the model"):
            refused.write(tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert robosc.explore(read).graph == robosc.explore(made).graph


def test_a_file_is_made_beside_the_one_that_it_becomes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = robosc.synthesize(EXAMPLES / "maze_solver" / "maze_solver.rscd").supervisor
    assert made is not None
    # Elsewhere it could be on another disk, from which nothing is moved at once.
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    file = made.write(tmp_path / "made.rsup")
    assert file.read_bytes() == made.encode()
    assert list(tmp_path.iterdir()) == [file]
