"""Automata of CIF, libFAUDES and Supremica that a page plays with: outcomes, beginnings, links, files that change."""

import argparse
import asyncio
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from robosc.cli.arguments import Parser
from robosc.cli.output import CommandError
from robosc.pipeline.systems import SystemSupervisor
from robosc_view import automata, command, watched_model
from robosc_view.automata import EdgesTaken
from robosc_view.model_changes import model_changes
from robosc_view.playground import MAXIMUM_WAYS, packed, unpacked
from robosc_view.requests import parse_request
from robosc_view.sources import RefusedError
from robosc_view.watched_model import NoSupervisorError, synthesized_automata
from support.automata_models import TANK_AND_BELT
from support.pages_open import opened, token_of
from support.view_servers import served

ODD = """\
<Module xmlns="http://waters.sourceforge.net/xsd/module" name="odd">
<EventDeclList>
<EventDecl Kind="CONTROLLABLE" Name="constructor"/>
<EventDecl Kind="UNCONTROLLABLE" Name="go on -&gt; &lt;b&gt; = 1"/>
<EventDecl Kind="PROPOSITION" Name=":accepting"/>
<EventDecl Kind="PROPOSITION" Name=":forbidden"/>
</EventDeclList>
<ComponentList>
<SimpleComponent Kind="PLANT" Name="a b"><Graph><NodeList>
<SimpleNode Initial="true" Name="x, y = 1"><EventList><SimpleIdentifier Name=":accepting"/></EventList></SimpleNode>
<SimpleNode Name="&lt;i&gt;on&lt;/i&gt;"/>
<SimpleNode Name="bad"><EventList><SimpleIdentifier Name=":forbidden"/></EventList></SimpleNode>
</NodeList><EdgeList>
<Edge Source="x, y = 1" Target="&lt;i&gt;on&lt;/i&gt;"><LabelBlock>
<SimpleIdentifier Name="constructor"/></LabelBlock></Edge>
<Edge Source="&lt;i&gt;on&lt;/i&gt;" Target="x, y = 1"><LabelBlock>
<SimpleIdentifier Name="go on -&gt; &lt;b&gt; = 1"/></LabelBlock></Edge>
<Edge Source="&lt;i&gt;on&lt;/i&gt;" Target="&lt;i&gt;on&lt;/i&gt;"><LabelBlock>
<SimpleIdentifier Name="go on -&gt; &lt;b&gt; = 1"/></LabelBlock></Edge>
<Edge Source="&lt;i&gt;on&lt;/i&gt;" Target="bad"><LabelBlock><SimpleIdentifier Name="constructor"/></LabelBlock></Edge>
</EdgeList></Graph></SimpleComponent>
</ComponentList>
</Module>
"""


def arguments(*words: str) -> argparse.Namespace:
    parser: argparse.ArgumentParser = Parser(prog="robosc")
    command.add_parser(parser.add_subparsers())
    found = parser.parse_args(["view", *words])
    command._take_played(found)
    return found


@asynccontextmanager
async def serving(*words: str) -> AsyncIterator[str]:
    """The address of a page that plays with a model."""
    make, is_shared, robot = command._source(arguments(*words))
    async with served(make, is_shared=is_shared, robot=robot) as server:
        yield server.url


async def done(page: Any, kind: str, **request: Any) -> dict[str, Any]:
    """Ask for something, and return the answer about the run."""
    await page.send(type=kind, **request)
    answer: dict[str, Any] = await page.receive("run")
    return answer


async def changed(page: Any) -> list[str]:
    """Lines about a model that has changed."""
    lines: list[str] = (await page.until(lambda message: message["type"] == "run" and message["kind"] == "changed"))[
        "lines"
    ]
    return lines


def played(file: Path, text: str = TANK_AND_BELT) -> str:
    file.write_text(text, encoding="utf-8")
    return str(file)


def model(text: str, name: str = "tank.cif") -> watched_model.SynthesizedModel:
    return asyncio.run(synthesized_automata(arguments(name), text))


async def test_what_is_shown(tmp_path: Path) -> None:
    async with serving(played(tmp_path / "tank.cif")) as url, opened(url) as page:
        answer = await page.receive("definition")
        assert (answer["robot"], answer["deployment"], answer["source"]) == ("tank", "automata", "model")
        assert [(item["name"], item["role"]) for item in answer["components"]] == [
            ("sensor", "input variable"),
            ("tank", "plant"),
            ("line.belt", "plant"),
            ("order", "requirement"),
        ]
        belt, order = answer["components"][2]["graph"], answer["components"][3]["graph"]
        assert [(item["name"], item["is_initial"], item["is_marked"]) for item in belt["states"]] == [
            ("run", True, True),
            ("jam", False, False),
        ]
        assert [(item["label"], item["kind"]) for item in belt["edges"]][2] == ("line.belt.c_turn", "controllable")
        assert [item["label"] for item in order["edges"]] == ["tank.c_fill", "tank.c_fill [sensor]"]
        play = answer["play"]
        assert [(item["event"], item["controllable"]) for item in play["events"]] == [
            ("sensor", False),
            ("tank.c_fill", True),
            ("tank.u_drain", False),
            ("line.belt.u_go", False),
            ("line.belt.c_turn", True),
        ]
        assert play["events"][0]["fields"] == [
            {"path": [], "type": "boolean", "choices": ["false", "true"], "is_boolean": True, "is_required": False}
        ]
        # The supervisor does not let it begin at 4. Input variables change at any time.
        assert play["beginnings"] == [f"tank.level = {level}" for level in range(4)]
        assert (play["forms"], play["language"], unpacked(play["link"])) == ([], "cif", TANK_AND_BELT)
        first = await page.receive("run")
        assert first["lines"] == [
            "there are 4 states to begin in, and this begins where tank.level = 0: choose another one, and restart"
        ]
        update = await page.receive("update")
        assert update["components"]["tank"] == {"state": "*", "variables": {"level": 0}}
        assert update["components"]["line.belt"]["state"] == "run"


async def test_events_happen_and_the_others_say_why_not(tmp_path: Path) -> None:
    async with serving(played(tmp_path / "tank.cif")) as url, opened(url) as page:
        answer = await page.receive("run")
        assert answer["blocked"] == {
            "tank.u_drain": ["tank: tank.level > 1 does not hold (tank.level is 0)"],
            "line.belt.c_turn": ["line.belt is in run, not in jam"],
        }
        answer = await done(page, "event", line="tank.c_fill")
        assert (answer["steps"], answer["lines"]) == (1, ["tank.c_fill: order = b, tank.level = 1"])
        assert answer["blocked"]["tank.c_fill"] == ["requirement order: sensor does not hold (sensor is false)"]
        assert [item["component"] for item in page.entries()[-1]["transitions"]] == ["tank", "order"]
        answer = await done(page, "event", line="sensor true")
        assert answer["lines"] == ["sensor (true): sensor = true"]
        for _ in range(2):
            answer = await done(page, "event", line="tank.c_fill")
        assert answer["blocked"]["tank.c_fill"] == [
            "the supervisor forbids it, because of what can follow (tank.level is 3)"
        ]
        answer = await done(page, "event", line="tank.c_fill")
        assert (answer["kind"], answer["steps"]) == ("wrong", 4)
        answer = await done(page, "event", line="sensor 3")
        assert answer["lines"] == ["value of 'sensor' is 3, and must be bool"]
        answer = await done(page, "undo")
        assert (answer["redo"], answer["entries"]) == ("tank.c_fill", 3)
        assert (await page.receive("update"))["components"]["tank"]["variables"] == {"level": 2}
        answer = await done(page, "redo")
        assert (answer["redo"], answer["entries"]) == ("", 4)
        await page.send(type="save", form="log")
        answer = await page.receive("run")
        assert answer["lines"] == ["a run of automata is not saved: event logs and tests are of robots"]


async def test_of_several_outcomes_one_is_chosen(tmp_path: Path) -> None:
    async with serving(played(tmp_path / "tank.cif")) as url, opened(url) as page:
        await page.receive("run")
        answer = await done(page, "event", line="line.belt.u_go")
        assert (answer["kind"], answer["steps"]) == ("choose", 0)
        assert answer["lines"] == ["line.belt.u_go can lead to 2 states: choose one beside its button"]
        choice = answer["choice"]
        assert choice["ways"] == ["line.belt = jam", "line.belt = run"]
        answer = await done(page, "event", line=choice["line"], way=0)
        assert (answer["lines"], answer["choice"]) == (["line.belt.u_go: line.belt = jam"], None)
        (taken,) = page.entries()[-1]["transitions"]
        assert (taken["component"], taken["id"]) == ("line.belt", 3)
        answer = await done(page, "event", line="sensor")
        assert answer["choice"]["ways"] == ["sensor = false", "sensor = true"]
        assert answer["lines"][0].endswith("choose one beside its button, or enter its data")
        # A number beyond the states that there are chooses none.
        assert (await done(page, "event", line="sensor", way=2))["kind"] == "choose"
        answer = await done(page, "event", line="sensor", way=1)
        assert answer["lines"] == ["sensor: sensor = true"]


async def test_many_outcomes_are_not_all_offered(tmp_path: Path) -> None:
    text = "input int[0..199] count;\nplant p: disc int[0..149] x in any; location: initial; marked; end\n"
    async with serving(played(tmp_path / "many.cif", text)) as url, opened(url) as page:
        assert len((await page.receive("definition"))["play"]["beginnings"]) == MAXIMUM_WAYS
        assert "of which the first 100 are offered" in (await page.receive("run"))["lines"][0]
        answer = await done(page, "event", line="count")
        assert "200 states" in answer["lines"][0] and "offers the first 100" in answer["lines"][0]
        assert len(answer["choice"]["ways"]) == MAXIMUM_WAYS
        assert (await done(page, "event", line="count 150"))["steps"] == 1


async def test_a_state_to_begin_in_is_chosen_and_kept(tmp_path: Path) -> None:
    async with serving(played(tmp_path / "tank.cif")) as url:
        async with opened(url) as page:
            await page.receive("run")
            await page.send(type="resume", page="one")
            answer = await done(page, "restart", beginning=4)
            assert (answer["kind"], answer["lines"]) == ("wrong", ["there is no such state to begin in"])
            answer = await done(page, "restart", beginning=2)
            assert (answer["beginning"], answer["steps"]) == (2, 0)
            assert (await page.receive("update"))["components"]["tank"]["variables"] == {"level": 2}
            await done(page, "event", line="line.belt.u_go", way=0)
            await done(page, "event", line="sensor", way=1)
            answer = await done(page, "restart")
            assert (answer["beginning"], answer["steps"]) == (2, 0)
            await done(page, "event", line="line.belt.u_go", way=0)
            assert (await done(page, "event", line="sensor true"))["steps"] == 2
        async with opened(url) as page:
            await page.receive("run")
            await page.send(type="resume", page="one")
            answer = await page.receive("run")
            assert (answer["lines"], answer["beginning"]) == (["what this page did before is here again"], 2)
            assert (answer["steps"], [entry["event"] for entry in page.entries()]) == (
                2,
                ["line.belt.u_go", "sensor"],
            )


async def test_chance_and_findings(tmp_path: Path) -> None:
    async with serving(played(tmp_path / "tank.cif")) as url, opened(url) as page:
        await page.receive("run")
        answer = await done(page, "walk", steps=30, seed=2)
        assert (answer["steps"], answer["lines"]) == (30, ["30 events by chance, seed 2"])
        assert all(entry["transitions"] for entry in page.entries())
        answer = await done(page, "walk", steps=1000, seed=1, until_finding=True)
        assert answer["kind"] == "finding" and answer["lines"][0].startswith("blocked at tank.c_fill after ")


async def test_the_page_follows_the_file_and_what_it_imports(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watched_model, "LOOK_S", 0.01)
    head, _, last = TANK_AND_BELT.strip().rpartition("\n")
    rule = tmp_path / "rule.cif"
    played(rule, last)
    file = tmp_path / "tank.cif"
    imported = f'import "rule.cif";\n{head}\n'
    async with serving(played(file, imported)) as url, opened(url) as page:
        # A link does not hold the files that the model imports.
        assert (await page.receive("definition"))["play"]["link"] is None
        await page.receive("run")
        await done(page, "restart", beginning=1)
        await done(page, "event", line="line.belt.u_go", way=0)
        await done(page, "event", line="tank.c_fill")
        played(rule, last.replace("!= 4", "< 3"))
        lines = await changed(page)
        assert lines[0] == "the model has changed"
        assert any(re.fullmatch(r"\d+ states, which were \d+", line) for line in lines)
        assert "the supervisor adds to tank.c_fill: tank.level <= 1 (before: tank.level != 3)" in lines
        message = await done(page, "undo")
        assert (message["steps"], message["beginning"]) == (1, 1)
        await done(page, "redo")
        played(rule, "requirement tank.c_fill needs tank.leve = 1;")
        update = await page.until(lambda message: message["type"] == "update" and message["warnings"])
        (warning,) = update["warnings"]
        assert "this is not what it says" in warning["text"] and "rule.cif:1:" in warning["text"]
        # The page says what is to blame where there is no supervisor.
        played(rule, "requirement invariant tank.level > 4;")
        update = await page.until(
            lambda message: (
                message["type"] == "update" and "to blame" in "".join(w["text"] for w in message["warnings"])
            )
        )
        assert "no supervisor exists" in update["warnings"][0]["text"]
        # Automata that begin elsewhere do not begin where they did.
        played(rule, "requirement invariant tank.level > 2;")
        played(file, imported.replace("when level > 1", "when level > 3"))
        lines = await changed(page)
        assert any(line.startswith("it cannot begin where it did, and begins anew: ") for line in lines)
        assert not (await page.until(lambda message: message["type"] == "update" and not message["warnings"]))[
            "warnings"
        ]


async def test_a_link_names_the_language_and_reads_no_file(tmp_path: Path) -> None:
    secret = tmp_path / "secret.cif"
    played(secret, "plant Secret: location: initial; marked; end")
    async with serving(played(tmp_path / "gate.gen", GEN)) as url, opened(url) as page:
        token = token_of(url)
        assert (await page.receive("definition"))["play"]["language"] == "gen"
        await page.send(type="model", packed=packed(TANK_AND_BELT), language="cif", token=token)
        assert await changed(page) == ["this is the model of the link"]
        importing = f'import "{secret}";\n{TANK_AND_BELT}'
        await page.send(type="model", packed=packed(importing), language="cif", token=token)
        answer = await page.until(lambda message: message["type"] == "run" and message["kind"] == "wrong")
        assert f"there is no file '{secret}' that can be read" in answer["lines"][0]
    link = f"http://127.0.0.1:8066/#model.cif={packed(TANK_AND_BELT)}"
    given = arguments(link)
    assert (given.model, given.text) == (Path("model.cif"), TANK_AND_BELT)
    assert arguments(f"http://127.0.0.1:8066/#model={packed(TANK_AND_BELT)}").model == Path("model.rscd")
    _, is_shared, robot = command._source(given)
    assert (is_shared, robot is not None and robot.shape.name) == (False, "model")
    with pytest.raises(RefusedError, match="one of rscd, cif, gen, wmod"):
        parse_request('{"type": "model", "packed": "x", "language": "exe"}')


GEN = """\
<Generator>
"gate"
<Alphabet> "open" +C+ "shut" </Alphabet>
<States> "closed" "opened" </States>
<TransRel> "closed" "open" "opened" "opened" "shut" "closed" </TransRel>
<InitStates> "closed" </InitStates>
<MarkedStates> "closed" </MarkedStates>
</Generator>
"""


def test_names_may_be_anything(tmp_path: Path) -> None:
    odd = "go on -> <b> = 1"

    async def run() -> None:
        async with serving(played(tmp_path / "odd.wmod", ODD)) as url, opened(url) as page:
            answer = await page.receive("definition")
            assert [item["event"] for item in answer["play"]["events"]] == ["constructor", odd]
            await page.receive("run")
            assert (await done(page, "event", line="constructor"))["steps"] == 1
            answer = await done(page, "event", line=odd)
            assert answer["choice"] == {"event": odd, "line": odd, "ways": ["a b = <i>on</i>", "a b = x, y = 1"]}
            assert (await done(page, "event", line=odd, way=1))["lines"] == [f"{odd}: a b = x, y = 1"]

    asyncio.run(run())
    # Such a supervisor can be handed on, too, though no file can hold it.
    made = model(ODD, "odd.wmod")
    assert isinstance(made.supervisor, SystemSupervisor) and made.language == "wmod"


def test_edges_that_cannot_be_told_apart_are_not_reported() -> None:
    made = model(
        "plant p: uncontrollable u_a; disc int[0..9] x = 0; location: initial; marked;"
        "  edge u_a when x < 1 do x := 1; edge u_a when x >= 1 do x := 2; edge u_a when x = 2 do x := 2; end"
    )
    assert isinstance(made.supervisor, SystemSupervisor)
    taken, run_ = EdgesTaken(made.supervisor.system), automata_run(made)
    numbers = []
    for _ in range(3):
        before = run_.state
        numbers.append(taken.of(before, run_.step("p.u_a")))
    assert numbers == [[0], [1], []]


def automata_run(made: watched_model.SynthesizedModel) -> Any:
    from robosc.pipeline.system_runs import SystemRun

    assert isinstance(made.supervisor, SystemSupervisor)
    return SystemRun(made.supervisor)


def test_a_supervisor_in_the_model_is_drawn_as_one() -> None:
    made = model(
        "plant p: controllable c; location a: initial; marked; edge c; end "
        "supervisor s: location x: initial; marked; edge p.c goto y; location y: marked; end"
    )
    assert isinstance(made.supervisor, SystemSupervisor)
    robot = automata.robot_of_automata(made.supervisor, {})
    assert {name: drawn.role for name, drawn in robot.automata.items()} == {"p": "plant", "s": "supervisor"}
    run_ = automata_run(made)
    run_.step("p.c")
    assert run_.reasons("p.c") == ("s is in y, not in x",)


def test_changes_of_the_supervisor_are_reported() -> None:
    before = model(TANK_AND_BELT)
    after = model(TANK_AND_BELT.replace("c_turn", "c_back").replace("!= 4", "< 3"))
    lines = model_changes(before, after)
    assert "new: line.belt.c_back" in lines and "gone: line.belt.c_turn" in lines
    assert "the supervisor adds to tank.c_fill: tank.level <= 1 (before: tank.level != 3)" in lines
    assert model_changes(before, before) == ("nothing that the supervisor does has changed",)


def test_a_model_that_is_too_large_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = played(tmp_path / "tank.cif")
    monkeypatch.setattr(automata, "MAXIMUM_DRAWN", 4)
    _, _, robot = command._source(arguments(file))
    assert robot is not None
    assert [len(item.nodes) for item in robot.automata.values()] == [1, 1, 0, 0]
    for name, what in (("MAXIMUM_EVENTS", "5 events"), ("MAXIMUM_AUTOMATA", "4 automata")):
        monkeypatch.setattr(automata, name, 3)
        with pytest.raises(CommandError, match=f"tank has {what}, and a page shows at most 3: lead it by 'robosc sim"):
            command._source(arguments(file))
        monkeypatch.undo()
    ways = "".join(f"disc int[0..99] x{number} in any; " for number in range(4))
    with pytest.raises(NoSupervisorError, match="cannot be simulated: 100000000 choices are too many"):
        model(f"plant p: {ways} location: initial; marked; end")


def test_a_model_without_a_supervisor_and_one_with_errors(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "tank.cif"
    for text, problem in (
        (TANK_AND_BELT.replace("when level > 1 do", "do"), "to blame"),
        (TANK_AND_BELT.replace("c_fill do", "c_fil do"), "cif-unknown-name"),
    ):
        with pytest.raises(CommandError, match="there is no supervisor of") as error:
            command._source(arguments(played(file, text)))
        assert error.value.status == 1
        assert problem in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--log", "run.jsonl", "--model", "tank.cif"], "--log: event logs are of robots, not of automata"),
        (["--ros2", "--model", "tank.gen"], "--ros2: a node is generated from a model of a robot"),
        (["--bridge", "127.0.0.1:1", "--model", "tank.cif"], "a bridge sends its model itself"),
        (["tank.wmod", "--scene", "room"], "--scene: automata are nowhere"),
        (["tank.cif", "-L", "."], "-L: automata import no libraries"),
        (["tank.cif", "--deployment", "layer"], "--deployment: automata are not a node"),
        (["tank.cif"], "there is no file tank.cif"),
    ],
)
def test_wrong_use(words: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    parser: argparse.ArgumentParser = Parser(prog="robosc")
    command.add_parser(parser.add_subparsers())
    with pytest.raises(CommandError, match=re.escape(message)) as error:
        command.run(parser.parse_args(["view", *words]))
    assert error.value.status == 2
