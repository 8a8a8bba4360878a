"""Completion of lines by the Tab key in bash, zsh and fish after `robosc completion SHELL --install`."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from support.shells import shell

BASH_COMPLETION = Path("/usr/share/bash-completion/bash_completion")

CASES = {
    "robosc explain-s": "robosc explain-synthesis",
    "robosc explain livel": "robosc explain livelock",
    "robosc check mod": "robosc check model.rscd",
    "robosc check de": "robosc check deep/",
    "robosc format --diff mod": "robosc format --diff model.rscd",
    "robosc generate --list-t": "robosc generate --list-targets",
    "robosc generate model.rscd --target prom": "robosc generate model.rscd --target promela",
    "robosc generate model.rscd -o de": "robosc generate model.rscd -o deep/",
    "robosc synth -o out.rsup mod": "robosc synth -o out.rsup model.rscd",
    "robosc verify made": "robosc verify made.rsup",
    "robosc view --scene maze-sp": "robosc view --scene maze-spiral",
    "robosc completion fi": "robosc completion fish",
    "robosc-client profile rem": "robosc-client profile remove",
    "robosc-client list --state queu": "robosc-client list --state queued",
    "robosc-bridge run --mod": "robosc-bridge run --model",
    "robosc-bridge run --config rob": "robosc-bridge run --config robot.yaml",
    "robosc-server check-c": "robosc-server check-config",
    "robosc-server --log-format js": "robosc-server --log-format json",
    "robosc-lsp --syn": "robosc-lsp --synthesis-seconds",
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", ["bash", "zsh", "fish"])
def test_the_tab_key_completes_all_commands(name: str, tmp_path: Path) -> None:
    if shutil.which(name) is None:
        pytest.skip(f"{name} is not installed")
    if name == "bash" and not BASH_COMPLETION.is_file():
        pytest.skip("the package bash-completion is not installed")
    home, work = tmp_path / "home", tmp_path / "work"
    (work / "deep").mkdir(parents=True)
    home.mkdir()
    for file in ("model.rscd", "modest.txt", "made.rsup", "robot.yaml", "robot.rscd"):
        (work / file).touch()
    # The commands are found as after an installation; nothing of the tester's own shells is used.
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    environment = {"HOME": str(home), "PATH": path, "LANG": "C.UTF-8"}
    command = ["robosc", "completion", name, "--install"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=240)
    folder = Path(done.stdout.splitlines()[0]).parent
    assert home in folder.parents
    setup = {"bash": f"source {BASH_COMPLETION}", "zsh": f"fpath=({folder} $fpath); compinit -u", "fish": "true"}
    with shell(name, setup[name], work, environment) as there:
        assert {typed: there.completed(typed) for typed in CASES} == CASES
