"""Start and end of every installed command: what Ctrl-C does at any moment, and what a bare command prints."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

# The interrupt comes in the very moment in which a module is looked for, or when the interpreter ends.
CODE = """
import atexit, os, signal, sys
def interrupt():
    os.kill(os.getpid(), signal.SIGINT)
class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == {moment!r}:
            interrupt()
sys.meta_path.insert(0, Interrupt())
if {moment!r} == "exit":
    atexit.register(interrupt)
if {is_background!r}:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
sys.argv = [{program!r}, *{words!r}]
from {module} import entry
entry()
"""

SCRIPTS: dict[str, str] = tomllib.loads(
    (Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8")
)["project"]["scripts"]  # fmt: skip


def started(
    program: str, *words: str, moment: str = "", is_background: bool = False
) -> subprocess.CompletedProcess[str]:
    module, _, name = SCRIPTS[program].partition(":")
    assert name == "entry"
    code = CODE.format(program=program, module=module, words=words, moment=moment, is_background=is_background)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=240, check=False)


@pytest.mark.parametrize(
    ("program", "words", "moments"),
    [
        ("robosc", "check nothing.rscd", ("robosc.cli.main", "msgspec", "robosc.language", "exit")),
        ("robosc", "view", ("robosc_view.command",)),
        ("robosc-client", "check nothing.rscd --server 127.0.0.1:1", ("robosc_client.main", "exit")),
        ("robosc-bridge", "drivers", ("robosc_bridge.main", "robosc_bridge.assembly", "exit")),
        ("robosc-bridge", "stop", ("robosc_bridge.terminal.commands", "grpc")),
        ("robosc-bridge", "health --config nothing.yaml", ("robosc_bridge.health_check",)),
        ("robosc-server", "--version", ("robosc_server.main", "pydantic", "exit")),
        ("robosc-server", "health", ("robosc_server.operations.health_check",)),
        ("robosc-lsp", "--check", ("pygls", "exit")),
    ],
)
def test_ctrl_c_is_one_line_at_any_moment(program: str, words: str, moments: tuple[str, ...]) -> None:
    for moment in moments:
        done = started(program, *words.split(), moment=moment)
        lines = done.stderr.splitlines()
        assert (done.returncode, lines[-1]) == (130, f"{program}: interrupted"), moment
        # The command's own words come before the end.
        assert len(lines) <= (2 if moment == "exit" else 1), done.stderr


def test_in_the_background_ctrl_c_is_not_heard() -> None:
    done = started("robosc", "check", "nothing.rscd", moment="robosc.cli.main", is_background=True)
    assert (done.returncode, done.stderr) == (2, "robosc: there is no file nothing.rscd\n")


MISSING = """
import sys
sys.modules[{package!r}] = None
sys.argv = [{program!r}, *{words!r}]
from {module} import entry
entry()
"""


@pytest.mark.parametrize(
    ("program", "words", "package"),
    [
        ("robosc-client", "version --server 127.0.0.1:1", "grpc"),
        ("robosc-bridge", "drivers", "yaml"),
        ("robosc-bridge", "stop", "grpc"),
        ("robosc-bridge", "health --config nothing.yaml", "yaml"),
        ("robosc-server", "", "pydantic"),
        ("robosc-server", "health", "grpc"),
    ],
)
def test_a_program_without_its_extra_says_what_it_needs(program: str, words: str, package: str) -> None:
    module, extra = SCRIPTS[program].partition(":")[0], program.removeprefix("robosc-")
    code = MISSING.format(package=package, program=program, words=words.split(), module=module)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=240, check=False)
    message = (
        f"{program}: the package {package} is not installed; the extra {extra} has it: pip install 'robosc[{extra}]'\n"
    )
    assert (done.returncode, done.stdout, done.stderr) == (2, "", message)


@pytest.mark.parametrize(
    ("program", "words"),
    [("robosc", ""), ("robosc-client", ""), ("robosc-client", "profile"), ("robosc-bridge", "")],
)
def test_a_bare_command_prints_its_help(program: str, words: str) -> None:
    bare, asked = started(program, *words.split()), started(program, *words.split(), "--help")
    assert (bare.returncode, bare.stdout, bare.stderr) == (0, asked.stdout, "")
    assert f"usage: {program} {words}".rstrip() in bare.stdout


def test_options_alone_are_wrong_use() -> None:
    done = started("robosc", "--json")
    assert done.returncode == 2
    assert "put the options of a command after it: robosc COMMAND --json ..." in done.stderr
