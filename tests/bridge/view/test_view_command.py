"""`robosc view` as a process, and the arguments that make no sense."""

import argparse
import asyncio
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from robosc.cli.arguments import Parser
from robosc.cli.output import CommandError
from robosc.execution.runtime.event_log import json_line
from robosc_api.security import add_client_arguments
from robosc_bridge.configuration import parse
from robosc_bridge.daemon.view_settings import ADDRESS, settings_of
from robosc_bridge.endpoints import is_remote, is_startable
from robosc_view import command
from support.hostile_models import products
from support.live import LiveRobot, large_model, supervisor_without_synthesis
from support.pages_open import opened
from support.view_servers import process_of_view, view_process


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """A model and a log."""
    text = large_model(3)
    robot = LiveRobot(supervisor_without_synthesis(text))
    subscription = robot.feed.subscribe(lambda: None)
    for _ in range(50):
        robot.step()
    model, log = tmp_path / "large.rscd", tmp_path / "large.jsonl"
    model.write_text(text)
    log.write_text("".join(map(json_line, subscription.take().entries)))
    return model, log


def arguments(*words: str) -> argparse.Namespace:
    parser: argparse.ArgumentParser = Parser(prog="robosc")
    command.add_parser(parser.add_subparsers())
    return parser.parse_args(["view", *words])


def test_a_log_is_served_until_a_signal_comes(files: tuple[Path, Path]) -> None:
    model, log = files
    with view_process("--log", log, "--model", model) as (process, url):

        async def look() -> None:
            async with opened(url) as page:
                assert (await page.receive("definition"))["log"]["count"] == 50
                assert (await page.receive("update"))["enabled"]

        asyncio.run(look())
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 0


def test_it_ends_with_its_input_where_it_is_asked_to(files: tuple[Path, Path]) -> None:
    with view_process("--model", files[0], "--end-with-input") as (process, url):
        assert process.stdin is not None
        process.stdin.write("whatever")
        process.stdin.flush()

        async def look() -> None:
            async with opened(url) as page:
                await page.receive("update")

        asyncio.run(look())
        process.stdin.close()
        assert process.wait(20) == 0


def test_it_ends_with_its_input_while_its_model_is_synthesized(tmp_path: Path) -> None:
    model = tmp_path / "long.rscd"
    model.write_text(products())
    with process_of_view("--model", model, "--end-with-input") as process:
        assert process.stdin is not None
        process.stdin.close()
        assert process.wait(60) == 0


def test_wrong_use(files: tuple[Path, Path], tmp_path: Path) -> None:
    model, log = map(str, files)

    def why(*words: str) -> str:
        with pytest.raises(CommandError) as error:
            command.run(arguments(*words))
        return str(error.value)

    assert "what is shown?" in why()
    assert "needs --model" in why("--log", log)
    assert "sends its model itself" in why("--bridge", "127.0.0.1:1", "--model", model)
    assert "--ros2" in why("--bridge", "127.0.0.1:1", "--namespace", "x")
    assert "cannot read" in why("--log", str(tmp_path / "none"), "--model", model)
    assert "there is no file" in why("--log", log, "--model", str(tmp_path / "none.rscd"))
    assert "line 1" in why("--log", model, "--model", model)
    assert "there is no scene" in why("--log", log, "--model", model, "--scene", "nowhere")
    assert "--motion goes with --log" in why(model, "--motion", log)
    assert "there is no such file" in why("--log", log, "--model", model, "--motion", str(tmp_path / "none"))
    assert "not an entry of a motion record" in why("--log", log, "--model", model, "--motion", log)
    assert "other machines" in why("--log", log, "--model", model, "--address", "0.0.0.0:0")
    for words in (("--ros2", "--bridge", "127.0.0.1:1"), ("--bridge", "x:"), ("--ros2", "--address", "h:99999")):
        with pytest.raises(SystemExit):
            arguments(*words)


def test_a_missing_extra_is_reported(files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(CommandError, match=r"aiohttp and igraph: install robosc\[view\]"):
        command.run(arguments("--bridge", "127.0.0.1:1"))


def test_a_bridge_is_reached_as_by_the_commands_of_a_terminal() -> None:
    reference = argparse.ArgumentParser()
    add_client_arguments(reference)
    parser = argparse.ArgumentParser()
    command._add_client(parser)

    def shape(found: argparse.ArgumentParser) -> list[Any]:
        return [(item.option_strings, item.dest, item.default, item.type) for item in found._actions]

    assert shape(parser) == shape(reference)


def test_help_loads_no_server() -> None:
    code = "import sys, robosc_view.command; print({'grpc', 'aiohttp', 'igraph', 'rclpy'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "set()"


def test_what_a_configuration_says() -> None:
    plain = "robot: burger\ndrive: {driver: opencr, port: /dev/none}\n"

    def configured(text: str) -> Any:
        return parse((plain + text).encode(), "c.yaml").configuration

    assert settings_of(configured("")) is None
    chosen = configured("view: {address: '127.0.0.1:8066', names: [robot.example], scene: room, scene_seed: 3}")
    settings = settings_of(chosen)
    assert settings is not None
    assert (settings.address, settings.names) == (ADDRESS, ("robot.example",))
    assert (settings.scene, settings.scene_seed) == ("room", 3)
    assert is_startable(chosen) and not is_remote(chosen)
    with pytest.raises(Exception, match="'tls_key' is missing"):
        configured("view: {address: '127.0.0.1:8066', tls_certificate: x.pem}")
