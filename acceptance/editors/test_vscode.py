"""The extension in a real VS Code: installed as its users do, and used in a window."""

import json
import os
import signal
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from robosc import __version__
from robosc.execution.runtime.event_log import json_line
from support.browser import CHROMIUM, SCREENSHOTS, running_browser
from support.live import LiveRobot, supervisor_without_synthesis
from support.models import EXAMPLES
from support.node import EXTENSION_FOLDER
from support.remote import FakeDaemon, served
from support.ros2 import Peer, environment, own_domain
from support.view_nodes import Node
from support.vscode import VsCode, packaged, programs_in, vscode

MODEL = (EXAMPLES / "line_follower" / "line_follower.rscd").read_text()
LIBRARY = """library Parts {
    component Lamp {
        incoming message light with type: none
    }
}
"""
ROBOT = """// 🤖 not saved yet
robot Lit {
    component Lamp from Parts import Lamp
    provide light with 1
}
"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("there is no Chromium on this machine")
    with running_browser() as running:
        yield running


@pytest.fixture(scope="module")
def extension(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return packaged(tmp_path_factory.mktemp("package"))


@pytest.fixture(scope="module")
def editor(browser: Browser, extension: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[VsCode]:
    """An editor whose folder is trusted, and has the programs in its own environment."""
    folder = tmp_path_factory.mktemp("folder")
    (folder / "follower.rscd").write_text(MODEL)
    (folder / "parts.rscd").write_text(LIBRARY)
    programs_in(folder / ".venv")
    with vscode(browser, extension, folder, tmp_path_factory.mktemp("place"), is_trusted=True) as running:
        yield running


@pytest.fixture
def model(editor: VsCode) -> Path:
    """The line follower, in front and as it was."""
    file = editor.folder / "follower.rscd"
    editor.do("open", file=file)
    return file


def test_what_is_packaged(extension: Path) -> None:
    with zipfile.ZipFile(extension) as package:
        names = {name.removeprefix("extension/") for name in package.namelist()}
        manifest = json.loads(package.read("extension/package.json"))
        notices = package.read("extension/dist/third-party-notices.txt").decode()
    assert manifest["version"] == __version__
    assert names == {
        "[Content_Types].xml",
        "extension.vsixmanifest",
        "LICENSE.txt",
        "package.json",
        "readme.md",
        "language-configuration.json",
        "dist/extension.js",
        "dist/third-party-notices.txt",
        "syntaxes/robosc.tmLanguage.json",
    }
    assert "vscode-languageclient" in notices and "Permission is hereby granted" in notices
    readme = (EXTENSION_FOLDER / "README.md").read_text()
    for name in manifest["contributes"]["configuration"]["properties"]:
        assert f"`{name}`" in readme
    for command in manifest["contributes"]["commands"]:
        assert f"RoboSC: {command['title']}" in readme or command["command"] == "robosc.showOutput"


def test_it_starts_with_a_model(editor: VsCode, model: Path) -> None:
    assert editor.do("open", file=model) == {"language": "robosc"}
    declared = json.loads((EXTENSION_FOLDER / "package.json").read_text())["contributes"]["commands"]
    assert set(editor.do("commands")) >= {command["command"] for command in declared}
    assert editor.do("findings", file=model, until=None) == []


def test_what_is_known_of_a_model(editor: VsCode, model: Path) -> None:
    (lens,) = editor.do("lens", file=model, until="states")
    assert lens == {"title": "16 states, supervisor adds conditions to no event", "command": "robosc.synthesize"}
    editor.do("hover", file=model, text="move with", until="incoming message of `Platform`")
    assert editor.do("definition", file=model, text="scan do")["file"] == str(model)
    assert editor.do("symbols", file=model)[0][0] == "LineFollower"
    assert {"class", "event", "enumMember"} <= set(editor.do("tokens", file=model))
    assert editor.do("rename", file=model, text="line_lost do", name="gone") == [{"file": str(model), "edits": 2}]
    editor.page.locator(".view-line", has_text="robot LineFollower").first.wait_for()
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    editor.page.screenshot(path=SCREENSHOTS / "vscode.png")


def test_words_are_coloured(editor: VsCode, model: Path) -> None:
    line = editor.page.locator(".view-line", has_text="robot LineFollower").first

    def colours() -> list[str]:
        return [
            line.locator(f"span span:text-is('{text}')").first.evaluate("(found) => getComputedStyle(found).color")
            for text in ("robot", "LineFollower")
        ]

    line.locator("span span:text-is('robot')").wait_for()
    line.locator("span span:text-is('LineFollower')").wait_for()
    editor.until(lambda: len(set(colours())) == 2, "both words have one colour")


def test_findings_follow_what_is_typed(editor: VsCode) -> None:
    # The editor in a browser saves by itself, a second after an edit.
    editor.do("set", name="files.autoSave", value="off")
    file = editor.folder / "lit.rscd"
    file.write_text(ROBOT)
    editor.do("open", file=file)
    assert editor.do("findings", file=file, until="type-mismatch")
    editor.do("replace", file=file, text="    provide light with 1\n", by="")
    assert editor.do("findings", file=file, until=None) == []
    editor.do("replace", file=file, text="import Lamp", by="import L")
    assert "Lamp" in editor.do("completions", file=file, text="import L")
    editor.do("replace", file=file, text="import L", by="import  Lamp")
    formatted = editor.do("format", file=file)
    assert "import Lamp" in formatted and formatted.startswith("// 🤖")
    assert editor.do("isDirty", file=file)
    # A library that is open and not saved counts.
    library = editor.folder / "parts.rscd"
    editor.do("open", file=library)
    editor.do("replace", file=library, text="component Lamp", by="component Torch")
    assert editor.do("findings", file=file, until="unknown-name")
    editor.do("replace", file=library, text="component Torch", by="component Lamp")
    editor.do("findings", file=file, until=None)
    editor.do("set", name="files.autoSave", value=None)


def test_synthesize(editor: VsCode, model: Path) -> None:
    kept = editor.folder / "kept.rsup"
    assert editor.command("synthesize", model, kept) is True, editor.message("").all_inner_texts()
    assert json.loads(kept.read_bytes())
    broken = editor.folder / "broken.rscd"
    broken.write_text("robot R {")
    assert editor.command("synthesize", broken) is False
    editor.message("broken.rscd: 1 error").wait_for()


def test_generate(editor: VsCode, model: Path) -> None:
    target = editor.folder / "generated"
    (file,) = editor.command("generate", model, "python", target)
    assert Path(file).parent == target and Path(file).exists()
    Path(file).write_text("mine")
    # A question waits for its answer.
    editor.do("commandBeside", name="robosc.generate", given=[f"file:{model}", "python", f"file:{target}"])
    question = editor.page.locator(".monaco-dialog-box")
    question.get_by_text("They would be lost").wait_for()
    question.get_by_role("button", name="Cancel").click()
    assert editor.do("besides") == [None]
    assert Path(file).read_text() == "mine"
    editor.do("commandBeside", name="robosc.generate", given=[f"file:{model}", "python", f"file:{target}"])
    question.get_by_role("button", name="Overwrite").click()
    assert editor.do("besides") == [[file]]
    assert Path(file).read_text() != "mine"


def test_explore(editor: VsCode, model: Path) -> None:
    assert editor.command("explore", model) == 16
    editor.until(lambda: "States of follower.rscd" in editor.do("tabs"), "there is no panel")
    frame = editor.panel("p", "16 states, 120 transitions; it begins in state 0")
    editor.until(lambda: frame.locator("tr[id^=state-]").count() == 16, "not all states are listed")
    editor.until(lambda: frame.locator(".drawing svg .node").count() == 17, "not all states are drawn")
    editor.page.screenshot(path=SCREENSHOTS / "vscode-explore.png")
    editor.close("States of follower.rscd")


def test_show_automata(editor: VsCode, model: Path) -> None:
    assert editor.command("showAutomata", model) is True
    frame = editor.live_view()
    frame.locator("#robot", has_text="LineFollower").wait_for()
    frame.locator("#link-word", has_text="by hand").wait_for()
    editor.page.screenshot(path=SCREENSHOTS / "vscode-automata.png")
    (view,) = editor.views()
    # It follows what is saved, and the same panel comes to the front.
    editor.do("replace", file=model, text="robot LineFollower", by="robot Follower")
    assert editor.command("showAutomata", model) is True
    frame.locator("#robot:text-is('Follower')").wait_for()
    assert editor.views() == [view]
    editor.close("Automata of follower.rscd")


def test_visualize_a_log(editor: VsCode, tmp_path: Path) -> None:
    robot = LiveRobot(supervisor_without_synthesis(MODEL))
    subscription = robot.feed.subscribe(lambda: None)
    for _ in range(50):
        robot.step()
    log, model = tmp_path / "run.jsonl", tmp_path / "follower.rscd"
    model.write_text(MODEL)
    log.write_text("".join(map(json_line, subscription.take().entries)))
    assert editor.command("visualize", {"source": "log", "log": log, "model": model}) is True
    frame = editor.live_view()
    frame.locator("#link-word", has_text="recorded").wait_for()
    frame.locator("#replay-at", has_text="50 entries").wait_for()
    editor.close("run.jsonl")


def test_visualize_a_bridge(editor: VsCode) -> None:
    with FakeDaemon() as daemon, served(daemon) as face:
        assert editor.command("visualize", {"source": "bridge", "address": face.address}) is True
        frame = editor.live_view()
        frame.locator("#robot", has_text=daemon.operations.supervisor.model.name).wait_for()
        # An earlier notification lies over the button.
        editor.do("command", name="notifications.clearAll")
        frame.get_by_role("button", name="Stop").first.click()
        editor.until(lambda: daemon.orders, "the robot was not stopped")
        editor.close(face.address)


@pytest.mark.ros2
def test_visualize_a_node(editor: VsCode, tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
    from std_msgs.msg import String

    node = Node(supervisor_without_synthesis(MODEL), tmp_path / "package")
    with own_domain() as domain, Peer(domain, environment(domain, tmp_path / "ros")) as peer:
        programs = programs_in(tmp_path / "environment")
        exports = [f"export {name}='{value}'" for name, value in environment(domain, tmp_path / "ros").items()]
        robosc = programs / "robosc"
        robosc.write_text("\n".join(["#!/bin/sh", *exports, robosc.read_text()]))
        editor.do("set", name="robosc.programs", value=str(programs))
        try:
            assert editor.command("visualize", {"source": "ros2", "namespace": "/robot1"}) is True
            frame = editor.live_view()

            def is_shown() -> bool:
                peer.publish(String(data=node.system.report()), "/robot1/state")
                return frame.locator("#robot:text-is('LineFollower')").count() == 1

            editor.until(is_shown, "the node is not shown")
            editor.close("/robot1/state")
        finally:
            editor.do("set", name="robosc.programs", value=None)


def test_what_cannot_be_shown_is_reported(editor: VsCode) -> None:
    broken = editor.folder / "broken.rscd"
    broken.write_text("robot R {")
    assert editor.command("showAutomata", broken) is True
    editor.panel("pre", "broken.rscd:1:10: error")
    assert editor.views() == []
    editor.close("Automata of broken.rscd")


def test_programs_elsewhere(editor: VsCode, model: Path, tmp_path: Path) -> None:
    nowhere = tmp_path / "nowhere"
    editor.do("set", name="robosc.programs", value=str(nowhere))
    try:
        editor.message(f"'{nowhere}/robosc-lsp' is not there").wait_for()
        assert editor.command("explore", model) is None
        editor.message(f"'{nowhere}/robosc' is not there: install it by").wait_for()
    finally:
        editor.do("set", name="robosc.programs", value=None)
    assert editor.do("findings", file=model, until=None) == []
    editor.do("hover", file=model, text="move with", until="incoming message")


def test_a_language_server_that_cannot_be_started_reports_why(editor: VsCode, tmp_path: Path) -> None:
    program = tmp_path / "robosc-lsp"
    program.write_text("#!/bin/sh\necho 'robosc-lsp: the language server needs <b>more</b>' >&2\nexit 1\n")
    program.chmod(0o755)
    editor.do("command", name="notifications.clearAll")
    editor.do("set", name="robosc.programs", value=str(tmp_path))
    try:
        editor.message("no language server: robosc-lsp: the language server needs <b>more</b>").wait_for()
        assert editor.message("").count() == 1
    finally:
        editor.do("set", name="robosc.programs", value=None)


def test_a_language_server_that_has_ended_is_started_again(editor: VsCode, model: Path) -> None:
    editor.do("hover", file=model, text="move with", until="incoming message")
    (first,) = editor.processes("robosc_lsp.command")
    os.kill(first, signal.SIGKILL)
    editor.until(lambda: len(set(editor.processes("robosc_lsp.command")) - {first}) == 1, "no server is there")
    editor.do("hover", file=model, text="move with", until="incoming message")
    assert len(editor.processes("robosc_lsp.command")) == 1


def test_a_folder_that_is_not_trusted_starts_nothing_of_its_own(
    browser: Browser, extension: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "folder"
    where = programs_in(folder / ".venv")
    (folder / "follower.rscd").write_text(MODEL)
    (folder / ".vscode").mkdir()
    (folder / ".vscode" / "settings.json").write_text(json.dumps({"robosc.programs": str(where)}))
    proof = folder / "started"
    for program in where.iterdir():
        program.write_text(f"#!/bin/sh\ntouch '{proof}'\n")
    with vscode(browser, extension, folder, tmp_path / "place", is_trusted=False) as editor:
        assert editor.do("open", file=folder / "follower.rscd") == {"language": "robosc"}
        editor.message("'robosc-lsp' is not there").wait_for()
        assert editor.command("explore", folder / "follower.rscd") is None
        # Settings of the user for all folders name nothing in this one, either.
        editor.do("command", name="notifications.clearAll")
        editor.do("set", name="robosc.programs", value=".venv/bin", everywhere=True)
        editor.do("command", name="robosc.restartServer")
        editor.message("'.venv/bin/robosc-lsp' is not there").wait_for()
        assert editor.command("explore", folder / "follower.rscd") is None
        assert not proof.exists()
