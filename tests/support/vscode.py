"""A real VS Code without a screen: its server is a process of Node, its workbench a page in a browser.

It is the server inside of the npm package code-server. What is done in it is done by an extension of the tests, in
the place where all extensions run, by orders that are files.
"""

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Error, Frame, Locator, Page

from support.background import children_of
from support.node import EXTENSION_FOLDER, VSCODE_FOLDER, node_tool

LIMIT_S = 120.0
_PROGRAM = Path("node_modules") / "code-server" / "lib" / "vscode"
_LISTENING = re.compile(r"listening on (\d+)")
_LIVE_VIEW = re.compile(r"http://127\.0\.0\.1:\d+/(\?token=.*)?")
"""Its page takes the token out of its address as soon as it has it."""
_PROGRAMS = {"robosc": "robosc.cli.main", "robosc-lsp": "robosc_lsp.command"}


def packaged(folder: Path) -> Path:
    """The extension as users install it, made by its own script."""
    node_tool("vsce", EXTENSION_FOLDER)
    made = folder / "robosc.vsix"
    _run(["npm", "run", "package", "--", "--out", str(made)], EXTENSION_FOLDER)
    return made


def _driver(folder: Path) -> Path:
    made = folder / "driver.vsix"
    tool = node_tool("vsce", EXTENSION_FOLDER)
    options = ["--no-dependencies", "--allow-missing-repository", "--skip-license", "--out", str(made)]
    _run(["node", str(tool), "package", *options], VSCODE_FOLDER / "driver")
    return made


def _run(command: list[str], folder: Path) -> None:
    ran = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=LIMIT_S)
    assert ran.returncode == 0, ran.stdout + ran.stderr


def programs_in(folder: Path) -> Path:
    """The folder with the programs of this project in an environment at `folder`, which is made."""
    where = folder / "bin"
    where.mkdir(parents=True)
    for name, module in _PROGRAMS.items():
        (where / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" -m {module} "$@"\n')
        (where / name).chmod(0o755)
    return where


class VsCode:
    """An editor that shows a folder.

    Attributes:
        page: Its window.
        folder: Folder that is open in it.
        pid: Process id of its server.
    """

    def __init__(self, page: Page, folder: Path, orders: Path, pid: int) -> None:
        self.page = page
        self.folder = folder
        self.pid = pid
        self._orders = orders
        self._count = 0

    def do(self, step: str, **given: Any) -> Any:
        """Do a step of `driver.js` and return its result; paths are given as texts.

        Raises:
            AssertionError: It went wrong.
        """
        number, self._count = self._count, self._count + 1
        part, answer = self._orders / "part", self._orders / f"answer-{number}.json"
        part.write_text(json.dumps({"step": step, "given": given}, default=str))
        part.rename(self._orders / f"order-{number}.json")
        self.until(answer.exists, f"no answer to {step}")
        reply = json.loads(answer.read_text())
        assert "error" not in reply, reply["error"]
        return reply["value"]

    def command(self, name: str, *given: Any) -> Any:
        """Run a command of the extension; files are given as paths."""
        return self.do("command", name=f"robosc.{name}", given=[_revivable(each) for each in given])

    def message(self, text: str) -> Locator:
        """Return the message with a text, in the list of all that the user has received and has not closed.

        Of many messages within a second the editor shows the first three only, but it lists them all.
        """
        self.do("command", name="notifications.showList")
        return self.page.locator(".notifications-center .notification-list-item", has_text=text)

    def until(self, condition: Any, complaint: str) -> Any:
        """Return the value of a condition, once it is true; the page lives meanwhile."""
        end_s = time.monotonic() + LIMIT_S
        while not (found := condition()):
            assert time.monotonic() < end_s, f"{complaint}; there is:\n{self.seen()}"
            self.page.wait_for_timeout(20)
        return found

    def seen(self) -> str:
        """Return the text that the window's pages show, and the processes of `robosc view`."""
        texts = []
        for frame in self.page.frames:
            with contextlib.suppress(Error):  # It is gone.
                texts.append(f"{frame.url}\n{frame.locator('body').inner_text(timeout=1000)}")
        return "\n".join([*texts, f"processes: {self.views()}"])

    def live_view(self) -> Frame:
        """The page of the live view that a panel shows: there is one at a time."""
        found: list[Frame] = self.until(self._live_views, "no panel shows a live view")
        (frame,) = found
        self.until(frame.frame_element().is_visible, "the frame of the live view is hidden")
        return frame

    def _live_views(self) -> list[Frame]:
        return [frame for frame in self.page.frames if _LIVE_VIEW.fullmatch(frame.url)]

    def close(self, label: str) -> None:
        """Close a panel; with one of the live view its program ends."""
        self.do("closeTab", label=label)
        self.until(lambda: not self._live_views(), f"{label} is still there")
        self.until(lambda: not self.views(), f"the program of {label} still runs")

    def panel(self, selector: str, text: str) -> Frame:
        """The panel that has an element with a text."""

        def look() -> Frame | None:
            for frame in self.page.frames:
                # Panels come and go.
                with contextlib.suppress(Error):
                    if frame.locator(selector, has_text=text).count():
                        return frame
            return None

        frame: Frame = self.until(look, f"no panel shows '{text}'")
        return frame

    def views(self) -> list[int]:
        """The processes of `robosc view`."""
        return self.processes("view", "--framed-by")

    def processes(self, *wanted: str) -> list[int]:
        """The editor's processes with some words in their command."""
        found, rest = [], [(self.pid, False)]
        while rest:
            pid, is_of_one = rest.pop()
            # Until it runs its own command, what a process starts has the command of that process.
            is_wanted = not is_of_one and {word.encode() for word in wanted} <= _command(pid)
            rest += [(child, is_wanted or is_of_one) for child in children_of(pid)]
            if is_wanted:
                found.append(pid)
        return found


def _command(pid: int) -> set[bytes]:
    """The words of a process's command; none where it is gone."""
    with contextlib.suppress(FileNotFoundError, ProcessLookupError):
        return set(Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0"))
    return set()


def _revivable(value: Any) -> Any:
    if isinstance(value, Path):
        return f"file:{value}"
    return {key: _revivable(each) for key, each in value.items()} if isinstance(value, dict) else value


@contextlib.contextmanager
def vscode(browser: Browser, extension: Path, folder: Path, place: Path, *, is_trusted: bool) -> Iterator[VsCode]:
    """Run an editor with an extension; it and all that it has started is gone at the end.

    Args:
        browser: Browser that has its window.
        extension: The package.
        folder: Folder that is open in it.
        place: Folder for what it needs.
        is_trusted: Answer of its user when it is asked whether the folder is trusted.
    """
    program = VSCODE_FOLDER / _PROGRAM
    if not (program / "node_modules").is_dir():
        pytest.skip("VS Code is not installed: make vscode")
    node = shutil.which("node")
    assert node is not None
    orders = place / "orders"
    orders.mkdir(parents=True)
    kept = ["--extensions-dir", str(place / "extensions"), "--server-data-dir", str(place / "data")]
    start = [node, "out/server-main.js", *kept, "--accept-server-license-terms", "--telemetry-level", "off"]
    for package in (extension, _driver(place)):
        _run([*start, "--install-extension", str(package)], program)
    # Programs are found where a user has them, not where these tests run.
    variables = {"HOME": str(place), "PATH": f"{Path(node).parent}:/usr/bin:/bin", "ROBOSC_TRIAL": str(orders)}
    with (
        (place / "errors.txt").open("wb") as errors,
        subprocess.Popen(
            [*start, "--host", "127.0.0.1", "--port", "0", "--without-connection-token"],
            cwd=program,
            env={**variables, "SHELL": "/bin/sh", "LANG": "C.UTF-8"},
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            start_new_session=True,
        ) as server,
    ):
        try:
            assert server.stdout is not None
            port = next((found[1] for line in server.stdout if (found := _LISTENING.search(line))), None)
            assert port is not None, (place / "errors.txt").read_text()
            context = browser.new_context(viewport={"width": 1500, "height": 1000})
            context.set_default_timeout(LIMIT_S * 1000)
            try:
                page = context.new_page()
                page.goto(f"http://127.0.0.1:{port}/?folder={folder}")
                answer = "Yes, I trust the authors" if is_trusted else "No, I don't trust the authors"
                page.get_by_role("button", name=answer).click()
                yield VsCode(page, folder, orders, server.pid)
            finally:
                context.close()
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(server.pid, signal.SIGKILL)
