"""A model that nothing executes: its initial state, made anew when its files change."""

import argparse
import asyncio
import contextlib
import os
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from robosc.cli.arguments import Parser
from robosc.supervisor import Supervisor, encode
from robosc_bridge.daemon.states import OperatorCommand
from robosc_view import command, static_model
from robosc_view.reports import SourceKind
from robosc_view.sources import Pause, RefusedError
from robosc_view.static_model import NoSupervisorError, StaticModel, file_digest, read, synthesized
from support.live import large_model, supervisor_without_synthesis
from support.models import EXAMPLES
from support.pages_open import opened
from support.view_servers import served

MODEL = EXAMPLES / "line_follower" / "line_follower.rscd"
FIRST, SECOND = (supervisor_without_synthesis(large_model(count)) for count in (2, 3))
LIMIT_S = 30.0


class Files:
    """Files whose looks and syntheses are in a test's hands."""

    def __init__(self) -> None:
        self.content: str | NoSupervisorError = "first"
        self.made: asyncio.Future[Supervisor] = asyncio.Future()
        self.cancelled: list[str] = []
        self.begun: list[str] = []
        self._looks = asyncio.Semaphore(0)
        self._asked = asyncio.Event()
        self.source = StaticModel(FIRST, "first", self._digest, self._make, pause=self._pause)

    async def look(self) -> None:
        """The source looks, and has done what follows."""
        for _ in range(2):
            await self._asked.wait()
            self._asked.clear()
            self._looks.release()
        await self._asked.wait()

    async def _pause(self) -> None:
        self._asked.set()
        await self._looks.acquire()

    def _digest(self) -> str:
        if isinstance(self.content, NoSupervisorError):
            raise self.content
        return self.content

    async def _make(self) -> Supervisor:
        content = str(self.content)
        self.begun.append(content)
        self.made = asyncio.Future()
        try:
            return await self.made
        except asyncio.CancelledError:
            self.cancelled.append(content)
            raise


@contextlib.asynccontextmanager
async def looking(files: Files) -> AsyncIterator[Any]:
    async with served(lambda: files.source, robot=files.source.robot) as server, opened(server.url) as page:
        yield page


def components(update: dict[str, Any]) -> set[str]:
    return set(update["components"])


def test_what_is_shown_first() -> None:
    async def run() -> None:
        files = Files()
        async with looking(files) as page:
            definition = await page.told("definition")
            assert (definition["source"], definition["can_command"]) == (str(SourceKind.MODEL), False)
            update = await page.told("update")
            assert update["enabled"] and not update["warnings"]
            assert not page.entries()
            await files.look()
            assert files.begun == []

    asyncio.run(run())


def test_a_change_is_shown_and_what_is_wrong_is_told() -> None:
    async def run() -> None:
        files = Files()
        async with looking(files) as page:
            await page.told("definition")
            before = components(await page.told("update"))
            files.content = "second"
            await files.look()
            files.made.set_result(SECOND)
            await files.look()
            await page.told("definition")
            after = components(await page.told("update"))
            assert before < after
            files.content = "third"
            await files.look()
            files.made.set_exception(NoSupervisorError("a component is missing"))
            await files.look()
            update = await page.until(lambda told: told["type"] == "update" and told["warnings"])
            assert components(update) == after
            assert "a component is missing" in str(update["warnings"])
            files.content = NoSupervisorError("it is gone")
            await files.look()
            assert files.begun[-1] == "it is gone"
            files.content = "third"
            await files.look()
            files.made.set_result(FIRST)
            await files.look()
            update = await page.until(lambda told: told["type"] == "update" and not told["warnings"])
            assert components(update) == before

    asyncio.run(run())


def test_a_change_ends_the_synthesis_of_the_one_before_and_so_does_the_end() -> None:
    async def run() -> None:
        files = Files()
        async with looking(files) as page:
            await page.told("update")
            for content in ("second", "third"):
                files.content = content
                await files.look()
            assert (files.begun, files.cancelled) == (["second", "third"], ["second"])
        assert files.cancelled == ["second", "third"]

    asyncio.run(run())


def test_nothing_is_commanded_or_replayed() -> None:
    async def run() -> None:
        source = Files().source
        with pytest.raises(RefusedError, match="nothing is executed"):
            await source.order(OperatorCommand.STOP, "somebody")
        with pytest.raises(RefusedError, match="only a log"):
            source.control_replay(Pause())

    asyncio.run(run())


def test_what_synth_tells(tmp_path: Path) -> None:
    async def run() -> None:
        made = await synthesized(["--", str(MODEL)])
        assert made.model.name == "LineFollower"
        wrong = tmp_path / "wrong.rscd"
        for text, why in (
            ("robot R { component C {} component C {} component C {} }", r"wrong.rscd, line 1: .*'C'.* \(2 errors\)"),
            ("robot R {", "wrong.rscd, line 1: "),
            (
                "robot R { component C { outgoing message m with type: none behaviour { initial marked state a { on "
                "response from m goto b } state b { on response from m goto a } } } requirement never C.b }",
                "no supervisor exists",
            ),
        ):
            wrong.write_text(text)
            with pytest.raises(NoSupervisorError, match=why):
                await synthesized(["--", str(wrong)])
        wrong.unlink()
        with pytest.raises(NoSupervisorError, match="there is no file"):
            await synthesized(["--", str(wrong)])

    asyncio.run(run())


def test_nothing_of_the_folder_that_one_works_in_is_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "argparse.py").write_text("import pathlib; pathlib.Path('was_run').touch(); raise SystemExit")
    monkeypatch.chdir(tmp_path)
    assert asyncio.run(synthesized(["--", str(MODEL)])).model.name == "LineFollower"
    assert not (tmp_path / "was_run").exists()


def test_one_that_is_not_wanted_any_more_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Reading it never ends, since nobody writes.
    model = tmp_path / "pipe.rscd"
    os.mkfifo(model)
    started = []
    real = asyncio.create_subprocess_exec

    async def noted(*words: Any, **options: Any) -> asyncio.subprocess.Process:
        started.append(await real(*words, **options))
        return started[-1]

    monkeypatch.setattr(static_model.asyncio, "create_subprocess_exec", noted)  # type: ignore[attr-defined]

    async def run() -> None:
        task = asyncio.create_task(synthesized(["--", str(model)]))
        while not started:
            await asyncio.sleep(0)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await asyncio.wait_for(task, LIMIT_S)
        assert started[0].returncode is not None

    asyncio.run(run())


def test_a_supervisors_file(tmp_path: Path) -> None:
    file = tmp_path / "made.rsup"
    with pytest.raises(NoSupervisorError, match=r"made\.rsup"):
        file_digest(file)
    with pytest.raises(NoSupervisorError, match=r"made\.rsup"):
        read(file)
    file.write_bytes(encode(FIRST))
    before = file_digest(file)
    assert read(file) == FIRST
    file.write_bytes(encode(SECOND))
    assert file_digest(file) != before
    file.write_bytes(b"{}")
    with pytest.raises(NoSupervisorError, match=r"made\.rsup"):
        read(file)


@pytest.mark.parametrize("suffix", [".rscd", ".rsup"])
def test_the_command_follows_its_file(tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(static_model, "LOOK_S", 0.01)
    file = tmp_path / f"robot{suffix}"

    def write(supervisor: Supervisor, count: int) -> None:
        part = tmp_path / "part"
        part.write_bytes(encode(supervisor) if suffix == ".rsup" else large_model(count).encode())
        part.replace(file)

    write(FIRST, 2)
    parser: argparse.ArgumentParser = Parser(prog="robosc")
    command.add_parser(parser.add_subparsers())
    make, is_shared, robot = command._source(parser.parse_args(["view", "--model", str(file)]))

    async def look() -> None:
        async with served(make, is_shared=is_shared, robot=robot) as server, opened(server.url) as page:
            before = components(await page.told("update"))
            write(SECOND, 3)
            await page.until(lambda told: told["type"] == "update" and components(told) > before)
            file.write_bytes(b"robot {")
            await page.until(lambda told: told["type"] == "update" and told["warnings"])
            write(FIRST, 2)
            await page.until(
                lambda told: told["type"] == "update" and components(told) == before and not told["warnings"]
            )

    asyncio.run(look())
