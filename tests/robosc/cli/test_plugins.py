"""Commands of other packages, from distributions that are really on the path."""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import pytest

from robosc.cli import main as main_module
from robosc.cli.main import main, make_parser
from robosc.cli.plugins import wanted_plugins

GOOD = """
def add_parser(commands):
    parser = commands.add_parser("greet", help="greet somebody")
    parser.add_argument("who")
    parser.add_argument("--json", action="store_true")
    parser.set_defaults(run=run)

def run(arguments):
    if arguments.who == "later":
        import robosc_no_such_package.inner
    print("hello", arguments.who)
    return 0 if arguments.who else 1
"""
MODULES = {
    "greet": GOOD,
    "check": "raise AssertionError('a built-in command is not replaced')",
    "absent": "import robosc_no_such_package.part",
    "broken": "raise RuntimeError('100% broken\\nby itself')",
    "hollow": "",
}


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A distribution with commands of every kind."""
    metadata = tmp_path / "greeting-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: greeting\nVersion: 1.0\n", encoding="utf-8")
    lines = ["[robosc.commands]", *(f"{name} = robosc_test_{name}" for name in MODULES)]
    (metadata / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    for name, text in MODULES.items():
        (tmp_path / f"robosc_test_{name}.py").write_text(text, encoding="utf-8")
        monkeypatch.delitem(sys.modules, f"robosc_test_{name}", raising=False)
    monkeypatch.syspath_prepend(tmp_path)


@pytest.mark.usefixtures("installed")
def test_a_command_of_another_package_runs(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["greet", "you"]) == 0
    assert capsys.readouterr().out == "hello you\n"
    assert main(["greet", ""]) == 1


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["absent"], "'robosc absent' needs the package robosc_no_such_package, which is not installed"),
        (["absent", "-o", "x", "--speed", "3"], "'robosc absent' needs the package robosc_no_such_package, which is"),
        (["greet", "later"], "'robosc greet' needs the package robosc_no_such_package, which is not installed"),
        (["broken"], "'robosc broken' cannot be loaded: 100% broken by itself"),
        (["hollow"], "'robosc hollow' cannot be loaded: robosc_test_hollow is not a command"),
    ],
)
def test_what_cannot_run_says_why_in_one_sentence(
    arguments: list[str], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    output = capsys.readouterr()
    assert output.err.startswith(f"robosc: {problem}")
    assert (output.out, output.err.count("\n")) == ("", 1)


@pytest.mark.usefixtures("installed")
def test_also_for_machines(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["greet", "later", "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["error"]["status"] == 2


@pytest.mark.usefixtures("installed")
def test_all_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (["--help"], ["-h"]):
        with pytest.raises(SystemExit) as caught:
            main(arguments)
        assert caught.value.code == 0
        words = " ".join(capsys.readouterr().out.split())
        assert "greet greet somebody" in words
        assert "absent not available: 'robosc absent' needs the package robosc_no_such_package" in words
    with pytest.raises(SystemExit) as caught:
        main(["gret"])
    assert caught.value.code == 2
    assert "greet" in capsys.readouterr().err


def test_built_in_commands_are_those_that_the_parser_has() -> None:
    (found,) = (item for item in make_parser()._actions if isinstance(item, argparse._SubParsersAction))
    assert sorted(found.choices) == sorted(main_module.COMMANDS)


def test_who_calls_a_built_in_command_does_not_even_look(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(group: str) -> None:
        raise AssertionError(group)

    monkeypatch.setattr("importlib.metadata.entry_points", refuse)
    for argv in (["check", "x"], ["synth"], ["--version"], ["check-log", "--help"]):
        assert wanted_plugins(argv, main_module.COMMANDS) == ()


def test_check_loads_nothing_of_it() -> None:
    program = (
        "import sys\nfrom robosc.cli.main import main\nmain(['check', 'none.rscd'])\n"
        "sys.exit(bool({'robosc.cli.plot', 'robosc.event_logs', 'matplotlib', 'dd'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False, stderr=subprocess.DEVNULL).returncode == 0


def test_automata_load_no_parser_or_check_of_models(tmp_path: Path) -> None:
    model = tmp_path / "lamp.cif"
    model.write_text("plant lamp: controllable c; location: initial; marked; edge c; end")
    program = (
        f"import sys\nfrom robosc.cli.main import main\nmain(['synth', {str(model)!r}])\nprint(*sys.modules, sep='\\n')"
    )
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    found = set(done.stdout.splitlines())
    assert "robosc.cif.parser" in found
    assert not {"robosc.language.parser", "robosc.model.check", "robosc.verification", "robosc.targets"} & found
