"""A model that is played with: events, undo, walks, kept runs, links; made anew when its files change."""

import argparse
import asyncio
import base64
import contextlib
import io
import json
import os
import re
import zlib
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

import robosc
from robosc.cli.arguments import Parser
from robosc.cli.output import CommandError
from robosc.event_logs.entries import LogEntry, LoggedRun
from robosc.pipeline.saved_runs import event_log
from robosc.pipeline.simulation import Run
from robosc.supervisor import Supervisor, encode
from robosc_bridge.daemon.states import OperatorCommand
from robosc_view import command, watched_model
from robosc_view.model_changes import model_changes
from robosc_view.playground import MAXIMUM_KEPT, Playground, StoredRun, StoredRuns, packed, playable, unpacked
from robosc_view.replay import Recording, Replay
from robosc_view.reports import SourceKind
from robosc_view.requests import ROBOSC, parse_request
from robosc_view.sources import Pause, RefusedError
from robosc_view.watched_model import NoSupervisorError, SynthesizedModel, WatchedModel, file_digest, read, synthesized
from support.execution import unsupervised
from support.live import large_model, supervisor_without_synthesis
from support.loaders import MODEL as LOADER
from support.models import EXAMPLES
from support.pages_open import opened, token_of
from support.view_servers import served

MODEL = EXAMPLES / "line_follower" / "line_follower.rscd"
FIRST, SECOND = (supervisor_without_synthesis(large_model(count)) for count in (2, 3))
LIMIT_S = 30.0


class Files:
    """Files whose looks and syntheses are in a test's hands."""

    def __init__(self) -> None:
        self.content: str | NoSupervisorError = "first"
        self.made: asyncio.Future[SynthesizedModel] = asyncio.Future()
        self.cancelled: list[str] = []
        self.begun: list[str] = []
        self._looks = asyncio.Semaphore(0)
        self._asked = asyncio.Event()
        self.watched = WatchedModel(SynthesizedModel(FIRST), "first", self._digest, self._make, pause=self._pause)
        self.kept = StoredRuns()
        self.robot = playable(self.watched.made)

    def source(self) -> Playground:
        """The run of one more page."""
        return Playground(self.watched, self.kept, None, self._of_link)

    async def _of_link(self, text: str, language: str) -> SynthesizedModel:
        assert language == ROBOSC
        self.begun.append(text)
        return SynthesizedModel(SECOND, (), text)

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

    async def _make(self) -> SynthesizedModel:
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
    async with served(files.source, is_shared=False, robot=files.robot) as server, opened(server.url) as page:
        yield page


def supervisor_in(made: SynthesizedModel) -> Supervisor:
    assert isinstance(made.supervisor, Supervisor)
    return made.supervisor


def components(update: dict[str, Any]) -> set[str]:
    return set(update["components"])


async def test_what_is_shown_first() -> None:
    files = Files()
    async with looking(files) as page:
        definition = await page.receive("definition")
        assert (definition["source"], definition["can_command"]) == (str(SourceKind.MODEL), False)
        update = await page.receive("update")
        assert update["enabled"] and not update["warnings"]
        assert not page.entries()
        await files.look()
        assert files.begun == []


async def test_a_change_is_shown_and_what_is_wrong_is_reported() -> None:
    files = Files()
    async with looking(files) as page:
        await page.receive("definition")
        before = components(await page.receive("update"))
        files.content = "second"
        await files.look()
        files.made.set_result(SynthesizedModel(SECOND))
        await files.look()
        await page.receive("definition")
        after = components(await page.receive("update"))
        assert before < after
        files.content = "third"
        await files.look()
        files.made.set_exception(NoSupervisorError("a component is missing"))
        await files.look()
        update = await page.until(lambda message: message["type"] == "update" and message["warnings"])
        assert components(update) == after
        assert "a component is missing" in str(update["warnings"])
        files.content = NoSupervisorError("it is gone")
        await files.look()
        assert files.begun[-1] == "it is gone"
        files.content = "third"
        await files.look()
        files.made.set_result(SynthesizedModel(FIRST))
        await files.look()
        update = await page.until(lambda message: message["type"] == "update" and not message["warnings"])
        assert components(update) == before


async def test_a_change_ends_the_synthesis_of_the_one_before_and_so_does_the_end() -> None:
    files = Files()
    async with looking(files) as page:
        await page.receive("update")
        for content in ("second", "third"):
            files.content = content
            await files.look()
        assert (files.begun, files.cancelled) == (["second", "third"], ["second"])
    assert files.cancelled == ["second", "third"]


async def test_nothing_is_commanded_or_replayed() -> None:
    source = Files().source()
    with pytest.raises(RefusedError, match="nothing is executed"):
        await source.order(OperatorCommand.STOP, "somebody")
    with pytest.raises(RefusedError, match="only a log"):
        source.control_replay(Pause())


async def test_findings_of_synth_become_the_problem(tmp_path: Path) -> None:
    made = await synthesized(["--", str(MODEL)])
    assert supervisor_in(made).model.name == "LineFollower"
    again = await synthesized([], MODEL.read_text(encoding="utf-8"))
    assert again.supervisor.added == made.supervisor.added
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


def test_nothing_of_the_folder_that_one_works_in_is_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "argparse.py").write_text("import pathlib; pathlib.Path('was_run').touch(); raise SystemExit")
    monkeypatch.chdir(tmp_path)
    assert supervisor_in(asyncio.run(synthesized(["--", str(MODEL)]))).model.name == "LineFollower"
    assert not (tmp_path / "was_run").exists()


async def test_one_that_is_not_wanted_any_more_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Reading it never ends without a writer.
    model = tmp_path / "pipe.rscd"
    os.mkfifo(model)
    started = []
    real = asyncio.create_subprocess_exec

    async def noted(*words: Any, **options: Any) -> asyncio.subprocess.Process:
        started.append(await real(*words, **options))
        return started[-1]

    monkeypatch.setattr(watched_model.asyncio, "create_subprocess_exec", noted)  # type: ignore[attr-defined]
    task = asyncio.create_task(synthesized(["--", str(model)]))
    while not started:
        await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await asyncio.wait_for(task, LIMIT_S)
    assert started[0].returncode is not None


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
async def test_the_command_follows_its_file(tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watched_model, "LOOK_S", 0.01)
    file = tmp_path / f"robot{suffix}"

    def write(supervisor: Supervisor, count: int) -> None:
        part = tmp_path / "part"
        part.write_bytes(encode(supervisor) if suffix == ".rsup" else large_model(count).encode())
        part.replace(file)

    write(FIRST, 2)
    parser: argparse.ArgumentParser = Parser(prog="robosc")
    command.add_parser(parser.add_subparsers())
    make, is_shared, robot = command._source(parser.parse_args(["view", "--model", str(file)]))
    async with served(make, is_shared=is_shared, robot=robot) as server, opened(server.url) as page:
        before = components(await page.receive("update"))
        write(SECOND, 3)
        await page.until(lambda message: message["type"] == "update" and components(message) > before)
        file.write_bytes(b"robot {")
        await page.until(lambda message: message["type"] == "update" and message["warnings"])
        write(FIRST, 2)
        await page.until(
            lambda message: message["type"] == "update" and components(message) == before and not message["warnings"]
        )


GATE = """robot Gate {
    datatype enum Light from double to { value > 300.0 -> day  default -> night }
    component Sensor {
        outgoing message light with identifier: "/light", type: Light
        outgoing message seen with identifier: "/people", type: integer(0..9)
        behaviour {
            variable light: Light = night
            variable people: integer(0..9)
            on response from light do light := value
            on response from seen do people := value
            initial marked state watching { }
        }
    }
    component Gate {
        incoming message open with identifier: "/gate/open", type: none
        incoming message shut with identifier: "/gate/shut", type: integer
        behaviour {
            initial marked state closed { on request to open goto opened }
            state opened { on request to shut goto closed }
        }
    }
    requirement open needs Sensor.light = day
    requirement shut needs Sensor.people = 0
    provide shut with Sensor.people + 1
}"""


def playable_automata(text: str, findings: tuple[str, ...] = ()) -> SynthesizedModel:
    made = robosc.synthesize(robosc.load(text=text)).supervisor
    assert made is not None
    return SynthesizedModel(made, findings, text)


class Playing(Files):
    """A page that plays with the gate."""

    def __init__(self) -> None:
        super().__init__()
        self.watched = WatchedModel(playable_automata(GATE), "first", self._digest, self._make, pause=self._pause)
        self.robot = playable(self.watched.made)


async def done(view: Any, kind: str, **request: Any) -> dict[str, Any]:
    """Ask for something, and return the answer about the run."""
    await view.send(type=kind, **request)
    answer: dict[str, Any] = await view.receive("run")
    return answer


async def test_events_happen_with_their_data_and_are_taken_back() -> None:
    async with looking(Playing()) as page:
        definition = await page.receive("definition")
        events = {item["event"]: item for item in definition["play"]["events"]}
        assert [name for name, item in events.items() if item["controllable"]] == ["open.request", "shut.request"]
        (field,) = events["light.response"]["fields"]
        assert field == {
            "path": [],
            "type": "Light",
            "choices": ["day", "night"],
            "is_boolean": False,
            "is_required": True,
        }
        first = await page.receive("run")
        assert (first["steps"], first["undo"], first["redo"], first["is_marked"]) == (0, "", "", True)
        assert first["blocked"]["shut.request"] == ["Gate is in closed, not in opened"]
        answer = await done(page, "event", line="open")
        assert (answer["kind"], answer["steps"]) == ("wrong", 0)
        assert "open.request' is not allowed now: requirement open needs Sensor.light = day" in answer["lines"][0]
        # Data is asked for where it cannot be unknown by its type; a NaN stays unknown.
        answer = await done(page, "event", line="light.response")
        assert (answer["kind"], answer["steps"]) == ("wrong", 0)
        answer = await done(page, "event", line="light.response NaN")
        assert (answer["kind"], answer["steps"]) == ("unknown", 1)
        assert answer["lines"][1] == "value is night by default: an earlier rule is unknown"
        answer = await done(page, "event", line="light.response 512.0")
        assert (answer["kind"], answer["lines"]) == ("step", ["light.response (value = day): Sensor.light = day"])
        assert "open.request" not in answer["blocked"]
        answer = await done(page, "event", line="open.request")
        assert (answer["undo"], answer["is_marked"]) == ("open.request", False)
        assert [entry["number"] for entry in page.entries()] == [1, 2, 3, 4]
        assert [entry["event"] for entry in page.entries()][-2:] == ["light.response", "open.request"]
        assert page.entries()[-1]["transitions"][0]["component"] == "Gate"
        answer = await done(page, "undo")
        assert (answer["entries"], answer["redo"], answer["undo"]) == (3, "open.request", "light.response")
        update = await page.until(lambda message: message["type"] == "update")
        assert update["components"]["Gate"]["state"] == "closed"
        assert "Gate" not in update["last"]
        answer = await done(page, "redo")
        assert (answer["entries"], answer["redo"]) == (4, "")
        answer = await done(page, "undo")
        answer = await done(page, "event", line="seen 3")
        # It takes the number of what was taken back.
        assert (page.entries()[-1]["number"], page.entries()[-1]["event"]) == (4, "seen.response")
        answer = await done(page, "event", line="seen null")
        assert answer["kind"] == "wrong"
        answer = await done(page, "restart")
        assert (answer["entries"], answer["steps"], answer["redo"]) == (0, 0, "")


class Loading(Files):
    """The loader, whose drive takes its time to stop."""

    def __init__(self) -> None:
        super().__init__()
        supervisor = unsupervised(LOADER.read_text(encoding="utf-8"))
        self.watched = WatchedModel(SynthesizedModel(supervisor), "first", self._digest, self._make, pause=self._pause)
        self.robot = playable(self.watched.made)


@pytest.mark.parametrize("way", range(3))
async def test_one_chooses_how_a_goal_ends_that_is_being_cancelled(way: int) -> None:
    async with looking(Loading()) as page:
        await page.receive("definition")
        assert (await page.receive("run"))["ends"] == []
        await done(page, "event", line="travel")
        answer = await done(page, "event", line="stop true")
        (ends,) = answer["ends"]
        assert ends["action"] == "travel"
        assert [event for _, event in ends["ways"]] == ["travel.cancel", "travel.response", "travel.error"]
        update = await page.until(lambda message: message["type"] == "update" and message["cancelling"] == ["travel"])
        assert update["communications"]["travel"] == "executing"
        assert [entry["kind"] for entry in page.entries()][-1] == "cancelling"
        assert "reach.request" in answer["blocked"]
        answer = await done(page, "event", line=ends["ways"][way][1])
        assert (answer["kind"], answer["ends"]) == ("step", [])


async def test_a_cancelled_goal_whose_requirements_hold_again_ends_with_an_error() -> None:
    async with looking(Loading()) as page:
        await page.receive("definition")
        for line in ("travel", "stop true", "stop false"):
            answer = await done(page, "event", line=line)
        assert [event for _, event in answer["ends"][0]["ways"]] == ["travel.error", "travel.response", "travel.error"]


async def test_chance_and_findings() -> None:
    async with looking(Playing()) as page:
        answer = await page.receive("run")
        answer = await done(page, "walk", steps=12, seed=3)
        assert (answer["steps"], answer["lines"]) == (12, ["12 events by chance, seed 3"])
        twin = Run(supervisor_in(playable_automata(GATE)))
        assert [entry["event"] for entry in page.entries() if entry["kind"] == "event"] == [
            step.event for step in twin.walk(12, 3)
        ]
        answer = await done(page, "restart")
        answer = await done(page, "walk", steps=1000, seed=0, until_finding=True)
        twin.restart()
        assert (answer["kind"], answer["lines"]) == ("finding", [str(twin.walk_until_finding(1000, 0))])
        assert answer["steps"] == len(twin)
        for _ in range(4):
            answer = await done(page, "walk", steps=5000, seed=1)
        assert (answer["kind"], answer["steps"]) == ("wrong", 15000 + len(twin))
        assert "at most 20000 events" in answer["lines"][0]


async def test_a_run_is_kept_as_a_log_and_as_a_test() -> None:
    async with looking(Playing()) as page:
        await page.receive("run")
        await done(page, "event", line="light day")
        await done(page, "event", line="open")
        twin = Run(supervisor_in(playable_automata(GATE)))
        twin.step("light.response", "day")
        twin.step("open.request")
        await page.send(type="save", form="log")
        answer = await page.receive("saved")
        assert (answer["name"], answer["text"]) == ("gate.jsonl", event_log(twin))
        await page.send(type="save", form="test")
        answer = await page.receive("saved")
        assert answer["name"] == "test_gate.py"
        assert "MODEL = FOLDER / 'gate.rscd'" in answer["text"]
        assert "'open.request'" in answer["text"]
        compile(answer["text"], answer["name"], "exec")


async def test_each_page_has_a_run_of_its_own() -> None:
    files = Playing()
    async with (
        served(files.source, is_shared=False, robot=files.robot) as server,
        opened(server.url) as one,
        opened(server.url) as other,
    ):
        await one.receive("run")
        await other.receive("run")
        assert (await done(one, "event", line="light day"))["steps"] == 1
        assert (await done(other, "undo"))["steps"] == 0


async def test_a_saved_file_says_what_has_changed_and_the_run_happens_again() -> None:
    files = Playing()
    async with looking(files) as page:
        await page.receive("run")
        await done(page, "event", line="light day")
        await done(page, "event", line="open")
        files.content = "second"
        await files.look()
        changed = GATE.replace("needs Sensor.light = day", "needs Sensor.light = day and Sensor.people = 0")
        changed = changed.replace("requirement shut needs Sensor.people = 0", "requirement shut needs Gate.closed")
        changed = changed.replace("state opened", "marked state opened")
        files.made.set_result(playable_automata(changed, ("warning: shut never happens [never-enabled]",)))
        await files.look()
        answer = await page.until(lambda message: message["type"] == "run" and message["kind"] == "changed")
        assert answer["steps"] == 2
        assert answer["lines"][0] == "the model has changed"
        assert "new finding: warning: shut never happens [never-enabled]" in answer["lines"]
        files.content = "third"
        await files.look()
        files.made.set_result(
            playable_automata(changed.replace("needs Sensor.light = day and", "needs Gate.opened and"))
        )
        await files.look()
        answer = await page.until(lambda message: message["type"] == "run" and message["kind"] == "changed")
        # An event that cannot happen any more ends it there.
        assert answer["steps"] == 1
        assert any(line.startswith("of 2 events 1 happened again: 'open.request' is") for line in answer["lines"])
        assert "no longer found: warning: shut never happens [never-enabled]" in answer["lines"]
        assert any("states, which were" in line for line in answer["lines"])


async def test_a_link_holds_the_model() -> None:
    files = Playing()
    async with served(files.source, is_shared=False, robot=files.robot) as server, opened(server.url) as page:
        token = token_of(server.url)
        link = (await page.receive("definition"))["play"]["link"]
        assert unpacked(link) == GATE
        await page.receive("run")
        # The link of another user does not set this machine to work.
        for shown in (None, "x", 3):
            await page.send(type="model", packed=packed("robot Other { }"), token=shown)
            answer = await page.until(lambda message: message["type"] in ("refused", "run"))
            assert "needs the token of this start" in answer.get("why", "")
        assert files.begun == []
        await page.send(type="model", packed=packed("robot Other { }"), token=token)
        answer = await page.until(lambda message: message["type"] == "run" and message["kind"] == "changed")
        assert answer["lines"] == ["this is the model of the link"]
        assert files.begun == ["robot Other { }"]
        for wrong in ("", "x", "!!!", link[:40], link[:-8]):
            await page.send(type="model", packed=wrong, token=token)
            answer = await page.until(lambda message: message["type"] in ("run", "refused"))
            assert "link" in str(answer) or "must be a text" in str(answer)
    assert packed("x".join(map(str, range(9000)))) is None
    with pytest.raises(RefusedError, match="too large"):
        unpacked(base64.urlsafe_b64encode(zlib.compress(b"x" * (1 << 21))).decode())


async def test_a_page_that_comes_back_goes_on_with_its_run() -> None:
    files = Playing()
    async with served(files.source, is_shared=False, robot=files.robot) as server:
        async with opened(server.url) as page:
            await page.receive("run")
            # The run has not been kept yet.
            await page.send(type="resume", page="one")
            await done(page, "event", line="light day")
            assert (await done(page, "event", line="open"))["steps"] == 2
        async with opened(server.url) as page, opened(server.url) as other:
            await page.receive("run")
            answer = await done(page, "resume", page="one")
            assert (answer["steps"], answer["lines"]) == (2, ["what this page did before is here again"])
            assert [entry["event"] for entry in page.entries()] == ["light.response", "open.request"]
            await other.receive("run")
            await other.send(type="resume", page="two")
            assert (await done(other, "event", line="seen 1"))["steps"] == 1
            await page.send(type="model", packed=packed("robot Other { }"), token=token_of(server.url))
            await page.until(lambda message: message["type"] == "run" and message["kind"] == "changed")
        async with opened(server.url) as page:
            first = components(await page.receive("update"))
            await page.send(type="resume", page="one")
            # The model of the link is kept, too.
            await page.until(lambda message: message["type"] == "update" and components(message) != first)
    kept = StoredRuns()
    for number in range(MAXIMUM_KEPT + 1):
        kept.keep(str(number), StoredRun(SynthesizedModel(FIRST)))
    assert kept.of("0") == StoredRun()
    assert kept.of("1") == StoredRun(SynthesizedModel(FIRST))


@pytest.mark.parametrize(
    "request_",
    [
        {"type": "event"},
        {"type": "event", "line": 3},
        {"type": "event", "line": " "},
        {"type": "walk", "steps": 0, "seed": 1},
        {"type": "walk", "steps": 5001, "seed": 1},
        {"type": "walk", "steps": 5},
        {"type": "walk", "steps": 5, "seed": True},
        {"type": "save", "form": "word"},
        {"type": "save", "form": ["log"]},
        {"type": "model", "packed": None},
        {"type": "model", "packed": "x", "language": "word"},
        {"type": "model", "packed": "x", "language": ["cif"]},
        {"type": "event", "line": "e", "way": -1},
        {"type": "restart", "beginning": "first"},
    ],
)
def test_requests_that_make_no_sense_are_refused(request_: dict[str, Any]) -> None:
    with pytest.raises(RefusedError):
        parse_request(json.dumps(request_))


async def test_what_is_shown_live_is_not_led_by_hand() -> None:
    made = playable_automata(GATE)
    log = LoggedRun((LogEntry(1, 0.0, "restart", "", False, {}),))
    recording = Recording(log, supervisor_in(made))
    async with served(lambda: Replay(recording), is_shared=False) as server, opened(server.url) as page:
        await page.send(type="undo")
        assert "only a model alone is" in (await page.receive("refused"))["why"]


def test_changes_of_the_supervisor_are_reported() -> None:
    carrier = """robot Carrier {
        component Gate {
            incoming message open with identifier: "/open", type: none
            incoming message shut with identifier: "/shut", type: none
            behaviour {
                initial marked state closed { on request to open goto opened }
                state opened { on request to shut goto closed }
            }
        }
        component Lift {
            incoming message raise with identifier: "/raise", type: none
            incoming message lower with identifier: "/lower", type: none
            behaviour {
                initial marked state down { on request to raise goto up }
                state up { on request to lower goto down }
            }
        }
        requirement shut needs Lift.down
        requirement lower needs Gate.closed
    }"""
    before = playable_automata(carrier)
    after = playable_automata(carrier.replace("requirement shut needs Lift.down", ""))
    lines = model_changes(before, after)
    assert "4 states, which were 3" in lines
    assert any(line.startswith("the supervisor adds nothing more to open.request (before: Lift.down") for line in lines)
    assert model_changes(before, before) == ("nothing that the supervisor does has changed",)
    assert "gone: shut.request" in model_changes(
        before, playable_automata(carrier.replace("shut with", "close with").replace("to shut", "to close")
                        .replace("requirement shut", "requirement close"))
    )  # fmt: skip


@pytest.mark.parametrize("how", ["file", "-", "link"])
async def test_the_command_plays_with_a_file_a_text_or_a_link(
    how: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gate.rscd").write_text(GATE, encoding="utf-8")
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(GATE.encode())))
    word = {"file": "gate.rscd", "-": "-", "link": f"http://127.0.0.1:8066/#model={packed(GATE)}"}[how]
    parser: argparse.ArgumentParser = Parser(prog="robosc")
    command.add_parser(parser.add_subparsers())
    arguments = parser.parse_args(["view", word])
    command._take_played(arguments)
    make, is_shared, robot = command._source(arguments)
    assert (is_shared, robot is not None and robot.shape.name) == (False, "Gate")
    async with served(make, is_shared=is_shared, robot=robot) as server, opened(server.url) as page:
        await page.receive("run")
        assert (await done(page, "event", line="light day"))["steps"] == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["gate.rscd", "--model", "gate.rscd"], "MODEL is played with alone"),
        (["gate.rscd", "--ros2"], "MODEL is played with alone"),
        (["none.rscd"], "there is no file none.rscd"),
        (["-", "--end-with-input"], "do not go together"),
        (["http://h/#model=x"], "the link holds no model"),
        ([], "what is shown?"),
    ],
)
def test_wrong_use(words: list[str], message: str) -> None:
    parser: argparse.ArgumentParser = Parser(prog="robosc")
    command.add_parser(parser.add_subparsers())
    with pytest.raises(CommandError, match=re.escape(message)):
        command.run(parser.parse_args(["view", *words]))
