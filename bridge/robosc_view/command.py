"""`robosc view`: the live view of a bridge, of a ROS 2 node, or of an event log; a page to play with a model."""

import argparse
import contextlib
import os
import re
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robosc.cli.arguments import add_given_supervisor_options, suggest
from robosc.cli.output import CommandError, ExitCode, UsageError
from robosc.pipeline.automata_files import SUFFIXES, is_automata

if TYPE_CHECKING:
    from robosc.certification import SynthesisOutcome
    from robosc.event_logs import LoggedRun
    from robosc.source import Bundle
    from robosc.supervisor import Supervisor
    from robosc_bridge.daemon.view_settings import ViewSettings
    from robosc_view.definition import Robot
    from robosc_view.motion import MotionTrace
    from robosc_view.sources import Source
    from robosc_view.watched_model import SynthesizedModel, WatchedModel

_ADDRESS = "127.0.0.1:8066"
_MOST_BYTES = (1 << 24) + 1
_LINK = re.compile(rf"https?://[^#]*#model(?P<suffix>{'|'.join(map(re.escape, sorted(SUFFIXES)))})?=(?P<packed>.*)")

_DESCRIPTION = """\
Serve a web page that shows a robot under its supervisor: the automata with the states that they are in, variables,
services and actions, which requests are enabled and why the others are not, and every event. The address to open is
printed, with a token that lets its page command the robot; stopping it needs none.

Of a MODEL alone it is a playground: you have its events happen, with their data, take them back, let chance go on, and
keep the run as an event log or a test. Whenever the model's file is saved the page follows, and says what has changed.
"""

_EPILOG = """\
exit status:
  0  ended by Ctrl-C or a signal
  1  there is no supervisor of the model
  2  wrong use; a file that cannot be read; an address that cannot be served
"""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "view",
        help="show a robot in a web page, live or from its event log; play with a model",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    shown = parser.add_argument_group("what is shown")
    shown.add_argument(
        "played",
        nargs="?",
        metavar="MODEL",
        help="a model (.rscd; of automata .cif, .gen, .wmod) or a supervisor (.rsup) to play with; - for a model on "
        "standard input; or the link that a page has made, which holds its model",
    )
    source = shown.add_mutually_exclusive_group()
    source.add_argument("--bridge", type=_bridge, metavar="HOST[:PORT]", help="a bridge, by its gRPC service")
    source.add_argument("--ros2", action="store_true", help="a generated ROS 2 node, by its topic /state")
    source.add_argument("--log", type=Path, metavar="FILE", help="an event log, which is replayed; needs --model")
    parser.add_argument(
        "--motion",
        type=Path,
        metavar="FILE",
        help="with --log: how the robot moved, as a simulator records it, for the map (default: motion.jsonl beside "
        "the log, if it is of the same time)",
    )
    parser.add_argument("--namespace", default="", metavar="NAME", help="with --ros2: what stands before /state")
    parser.add_argument(
        "--model",
        type=Path,
        metavar="FILE",
        help="with --log or --ros2: the model (.rscd), which is synthesized, or its supervisor (.rsup); without it the "
        "page of a node cannot show which requests are enabled. Alone it is the same as MODEL",
    )
    parser.add_argument(
        "--counter-strategy",
        action="store_true",
        help="with MODEL, whose goals or missions cannot be reached: let the surroundings play, so that they are never "
        "reached; you choose requests, or wait",
    )
    add_given_supervisor_options(parser, "stands")
    scene = parser.add_argument(
        "--scene",
        metavar="NAME|FILE",
        help="a scene of the simulator, whose walls and line the map shows, from where the robot began",
    )
    suggest(scene, _scene_names)
    parser.add_argument(
        "--scene-seed", type=int, default=0, metavar="N", help="of what the scene leaves to chance (default: 0)"
    )
    _add_serving(parser)
    _add_client(parser)
    parser.set_defaults(run=run, text=None)


def _scene_names() -> tuple[str, ...]:
    from robosc_simulated.scene import scene_names

    return scene_names()


def _add_serving(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("the page")
    group.add_argument(
        "--address",
        type=_address,
        default=_ADDRESS,
        metavar="HOST:PORT",
        help="address that it is served at (default: %(default)s)",
    )
    group.add_argument(
        "--name",
        action="append",
        default=[],
        metavar="HOST",
        help="a further name by which browsers reach it (may be repeated)",
    )
    group.add_argument(
        "--framed-by",
        type=_framing,
        action="append",
        default=[],
        metavar="SOURCE",
        help="pages that may show this one in a frame: an origin, such as https://site:8443, or vscode-webview: or "
        "vscode-file:, those of an editor (may be repeated; default: none)",
    )
    group.add_argument(
        "--end-with-input",
        action="store_true",
        help="end when standard input ends, too: with the program that has started this one, however that ends",
    )
    group.add_argument("--open", action="store_true", help="open it in a browser")
    group.add_argument("--tls-certificate", type=Path, metavar="FILE", help="certificate chain (PEM): serve with TLS")
    group.add_argument("--tls-key", type=Path, metavar="FILE", help="private key of the certificate (PEM)")
    group.add_argument(
        "--insecure-beyond-loopback",
        action="store_true",
        help="serve without TLS where other machines reach it, on a network that you trust",
    )


def _add_client(parser: argparse.ArgumentParser) -> None:
    """Add the options for reaching the bridge, as `robosc_api.security.add_client_arguments` does.

    Written again, since that function would load gRPC for the help of every command.
    """
    group = parser.add_argument_group("security")
    group.add_argument("--tls", action="store_true", help="use TLS, and trust the system's certificate authorities")
    group.add_argument(
        "--ca",
        type=Path,
        metavar="FILE",
        default=_from_environment("ROBOSC_CA"),
        help="use TLS, and trust only these certificates (PEM; default: $ROBOSC_CA)",
    )
    group.add_argument("--certificate", type=Path, metavar="FILE", help="client certificate chain (PEM)")
    group.add_argument("--key", type=Path, metavar="FILE", help="private key of the certificate (PEM)")
    group.add_argument(
        "--token-file",
        type=Path,
        metavar="FILE",
        default=_from_environment("ROBOSC_TOKEN_FILE"),
        help="file with the own token (default: $ROBOSC_TOKEN_FILE)",
    )


def _from_environment(name: str) -> Path | None:
    value = os.environ.get(name)
    return Path(value) if value else None


_ADDRESS_PATTERN = re.compile(r"(\[[0-9A-Fa-f:.%]+\]|[A-Za-z0-9._-]+):([0-9]{1,5})\Z")


def _bridge(text: str) -> str:
    # Imported here: gRPC comes with it, which the help of all commands does not need.
    from robosc_api.security.addresses import BRIDGE_PORT, with_port

    try:
        return with_port(text, BRIDGE_PORT)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _address(text: str) -> str:
    match = _ADDRESS_PATTERN.match(text)
    if not match or int(match[2]) > 65535:
        raise argparse.ArgumentTypeError(f"not HOST:PORT: '{text}'")
    return text


_ORIGIN = re.compile(r"https?://(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+)(:[0-9]{1,5})?\Z")
_EDITORS = ("vscode-webview:", "vscode-file:")
"""Schemes of pages that editors have made. Of others anybody may have pages: `file:` is whatever was downloaded."""


def _framing(text: str) -> str:
    if _ORIGIN.match(text) or text in _EDITORS:
        return text
    schemes = " or ".join(_EDITORS)
    raise argparse.ArgumentTypeError(
        f"neither an origin, such as https://site:8443, nor a scheme of an editor ({schemes}): '{text}'"
    )


def run(arguments: argparse.Namespace) -> int:
    """Serve the page until a signal comes.

    Raises:
        CommandError: The page cannot be served, or there is nothing to show.
    """
    from robosc_view.sources import ViewError, require_view

    _take_played(arguments)
    if not (arguments.bridge or arguments.ros2 or arguments.log or arguments.model):
        raise UsageError("what is shown? MODEL, --bridge HOST, --ros2, or --log FILE --model FILE")
    if arguments.log is not None and arguments.model is None:
        raise UsageError("--log needs --model: the model that the log is of")
    if arguments.model is not None and arguments.bridge is not None:
        raise UsageError("--model goes with --log or --ros2, or alone: a bridge sends its model itself")
    if arguments.model is not None and is_automata(arguments.model):
        _refuse_for_automata(arguments)
    if arguments.counter_strategy:
        _refuse_beside_counter_strategy(arguments)
    if arguments.motion is not None and arguments.log is None:
        raise UsageError("--motion goes with --log")
    if arguments.namespace and not arguments.ros2:
        raise UsageError("--namespace goes with --ros2")
    try:
        require_view()
        input_end = _InputEnd() if arguments.end_with_input else None
        make, is_shared, robot = _source(arguments)
        return _serve(arguments, make, robot, input_end, is_shared=is_shared)
    except ViewError as error:
        raise CommandError(str(error), ExitCode.USAGE) from error


def _refuse_beside_counter_strategy(arguments: argparse.Namespace) -> None:
    """Do nothing if a robot's model is played with.

    Raises:
        UsageError: Something else is to be shown, or goals have no effect.
    """
    is_played = arguments.model is not None and not (arguments.bridge or arguments.ros2 or arguments.log)
    if not is_played or is_automata(arguments.model) or arguments.model.suffix == ".rsup":
        raise UsageError(
            "--counter-strategy is for the model of a robot (MODEL), whose goals or missions cannot be reached"
        )
    if arguments.deployment == "layer":
        raise UsageError("--counter-strategy is for controllers: goals have no effect in a supervision layer")


def _refuse_for_automata(arguments: argparse.Namespace) -> None:
    """Do nothing if all options have a meaning for automata.

    Raises:
        UsageError: Something does not.
    """
    from robosc.cli.automata import refuse

    alone = "automata are played with alone"
    refuse(arguments.log is not None, f"--log: event logs are of robots, not of automata; {alone}")
    refuse(arguments.ros2, f"--ros2: a node is generated from a model of a robot, not from automata; {alone}")
    refuse(arguments.scene is not None, "--scene: automata are nowhere, and have no map")


def _take_played(arguments: argparse.Namespace) -> None:
    """Take the MODEL that is played with: `text` is what it holds itself, `model` its file.

    Raises:
        UsageError: Something else is to be shown, too, or it holds no model.
    """
    if arguments.played is None:
        return
    if arguments.bridge or arguments.ros2 or arguments.log or arguments.model:
        raise UsageError("MODEL is played with alone: without --bridge, --ros2, --log and --model")
    suffix = ".rscd"
    if arguments.played == "-":
        from robosc.language import decode_source

        if arguments.end_with_input:
            raise UsageError("--end-with-input and a model on standard input do not go together")
        arguments.text = decode_source(sys.stdin.buffer.read(_MOST_BYTES), "standard input")
    elif link := _LINK.match(arguments.played):
        from robosc_view.playground import unpacked
        from robosc_view.sources import RefusedError

        try:
            arguments.text = unpacked(link["packed"])
        except RefusedError as error:
            raise UsageError(str(error)) from error
        suffix = link["suffix"] or suffix
    arguments.model = Path(f"model{suffix}" if arguments.text is not None else arguments.played)


def _source(arguments: argparse.Namespace) -> "tuple[Callable[[], Source], bool, Robot | None]":
    """Return a function that makes the source, whether all pages share one, and the robot where it is known."""
    from robosc_view.scene_map import scene_map

    scene = scene_map(arguments.scene, arguments.scene_seed)
    if arguments.bridge is not None:
        from robosc_api.security import SecurityError, check_credentials, credentials_of
        from robosc_view.remote_bridge import RemoteBridge

        credentials = credentials_of(arguments)
        try:
            check_credentials(credentials)
        except SecurityError as error:
            raise UsageError(str(error)) from error
        return lambda: RemoteBridge(arguments.bridge, credentials, scene), True, None
    if not arguments.ros2 and arguments.log is None:
        return _playground(arguments, scene)
    supervisor = None if arguments.model is None else _supervisor(arguments)
    if arguments.ros2:
        from robosc_view.ros2_topic import StateTopic

        _require_ros2()
        return lambda: StateTopic(arguments.namespace, supervisor, scene), True, None
    from robosc_view.replay import Recording, Replay

    assert supervisor is not None  # noqa: S101  # `run` has seen to that.
    run_ = _log(arguments.log)
    recording = Recording(run_, supervisor, scene, _motion(arguments, run_))
    return lambda: Replay(recording), False, recording.robot


def _playground(arguments: argparse.Namespace, scene: Any) -> "tuple[Callable[[], Source], bool, Robot]":
    """Return a function that makes the run of a page, that each page has its own, and the robot."""
    from robosc.cli.simulate import model_of_test
    from robosc_view.playground import Playground, StoredRuns, playable
    from robosc_view.requests import ROBOSC
    from robosc_view.watched_model import synthesized, synthesized_automata

    words = ["--deployment", arguments.deployment or "controller", "--engine", arguments.engine, "--allow-livelock"]
    words += [word for folder in arguments.library_path for word in ("--library-path", str(folder))]
    words += [word for folder in arguments.interface_path for word in ("--interface-path", str(folder))]
    words += [] if arguments.distribution is None else ["--distribution", arguments.distribution]
    words += ["--reorder"] if arguments.reorder else []
    words += [] if arguments.max_nodes is None else ["--max-nodes", str(arguments.max_nodes)]
    watched = _watched_automata(arguments) if is_automata(arguments.model) else _watched(arguments, words)
    file = None if arguments.text is not None else model_of_test(arguments)
    kept = StoredRuns()

    async def make_of_link(text: str, language: str) -> "SynthesizedModel":
        if language == ROBOSC:
            return await synthesized(words, text)
        named = argparse.Namespace(**{**vars(arguments), "model": Path(f"model.{language}")})
        return await synthesized_automata(named, text)

    return (
        lambda: Playground(watched, kept, file, make_of_link, scene),
        False,
        playable(watched.made, scene),
    )


def _watched(arguments: argparse.Namespace, words: list[str]) -> "WatchedModel":
    """The model that is played with, which looks at its files again and again."""
    from robosc.cli import synth
    from robosc.cli.arguments import read_bundle
    from robosc.errors import RoboscError
    from robosc.pipeline.loading import load
    from robosc_view.watched_model import (
        NoSupervisorError,
        SynthesizedModel,
        WatchedModel,
        file_digest,
        finding_text,
        read,
        synthesized,
    )

    model: Path = arguments.model
    if model.suffix == ".rsup":

        async def read_again() -> SynthesizedModel:
            return SynthesizedModel(read(model))

        seen = file_digest(model)
        return WatchedModel(SynthesizedModel(_supervisor(arguments)), seen, lambda: file_digest(model), read_again)
    text: str | None = arguments.text
    if text is None:
        bundle = read_bundle(arguments)
    else:
        bundle = load(
            text=text,
            library_paths=arguments.library_path,
            interface_paths=arguments.interface_path,
            distribution=arguments.distribution,
        )
    deployment = arguments.deployment or "controller"
    outcome = synth.make(
        argparse.Namespace(**{**vars(arguments), "deployment": deployment}), bundle, allow_livelock=True
    )
    if arguments.counter_strategy:
        return _watched_denied(arguments, bundle, outcome)
    synth.report_problems(outcome, bundle)
    if outcome.supervisor is None:
        raise CommandError(f"there is no supervisor of {bundle.main.name}", ExitCode.FAILED)
    seen = outcome.supervisor.certificate.bundle_sha256

    def read_again_() -> "Bundle":
        try:
            return read_bundle(arguments)
        except (UsageError, RoboscError) as error:
            raise NoSupervisorError(str(error)) from error

    async def make() -> SynthesizedModel:
        made = await synthesized((*words, "--", str(model)))
        return SynthesizedModel(made.supervisor, made.findings, _whole_text(read_again_()))

    findings = tuple(finding_text(item.severity, item.message, item.code) for item in outcome.diagnostics)
    return WatchedModel(
        SynthesizedModel(outcome.supervisor, findings, _whole_text(bundle)),
        seen,
        lambda: seen if text is not None else read_again_().digest,
        make,
    )


def _watched_denied(arguments: argparse.Namespace, bundle: "Bundle", outcome: "SynthesisOutcome") -> "WatchedModel":
    """Return the model that the surroundings play against, which looks at its files again and again.

    Raises:
        CommandError: The surroundings have no counter-strategy.
    """
    from robosc.certification import make_supervisor
    from robosc.cli import synth
    from robosc.cli.arguments import engine_options, read_bundle
    from robosc.errors import RoboscError
    from robosc_view.watched_model import (
        NoSupervisorError,
        SynthesizedModel,
        WatchedModel,
        denied_model,
        synthesized_denied,
    )

    try:
        first = denied_model(outcome, _whole_text(bundle))
    except NoSupervisorError as error:
        synth.report_problems(outcome, bundle)
        raise CommandError(f"--counter-strategy: {error}", ExitCode.FAILED) from error

    def read_again() -> "Bundle":
        try:
            return bundle if arguments.text is not None else read_bundle(arguments)
        except (UsageError, RoboscError) as error:
            raise NoSupervisorError(str(error)) from error

    def made(should_stop: "Callable[[], bool]") -> SynthesizedModel:
        present = read_again()
        found = make_supervisor(present, engine=engine_options(arguments), allow_livelock=True, should_stop=should_stop)
        return denied_model(found, _whole_text(present))

    return WatchedModel(first, bundle.digest, lambda: read_again().digest, lambda: synthesized_denied(made))


def _watched_automata(arguments: argparse.Namespace) -> "WatchedModel":
    """The automata that are played with, whose files are looked at again and again."""
    from robosc.cli import automata
    from robosc.cli.output import print_diagnostics
    from robosc.errors import RoboscError
    from robosc.pipeline.automata_files import load_automata_file
    from robosc_view.automata_synthesis import playable_automata
    from robosc_view.watched_model import NoSupervisorError, WatchedModel, synthesized_automata

    model: Path = arguments.model
    text: str | None = arguments.text
    loaded, found = automata.synthesized(arguments, text=text)
    if found.supervisor is None:
        automata.report_none(argparse.Namespace(model=model, json=False), found, loaded)
        raise CommandError(f"there is no supervisor of {model}", ExitCode.FAILED)
    print_diagnostics(found.diagnostics, loaded)
    made = playable_automata(loaded, found)
    if isinstance(made, str):
        raise UsageError(made)
    seen = loaded.digest

    def digest() -> str:
        if text is not None:
            return seen
        try:
            return load_automata_file(model).digest
        except RoboscError as error:
            raise NoSupervisorError(str(error)) from error

    return WatchedModel(made, seen, digest, lambda: synthesized_automata(arguments))


def _whole_text(bundle: "Bundle") -> str | None:
    """The text of a model, if that is all of it: without libraries."""
    return None if bundle.libraries else bundle.main.text


def _require_ros2() -> None:
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        raise UsageError("there is no ROS 2 here: install one and source it, or install robosc[ros2]") from error


def _log(path: Path) -> "LoggedRun":
    from robosc.event_logs import LogError, read_log

    try:
        found = read_log(path)
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror or error}") from error
    except LogError as error:
        raise UsageError(str(error)) from error
    for note in found.notes():
        sys.stderr.write(f"robosc: {note}\n")
    return found


def _motion(arguments: argparse.Namespace, run_: "LoggedRun") -> "MotionTrace | None":
    from robosc.event_logs import MotionOfLogError
    from robosc.event_logs.motions import motion_of_log
    from robosc_view.motion import MotionTrace
    from robosc_view.scene_map import scene_start

    times_s = [entry.time_s for entry in run_.entries] or [0.0]
    try:
        found = motion_of_log(arguments.log, arguments.motion, min(times_s), max(times_s))
    except MotionOfLogError as error:
        raise UsageError(str(error)) from error
    return None if found is None else MotionTrace(found, scene_start(arguments.scene, arguments.scene_seed))


def _supervisor(arguments: argparse.Namespace) -> "Supervisor":
    from robosc.cli.supervisor_argument import supervisor_of_arguments

    found = supervisor_of_arguments(arguments)
    if found is None:
        raise CommandError(f"there is no supervisor of {arguments.model}", ExitCode.FAILED)
    return found


def _settings(arguments: argparse.Namespace) -> "ViewSettings":
    from robosc_api.security import ServerSecurity
    from robosc_bridge.daemon.view_settings import ViewSettings

    security = ServerSecurity(
        certificate=arguments.tls_certificate,
        key=arguments.tls_key,
        insecure_beyond_loopback=arguments.insecure_beyond_loopback,
    )
    return ViewSettings(arguments.address, security, tuple(arguments.name), tuple(arguments.framed_by))


class _InputEnd:
    """Ends the page when standard input ends, and before there is one, while a model is synthesized, the process."""

    def __init__(self) -> None:
        self.end: Callable[[], object] = lambda: os._exit(ExitCode.OK)
        threading.Thread(target=self._follow, daemon=True).start()

    def _follow(self) -> None:
        # Not by `sys.stdin`, which nobody may hold when the interpreter ends.
        with contextlib.suppress(OSError):
            while os.read(0, 4096):
                pass
        # The loop may have ended before.
        with contextlib.suppress(RuntimeError):
            self.end()


def _serve(
    arguments: argparse.Namespace,
    make: "Callable[[], Source]",
    robot: "Robot | None",
    input_end: _InputEnd | None,
    *,
    is_shared: bool,
) -> int:
    import asyncio
    import signal

    from robosc_view.server import ViewServer

    async def serve() -> None:
        end = asyncio.Event()
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, end.set)
        if input_end is not None:
            input_end.end = lambda: loop.call_soon_threadsafe(end.set)
        server = ViewServer(_settings(arguments), make, is_shared=is_shared, robot=robot)
        await server.start()
        try:
            sys.stdout.write(f"{server.url}\n")
            sys.stdout.flush()
            if arguments.open:
                import webbrowser

                await asyncio.to_thread(webbrowser.open, server.url)
            await end.wait()
        finally:
            await server.stop()

    asyncio.run(serve())
    return ExitCode.OK
