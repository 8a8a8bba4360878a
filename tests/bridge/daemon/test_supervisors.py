"""Supervisors are made here, read, or asked for; a foreign one is executed only if the verifier passes it."""

import json
import os
from pathlib import Path

import pytest

from robosc.language import load_bundle
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor, encode, make_supervisor
from robosc_bridge.daemon.supervisors import NoSupervisorError, Source, obtain
from support.service import served

GATE = """robot Carrier {
    component Gate {
        outgoing message open with identifier: "/gate/open", type: none
        outgoing message shut with identifier: "/gate/shut", type: none
        behaviour {
            initial marked state closed { on response from open goto opened }
            marked state opened { on response from shut goto closed }
        }
    }
    component Platform {
        incoming message drive with identifier: "/drive", type: double
    }
    requirement drive needs Gate.opened
    provide drive with 0.2
}
"""
CONTROLLER = Deployment.CONTROLLER


def written(folder: Path, text: str = GATE, name: str = "carrier") -> Path:
    file = folder / f"{name}.rscd"
    file.write_text(text, encoding="utf-8")
    return file


def supervisor_of(model: Path, deployment: Deployment = CONTROLLER) -> Supervisor:
    made = make_supervisor(load_bundle(model), deployment=deployment)
    assert made.supervisor is not None
    return made.supervisor


def refusal(source: Source) -> str:
    with pytest.raises(NoSupervisorError) as raised:
        obtain(source)
    assert "\n" not in str(raised.value)
    return str(raised.value)


def test_a_model_is_synthesized_here(tmp_path: Path) -> None:
    model = written(tmp_path)
    told: list[str] = []
    assert obtain(Source(model, CONTROLLER), told.append) == supervisor_of(model)
    assert told == ["carrier.rscd: synthesis"]


def test_a_right_file_is_taken(tmp_path: Path) -> None:
    model = written(tmp_path)
    file = tmp_path / "carrier.rsup"
    file.write_bytes(encode(supervisor_of(model)))
    assert obtain(Source(file, CONTROLLER)) == supervisor_of(model)


def test_a_file_whose_requirement_was_taken_out_is_refused_whatever_it_says_of_itself(tmp_path: Path) -> None:
    model = written(tmp_path)
    careless = written(tmp_path, GATE.replace("requirement drive needs Gate.opened", ""), "careless")
    file = tmp_path / "carrier.rsup"
    file.write_bytes(encode(supervisor_of(careless)))
    assert "not a supervisor of carrier.rscd that can be trusted" in refusal(Source(file, CONTROLLER))
    # Also with the digest of the right texts.
    content = json.loads(file.read_bytes())
    content["supervisor"]["certificate"]["bundle_sha256"] = load_bundle(model).digest
    file.write_text(json.dumps(content))
    assert "carrier.rsup" in refusal(Source(file, CONTROLLER))


def test_a_file_without_its_model_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "carrier.rsup"
    file.write_bytes(encode(supervisor_of(written(tmp_path, name="other"))))
    assert "the model that it is checked against is missing" in refusal(Source(file, CONTROLLER))


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("x.rscd", "robot {", "x.rscd:1:7: error"),
        ("x.rscd", "library L { }", "a library has no robot"),
        ("x.txt", "", "neither a model (.rscd) nor a supervisor (.rsup)"),
        ("carrier.rsup", "{}", "carrier.rsup: "),
        ("missing.rscd", None, "missing.rscd"),
    ],
)
def test_what_is_no_supervisor_is_one_line(tmp_path: Path, name: str, content: str | None, problem: str) -> None:
    written(tmp_path)
    if content is not None:
        (tmp_path / name).write_text(content)
    assert problem in refusal(Source(tmp_path / name, CONTROLLER))


def test_a_supervisor_for_another_deployment_is_refused(tmp_path: Path) -> None:
    model = written(tmp_path)
    file = tmp_path / "carrier.rsup"
    file.write_bytes(encode(supervisor_of(model, Deployment.LAYER)))
    assert "made for the deployment layer, not controller" in refusal(Source(file, CONTROLLER))


def test_a_robot_without_a_supervisor_is_told_so(tmp_path: Path) -> None:
    text = """robot Stuck {
        component Base {
            incoming message drive with identifier: "/drive", type: double
            behaviour { initial state waiting { on request to drive goto done } marked state done { } }
        }
        requirement drive needs Base.done
        provide drive with 0.2
    }"""
    assert "no supervisor exists" in refusal(Source(written(tmp_path, text), CONTROLLER))


# From a server.


def test_what_a_server_makes_is_checked_kept_and_taken_again_without_it(tmp_path: Path) -> None:
    model, kept = written(tmp_path), tmp_path / "kept"
    with served() as address:
        source = Source(model, CONTROLLER, address, kept)
        assert obtain(source) == supervisor_of(model)
    (file,) = kept.iterdir()
    told: list[str] = []
    assert obtain(source, told.append) == supervisor_of(model)
    assert any("what it made last is taken" in text for text in told)
    # Another model has none.
    other = Source(written(tmp_path, GATE.replace("0.2", "0.3"), "other"), CONTROLLER, address, kept)
    assert "none is kept of an earlier start" in refusal(other)
    # What was kept is not trusted for being there.
    file.write_bytes(encode(supervisor_of(written(tmp_path, GATE.replace("needs Gate.opened", "needs true"), "bad"))))
    assert "that can be trusted" in refusal(source)


def test_without_a_folder_nothing_is_kept(tmp_path: Path) -> None:
    with served() as address:
        obtain(Source(written(tmp_path), CONTROLLER, address))
    assert [path.name for path in tmp_path.iterdir()] == ["carrier.rscd"]


def test_a_disk_that_takes_nothing_does_not_prevent_the_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(number: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    model, kept = written(tmp_path), tmp_path / "kept"
    told: list[str] = []
    with served() as address:
        assert obtain(Source(model, CONTROLLER, address, kept), told.append) == supervisor_of(model)
    assert "cannot be kept" in told[-1]
    assert list(kept.iterdir()) == []


def test_what_a_server_refuses_is_told(tmp_path: Path) -> None:
    with served() as address:
        assert "x.rscd:1:7: error" in refusal(Source(written(tmp_path, "robot {", "x"), CONTROLLER, address))
