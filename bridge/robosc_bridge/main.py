"""`robosc-bridge`: run a supervisor on a robot's devices, and check and prepare its configuration."""

import argparse
import dataclasses
import json
import logging
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import msgspec

from robosc._version import __version__
from robosc.cli.running import Parser
from robosc.errors import LanguageError, RoboscError
from robosc.execution.runtime.event_log import EventLog, NullLog, open_event_log
from robosc.language import load_bundle
from robosc.model.check import check
from robosc.model.layers import layer_findings
from robosc.model.structure import Deployment, Model
from robosc_api.security.addresses import SYNTHESIS_PORT, with_port
from robosc_bridge.assembly import assemble, check_settings, safety_limits
from robosc_bridge.captures.commands import add_commands as add_capture_commands
from robosc_bridge.captures.commands import add_recording, make_recorder
from robosc_bridge.captures.recorder import RecordingHost
from robosc_bridge.configuration import init, load, map_channels, schema
from robosc_bridge.configuration.structure import TURTLEBOTS
from robosc_bridge.configuration.template import PORTS, UDEV_RULES, DriveDriver, ScannerDriver
from robosc_bridge.daemon.keyboard import Keyboard
from robosc_bridge.daemon.loop import Key
from robosc_bridge.daemon.supervisors import (
    MODEL_SUFFIX,
    NoSupervisorError,
    Source,
    cache_folder,
    credentials_of,
    deployment_of,
    obtain,
    trusted_keys,
)
from robosc_bridge.daemon.view_settings import ADDRESS as VIEW_ADDRESS
from robosc_bridge.driver_registry import Kind, available_drivers
from robosc_bridge.endpoints import make_endpoints
from robosc_bridge.errors import BridgeError
from robosc_bridge.first_drive.commands import add_commands as add_first_drive_commands
from robosc_bridge.first_drive.ports import stable_name
from robosc_bridge.health_check import add_command as add_health_command
from robosc_bridge.ros2.command import add_command as add_ros2_command
from robosc_bridge.terminal.commands import add_commands
from robosc_bridge.transport.system_host import SYSTEM_HOST

OK, FAULT, WRONG_USE = 0, 1, 2

UDEV_FOLDERS = tuple(map(Path, ("/etc/udev/rules.d", "/run/udev/rules.d", "/usr/lib/udev/rules.d")))
"""Folders of udev rules."""

_SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)

_EPILOG = (
    "exit status: 0 all is well, or the bridge was ended by a signal; 1 a fault stopped it, or motors may still hold; "
    "2 wrong use or files"
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit status."""
    arguments = make_parser().parse_args(argv)
    try:
        status: int = arguments.run(arguments)
    except (BridgeError, RoboscError, OSError) as error:
        for line in str(error).splitlines():
            sys.stderr.write(f"robosc-bridge: {line}\n")
        return WRONG_USE
    return status


def make_parser() -> Parser:
    """The parser of the whole command line."""
    parser = Parser(prog="robosc-bridge", description=__doc__, epilog=_EPILOG)
    parser.add_argument("--version", action="version", version=f"robosc-bridge {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    run = commands.add_parser("run", help="execute a supervisor on a robot's devices", epilog=_EPILOG)
    _model_argument(
        run, "the model (.rscd), or a supervisor (.rsup): signed, or with its model beside it, called alike"
    )
    _configuration_argument(run)
    _deployment_argument(run)
    run.add_argument(
        "--server",
        type=_server,
        metavar="HOST[:PORT]",
        help=f"a synthesis server that makes the supervisor of the model (default port: {SYNTHESIS_PORT})",
    )
    run.add_argument(
        "--keep",
        metavar="FOLDER",
        type=Path,
        help="folder for what the server made last, which serves for a start without network; else supervisor.keep of "
        "the configuration, $XDG_STATE_HOME/robosc-bridge or ~/.local/state/robosc-bridge",
    )
    run.add_argument(
        "--allow-livelock", action="store_true", help="execute it even if its silent steps can go on for ever"
    )
    run.add_argument(
        "--standby",
        action="store_true",
        help="wait for an operator to start it; needs a remote endpoint (section remote)",
    )
    run.add_argument(
        "--view",
        metavar="HOST:PORT",
        nargs="?",
        const=VIEW_ADDRESS,
        help="serve the live view, a web page (default: view.address of the configuration; without a value "
        f"{VIEW_ADDRESS})",
    )
    run.add_argument(
        "--dry",
        action="store_true",
        help="everything but motion: torque stays off, and the velocities are logged instead; the supervisor gets the "
        "readings that the motion would have given",
    )
    add_recording(run)
    run.add_argument("--verbose", action="store_true", help="log more")
    run.set_defaults(run=_run)

    checked = commands.add_parser("check", help="check a configuration against a model", epilog=_EPILOG)
    _model_argument(checked, "the model (.rscd)")
    _configuration_argument(checked)
    _deployment_argument(checked)
    checked.set_defaults(run=_check)

    first = commands.add_parser("init", help="write a first configuration for a robot and a model", epilog=_EPILOG)
    _model_argument(first, "the model (.rscd)")
    first.add_argument("--robot", choices=TURTLEBOTS, default="burger")
    first.add_argument("--drive", choices=get_args(DriveDriver), default="opencr")
    first.add_argument("--scanner", choices=get_args(ScannerDriver), default="lds02")
    for name, what in (("drive", "drive"), ("scanner", "LiDAR")):
        first.add_argument(
            f"--{name}-port",
            metavar="PATH",
            help=f"serial port of the {what} (default: its name by the udev rules of deploy/udev where these are "
            "installed, else that below /dev/serial/by-id of the kernel's usual one, else this)",
        )
    first.add_argument(
        "-o", "--output", metavar="FILE", type=Path, help="file to write; standard output if it is left out"
    )
    first.set_defaults(run=_init)

    described = commands.add_parser("schema", help="print the JSON schema of configurations")
    described.set_defaults(run=_schema)

    drivers = commands.add_parser("drivers", help="list the drivers of drive bases and range scanners")
    drivers.add_argument("--json", action="store_true", help="for programs")
    drivers.set_defaults(run=_drivers)
    add_capture_commands(commands)
    add_first_drive_commands(commands)
    add_health_command(commands)
    add_commands(commands)
    add_ros2_command(commands)
    return parser


def _server(text: str) -> str:
    try:
        return with_port(text, SYNTHESIS_PORT)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _model_argument(parser: argparse.ArgumentParser, text: str) -> None:
    parser.add_argument("--model", metavar="FILE", type=Path, required=True, help=text)


def _deployment_argument(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--deployment",
        type=Deployment,
        choices=tuple(Deployment),
        help="controller, or layer before programs that ask for things; else what a .rsup says, or controller",
    )


def _configuration_argument(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--config", metavar="FILE", type=Path, required=True, help="the configuration (YAML)")


def _model(file: Path, deployment: Deployment = Deployment.CONTROLLER) -> Model:
    """The checked model of a file."""
    if file.suffix != MODEL_SUFFIX:
        raise NoSupervisorError(f"{file}: not a model ({MODEL_SUFFIX})")
    try:
        checked = check(load_bundle(file))
    except LanguageError as error:
        raise NoSupervisorError("\n".join(map(str, error.diagnostics))) from error
    if checked.model is not None and checked.places is not None and deployment is Deployment.LAYER:
        ambiguous = layer_findings(checked.model, checked.places)
        if ambiguous:
            raise NoSupervisorError("\n".join(map(str, ambiguous)))
    if checked.model is None:
        raise NoSupervisorError("\n".join(map(str, checked.diagnostics)) or f"{file}: a library has no robot")
    return checked.model


def _check(arguments: argparse.Namespace) -> int:
    loaded = load(arguments.config)
    deployment = arguments.deployment or Deployment.CONTROLLER
    mapping = map_channels(_model(arguments.model, deployment), loaded.configuration, loaded.document)
    # The command `run` makes these checks, too, by `assemble`.
    check_settings(loaded.configuration, mapping, deployment)
    trusted_keys(loaded.configuration.supervisor.trusted_keys)
    sys.stdout.write(f"{arguments.config}: {len(mapping.communications)} communications are mapped\n")
    return OK


def _init(arguments: argparse.Namespace) -> int:
    text = init(
        arguments.robot,
        arguments.drive,
        arguments.scanner,
        _model(arguments.model),
        drive_port=arguments.drive_port or _usual_port(arguments.drive),
        scanner_port=arguments.scanner_port or _usual_port(arguments.scanner),
        has_udev_names=_has_udev_names(),
    )
    if arguments.output is None:
        sys.stdout.write(text)
    else:
        with arguments.output.open("x", encoding="utf-8") as stream:
            stream.write(text)
        sys.stdout.write(f"{arguments.output}\n")
    return OK


def _has_udev_names() -> bool:
    return any((folder / UDEV_RULES).is_file() for folder in UDEV_FOLDERS)


def _usual_port(driver: str) -> str | None:
    """Return the name by its id of the port that a device usually has; None: there is none, or a better one."""
    port = PORTS[driver]
    stable = stable_name(port)
    return None if _has_udev_names() or stable == port else stable


def _schema(arguments: argparse.Namespace) -> int:
    sys.stdout.write(json.dumps(schema(), indent=2) + "\n")
    return OK


def _drivers(arguments: argparse.Namespace) -> int:
    found = [(kind, info) for kind in Kind for info in available_drivers(kind)]
    if arguments.json:
        items = [{"kind": str(kind), **dataclasses.asdict(info)} for kind, info in found]
        sys.stdout.write(json.dumps(items, indent=2) + "\n")
    else:
        for kind, info in found:
            sys.stdout.write(f"{kind:14} {info.name:14} {info.description}\n")
    return OK


def _run(arguments: argparse.Namespace) -> int:
    for number in _SIGNALS:
        # Until there is something to bring to rest.
        signal.signal(number, lambda *_: sys.exit(OK))
    level = logging.DEBUG if arguments.verbose else logging.INFO
    logging.basicConfig(format="%(asctime)s %(levelname)s %(message)s", stream=sys.stderr, level=level)
    report = logging.getLogger("robosc_bridge").info
    loaded = load(arguments.config)
    configuration = loaded.configuration
    if arguments.view is not None:
        view = msgspec.structs.replace(configuration.view, address=arguments.view)
        configuration = msgspec.structs.replace(configuration, view=view)
    server = arguments.server or configuration.supervisor.server
    deployment = arguments.deployment or deployment_of(arguments.model)
    trusted = trusted_keys(configuration.supervisor.trusted_keys)
    credentials = credentials_of(configuration.supervisor)
    cache_path = None if server is None else cache_folder(arguments.keep, configuration.supervisor)
    source = Source(arguments.model, deployment, server, cache_path, trusted, credentials, arguments.allow_livelock)
    supervisor = obtain(source, report)
    mapping = map_channels(supervisor.model, configuration, loaded.document)
    log: EventLog = NullLog()
    if configuration.log.folder is not None:
        log = open_event_log(configuration.log.folder, supervisor.model.name, time.time())
    recorder = make_recorder(arguments, configuration, SYSTEM_HOST)
    host = SYSTEM_HOST if recorder is None else RecordingHost(SYSTEM_HOST, recorder)
    try:
        machine = assemble(
            configuration,
            mapping,
            supervisor,
            log,
            deployment,
            starts_itself=not arguments.standby,
            host=host,
            is_dry=arguments.dry,
        )
        endpoints = make_endpoints(configuration, machine.operations, safety_limits(configuration))
        for number in _SIGNALS:
            signal.signal(number, lambda *_: machine.quit())
        with Keyboard(lambda key: machine.daemon.post(Key(key))) as keyboard:
            if not keyboard.is_there:
                report("there is no terminal: no key stops the robot")
            have_ended = machine.run(endpoints)
    finally:
        if recorder is not None:
            recorder.close()
        log.close()
    return OK if have_ended and not machine.daemon.problem else FAULT


if __name__ == "__main__":
    sys.exit(main())
