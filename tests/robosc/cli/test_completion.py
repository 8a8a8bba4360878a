"""Scripts that complete the commands; what the shells make of them is in acceptance/robosc/test_shell_completion.py."""

import argparse
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from robosc.cli import completion
from robosc.cli.arguments import suggest
from robosc.cli.completion import make_scripts, script_folder
from robosc.cli.main import main
from robosc.diagnostics import pages
from robosc.targets import available_targets

PROGRAMS = ["robosc", "robosc-bridge", "robosc-client", "robosc-lsp", "robosc-server"]


@pytest.mark.parametrize(
    ("shell", "environment", "folder"),
    [
        ("bash", {}, "/home/me/.local/share/bash-completion/completions"),
        ("bash", {"XDG_DATA_HOME": "/data"}, "/data/bash-completion/completions"),
        ("bash", {"BASH_COMPLETION_USER_DIR": "/mine", "XDG_DATA_HOME": "/data"}, "/mine/completions"),
        ("zsh", {}, "/home/me/.local/share/zsh/site-functions"),
        ("fish", {}, "/home/me/.config/fish/completions"),
        ("fish", {"XDG_CONFIG_HOME": "/config"}, "/config/fish/completions"),
    ],
)
def test_where_a_shell_looks(shell: str, environment: dict[str, str], folder: str) -> None:
    assert script_folder(shell, {"HOME": "/home/me", **environment}) == Path(folder)


def test_bash_knows_every_program_code_and_target() -> None:
    scripts = make_scripts("bash")
    assert list(scripts) == PROGRAMS
    for program, script in scripts.items():
        assert script.rstrip().endswith(f" {program}")
    words = set(scripts["robosc"].replace("(", " ").replace(")", " ").split())
    assert {item.code for item in pages()} | {item.name for item in available_targets()} | {"all", "--json"} <= words
    assert subprocess.run(["bash", "-n"], input="\n".join(scripts.values()), text=True, check=False).returncode == 0


@pytest.mark.parametrize(("shell", "file"), [("bash", "robosc"), ("zsh", "_robosc"), ("fish", "robosc.fish")])
def test_they_are_installed_for_the_user(
    shell: str, file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(completion, "_parsers", lambda: [("robosc", completion_parser())])
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME", "BASH_COMPLETION_USER_DIR"):
        monkeypatch.delenv(name, raising=False)
    assert main(["completion", shell, "--install"]) == 0
    captured = capsys.readouterr()
    (path,) = map(Path, captured.out.splitlines())
    assert path.name == file and tmp_path in path.parents
    assert "robosc" in path.read_text(encoding="utf-8")
    assert captured.err.count("\n") == (2 if shell == "zsh" else 1)
    # The same again: an update replaces it.
    assert main(["completion", shell, "--install"]) == 0


def completion_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="robosc")
    parser.add_argument("model", metavar="MODEL")
    return parser


def test_a_folder_that_cannot_be_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / ".config").write_text("a file")
    monkeypatch.setattr(completion, "_parsers", lambda: [("robosc", completion_parser())])
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    assert main(["completion", "fish", "--install"]) == 2
    assert capsys.readouterr().err == f"robosc: cannot write {tmp_path}/.config/fish/completions: Not a directory\n"


def test_a_program_without_its_packages_is_left_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    items = [
        EntryPoint("other", "robosc_no_such_package.main:make_parser", completion.ENTRY_POINT_GROUP),
        EntryPoint("robosc-lsp", "robosc_lsp.command:parser", completion.ENTRY_POINT_GROUP),
    ]
    monkeypatch.setattr(
        "importlib.metadata.entry_points", lambda group: items if group == completion.ENTRY_POINT_GROUP else []
    )
    assert list(make_scripts("bash")) == ["robosc", "robosc-lsp"]
    assert capsys.readouterr().err == "other is left out: the package robosc_no_such_package is not installed\n"


def test_values_that_need_a_missing_package_are_not_offered(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown() -> tuple[str, ...]:
        raise ModuleNotFoundError("No module named 'numpy'")

    parser = argparse.ArgumentParser(prog="robosc")
    suggest(parser.add_argument("--scene"), unknown)
    suggest(parser.add_argument("--robot"), lambda: ("line_follower",))
    monkeypatch.setattr(completion, "_parsers", lambda: [("robosc", parser)])
    script = make_scripts("bash")["robosc"]
    assert "--scene" in script and "line_follower" in script


def test_other_commands_load_no_maker_of_scripts() -> None:
    code = "import sys, robosc.cli.main as it; it.make_parser(); sys.exit('shtab' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
