"""Examination of the computer and a configuration: nothing is opened, and each lack comes with its remedy."""

import json
import os
from pathlib import Path

import pytest

from robosc.doctor import Finding, Grade
from robosc_bridge.first_drive import commands
from robosc_bridge.main import main


@pytest.fixture(autouse=True)
def _sound(monkeypatch: pytest.MonkeyPatch) -> None:
    """A computer with which nothing is wrong: `robosc doctor` has tests of its own."""
    monkeypatch.setattr(commands, "examine", lambda machine, purposes: (Finding("Python", Grade.OK, "it is there"),))


def configured(folder: Path, port: str, driver: str = "opencr") -> Path:
    file = folder / "bridge.yaml"
    file.write_text(f"robot: burger\ndrive: {{driver: {driver}, port: {port}}}\nchannels: {{}}\n")
    return file


def findings(out: str) -> dict[str, dict[str, str]]:
    return {item["part"]: item for item in json.loads(out)["findings"]}


def test_a_port_that_is_not_there_is_reported_with_where_to_look(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["doctor", "--config", str(configured(tmp_path, "/dev/none")), "--json"]) == 1
    out = capsys.readouterr().out
    assert not json.loads(out)["ok"]
    found = findings(out)
    assert found["configuration"]["grade"] == "ok"
    assert found["drive.port"]["message"] == "/dev/none: there is no such port"
    assert "robosc-bridge probe" in found["drive.port"]["fix"]


def test_a_configuration_that_cannot_be_is_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--config", str(configured(tmp_path, "/dev/none", "hoover")), "--json"]) == 1
    assert "hoover" in findings(capsys.readouterr().out)["configuration"]["message"]
    assert main(["doctor", "--config", str(tmp_path / "none.yaml")]) == 1
    assert "none.yaml" in capsys.readouterr().out


def test_a_name_that_depends_on_the_order_of_plugging_in_is_noted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    port = tmp_path / "ttyACM0"
    port.touch()
    monkeypatch.setattr(commands, "stable_name", lambda path: "/dev/robosc-opencr")
    assert main(["doctor", "--config", str(configured(tmp_path, str(port)))]) == 0
    out = capsys.readouterr().out
    assert f"note     drive.port: {port}: this name depends on the order of plugging in" in out
    assert "drive.port: /dev/robosc-opencr" in out
    # One that is such a name already is well.
    link = tmp_path / "robosc-opencr"
    link.symlink_to(port)
    assert main(["doctor", "--config", str(configured(tmp_path, str(link)))]) == 0
    assert f"{link} can be read and written" in capsys.readouterr().out


def test_a_port_without_permission_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    port = tmp_path / "ttyACM0"
    port.touch()
    # The user of the tests may be root, who may do everything.
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    assert main(["doctor", "--config", str(configured(tmp_path, str(port)))]) == 1
    assert "usermod -aG dialout" in capsys.readouterr().out


def test_a_network_address_is_no_port(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = configured(tmp_path, "udpin:127.0.0.1:14550", "mavlink-rover")
    assert main(["doctor", "--config", str(file), "--json"]) == 0
    assert set(findings(capsys.readouterr().out)) == {"Python", "configuration"}
