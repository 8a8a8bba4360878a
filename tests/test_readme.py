"""Checks that everything that the README shows is true."""

import re
import shlex
from pathlib import Path

import pytest

from robosc.certification import OutcomeStatus, make_supervisor
from robosc.cli.main import make_parser
from robosc_bridge import main as bridge
from robosc_client.main import make_parser as client_parser
from robosc_simulated import __main__ as simulated
from support.models import bundle_of

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```\n(.*?)```", README, re.DOTALL)
COMMANDS = [line.partition("#")[0].rstrip(" &") for block in BLOCKS for line in block.splitlines()]

BRIDGE = (ROOT / "bridge" / "README.md").read_text(encoding="utf-8")
SHOWN = [line.removeprefix("$ ").partition("#")[0] for line in BRIDGE.splitlines()]


def test_the_model_has_no_findings_and_a_supervisor() -> None:
    (model,) = [block for block in BLOCKS if block.startswith("robot ")]
    made = make_supervisor(bundle_of(model))
    assert (made.status, made.diagnostics) == (OutcomeStatus.SUPERVISOR, ())


@pytest.mark.parametrize("command", [line for line in COMMANDS if re.match(r"robosc(-client)? ", line)])
def test_the_commands_are_understood(command: str) -> None:
    program, *arguments = shlex.split(command)
    parser = make_parser() if program == "robosc" else client_parser()
    parsed = parser.parse_args(arguments)
    for place in (getattr(parsed, "model", None), *getattr(parsed, "paths", ())):
        assert place is None or (ROOT / place).exists()


@pytest.mark.parametrize(
    "command", [line for line in SHOWN if re.match(r"robosc-bridge \w|python -m robosc_bridge", line)]
)
def test_the_bridges_commands_are_understood(command: str) -> None:
    words = shlex.split(command)
    parser, arguments = (
        (bridge._parser(), words[1:]) if words[0] == "robosc-bridge" else (simulated._parser(), words[3:])
    )
    parsed = parser.parse_args(arguments)
    model = getattr(parsed, "model", None)
    assert model is None or (ROOT / model).exists() or "/" not in str(model)


@pytest.mark.parametrize("command", [line for line in COMMANDS if line.startswith("make ")])
def test_the_make_targets_exist(command: str) -> None:
    assert f"\n{command.split()[1]}: " in (ROOT / "Makefile").read_text(encoding="utf-8")


def test_everything_on_the_map_is_there() -> None:
    table = README.partition("## Where does X live?")[2].partition("## Develop")[0]
    places = re.findall(r"`([^`]+)`", table.partition("| --- | --- |")[2])
    assert len(places) > 15
    assert [place for place in places if not (ROOT / place).exists()] == []
