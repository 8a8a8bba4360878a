"""Checks that everything that the README, and the pages that it was made of, show is true."""

import re
import shlex
from pathlib import Path

import pytest

import robosc
from robosc.certification import OutcomeStatus, make_supervisor
from robosc.cli import main as command_line
from robosc.cli.plugins import wanted_plugins
from robosc_bridge import main as bridge
from robosc_client.main import make_parser as client_parser
from robosc_simulated import __main__ as simulated
from support.models import bundle_of

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
SHORT = (ROOT / "docs" / "commands.md", ROOT / "docs" / "on-your-robot.md")
TEXTS = [README, *(page.read_text(encoding="utf-8") for page in SHORT)]
FENCES = [fence for text in TEXTS for fence in re.findall(r"^```(\w*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)]
BLOCKS = [block for language, block in FENCES if not language]
COMMANDS = [line.partition("#")[0].rstrip(" &") for block in BLOCKS for line in block.splitlines()]
PICTURE = ROOT / "docs" / "pictures" / "live-view.png"

BRIDGE = (ROOT / "bridge" / "README.md").read_text(encoding="utf-8")
SHOWN = [line.removeprefix("$ ").partition("#")[0] for line in BRIDGE.splitlines()]


def test_the_model_has_no_findings_and_a_supervisor() -> None:
    (model,) = re.findall(r"^```robosc\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
    made = make_supervisor(bundle_of(model))
    assert (made.status, made.diagnostics) == (OutcomeStatus.SUPERVISOR, ())
    assert made.supervisor is not None
    summary = str(robosc.Supervisor.of(made.supervisor).summary)
    (added,) = [block for block in BLOCKS if block.startswith("    open.request")]
    assert [line for line in added.splitlines() if line not in summary] == []


def test_the_readme_is_short_and_has_its_picture() -> None:
    assert len(README.splitlines()) <= 100
    assert f"]({PICTURE.relative_to(ROOT)})" in README
    assert 20_000 < PICTURE.stat().st_size < 200_000


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md", "bridge/README.md", "examples/README.md"])
def test_links_lead_somewhere(name: str) -> None:
    page = ROOT / name
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    assert links
    assert [link for link in links if not (page.parent / link).exists()] == []


def test_every_target_is_in_the_matrix() -> None:
    table = "".join(line for line in README.splitlines() if line.startswith("|"))
    assert [
        info.name for info in robosc.targets.available_targets() if f"`{info.name}`" not in table.replace(", ", "`, `")
    ] == []


@pytest.mark.parametrize("command", [line for line in COMMANDS if re.match(r"robosc(-client)? ", line)])
def test_the_commands_are_understood(command: str) -> None:
    program, *arguments = shlex.split(command)
    parser = (
        command_line.make_parser(wanted_plugins(arguments, command_line.COMMANDS))
        if program == "robosc"
        else client_parser()
    )
    parsed = parser.parse_args(arguments)
    for place in (getattr(parsed, "model", None), *getattr(parsed, "paths", ())):
        # A reader has made a robot called Patrol, or writes MODEL in place of it.
        assert place is None or str(place).startswith(("patrol", "MODEL")) or (ROOT / place).exists()


@pytest.mark.parametrize(
    "command", [line for line in SHOWN if re.match(r"robosc-bridge \w|python -m robosc_bridge", line)]
)
def test_the_bridges_commands_are_understood(command: str) -> None:
    words = shlex.split(command)
    parser, arguments = (
        (bridge.make_parser(), words[1:]) if words[0] == "robosc-bridge" else (simulated._parser(), words[3:])
    )
    parsed = parser.parse_args(arguments)
    model = getattr(parsed, "model", None)
    assert model is None or (ROOT / model).exists() or "/" not in str(model)


@pytest.mark.parametrize("command", [line for line in COMMANDS if line.startswith("make ")])
def test_the_make_targets_exist(command: str) -> None:
    assert f"\n{command.split()[1]}: " in (ROOT / "Makefile").read_text(encoding="utf-8")


def test_everything_on_the_map_is_there() -> None:
    table = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8").partition("| --- | --- |")[2]
    places = re.findall(r"`([^`\s]+/[^`\s]*)`", table)
    assert len(places) > 40
    assert [place for place in places if not (ROOT / place).exists()] == []


def test_every_path_in_the_guide_for_contributors_is_there() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    text = re.sub(r"duplicate-state\.md|out/[\w/]*", "", text)
    places = re.findall(r"`((?:[\w.-]+/)+[\w.-]*)`", text)
    assert len(places) > 15
    assert [place for place in places if not (ROOT / place).exists()] == []
