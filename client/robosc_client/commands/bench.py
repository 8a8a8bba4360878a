"""The command `bench`, which measures the rate and duration of calls."""

import argparse
import asyncio
import secrets
import sys
from collections.abc import Callable
from typing import Any

from msgspec.structs import replace

from robosc.cli.arguments import add_model_arguments, read_bundle
from robosc.cli.output import ExitCode, UsageError, print_json
from robosc.source import Bundle, SourceFile
from robosc_api.security import SecurityError
from robosc_client import Check, Synthesize, Task
from robosc_client.commands.connection import add_connection_arguments, exit_statuses, number_up_to, seconds, target_of
from robosc_client.commands.progress_line import ProgressLine
from robosc_client.commands.tasks import add_synthesis_arguments, synthesis_options
from robosc_client.convert.requests import request_of
from robosc_client.load_measurement import MAXIMUM_CONCURRENCY, Load, Measured, measure

_DESCRIPTION = """\
Send the same request repeatedly, and print the rate of answered calls and their duration. Each of the concurrent
callers has one open call at any time. The server answers repeated requests from its cache; with --uncached, a comment
in the model makes every request different. An interrupt prints the measurements so far.
"""

_EPILOG = exit_statuses("every call was answered", "the model file is not a text file", "a call was not answered")

_RUN = secrets.token_hex(8)
"""Identifier of this process, so that the requests of two processes differ."""

_METHODS = {
    "check": ("/robosc_api.v1.SynthesisService/Check", False),
    "synth": ("/robosc_api.v1.SynthesisService/Synthesize", True),
}


def add_parsers(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser("bench", help="measure the rate and duration of calls", description=_DESCRIPTION)
    add_model_arguments(parser)
    parser.add_argument("--task", choices=list(_METHODS), default="check", help="call to make (default: %(default)s)")
    parser.add_argument(
        "-c",
        "--concurrency",
        type=number_up_to(MAXIMUM_CONCURRENCY),
        default=8,
        metavar="N",
        help="number of concurrent callers (default: %(default)s)",
    )
    amount = parser.add_mutually_exclusive_group()
    amount.add_argument("-n", "--count", type=number_up_to(10**9), metavar="N", help="total number of calls")
    amount.add_argument(
        "-d",
        "--duration",
        type=seconds,
        default=10.0,
        metavar="SECONDS",
        help="duration of the measurement (default: %(default)g)",
    )
    parser.add_argument(
        "--connections",
        type=number_up_to(MAXIMUM_CONCURRENCY),
        default=1,
        metavar="N",
        help="number of connections (default: %(default)s)",
    )
    parser.add_argument("--uncached", action="store_true", help="make every request different")
    add_synthesis_arguments(parser)
    add_connection_arguments(parser, epilog=_EPILOG)
    parser.set_defaults(run_alone=_bench)


def _bench(arguments: argparse.Namespace) -> int:
    bundle = read_bundle(arguments)
    method, is_stream = _METHODS[arguments.task]
    load = Load(
        method=method,
        is_stream=is_stream,
        request=_requests(arguments, bundle),
        concurrency=arguments.concurrency,
        count=arguments.count,
        duration_s=None if arguments.count else arguments.duration,
        channels=min(arguments.connections, arguments.concurrency),
        timeout_s=arguments.deadline or 60.0,
    )
    address, credentials = target_of(arguments)
    try:
        with ProgressLine() as line:
            line.show(f"{arguments.concurrency} callers at {address}")
            measured = asyncio.run(measure(address, credentials, load))
    except SecurityError as error:
        raise UsageError(str(error)) from error
    _report(arguments, measured)
    if measured.is_interrupted:
        sys.stderr.write("robosc-client: interrupted\n")
        return ExitCode.INTERRUPTED
    return ExitCode.SERVICE if measured.errors else ExitCode.OK


def _requests(arguments: argparse.Namespace, bundle: Bundle) -> Callable[[int], bytes]:
    """Serialized requests: always the same, or each with another comment at the end of its model.

    Raises:
        RequestRefusedError: They cannot be sent.
    """

    def content(chosen: Bundle) -> bytes:
        task: Task = Check(chosen)
        if arguments.task == "synth":
            task = Synthesize(chosen, synthesis_options(arguments))
        return request_of(task).SerializeToString()

    # Invalid requests are reported before the measurement; the comment has no influence on that.
    same = content(bundle)
    if not arguments.uncached:
        return lambda number: same
    return lambda number: content(varied(bundle, number))


def varied(bundle: Bundle, number: int) -> Bundle:
    """Return the same model with a unique comment."""
    text = f"{bundle.main.text}\n// {_RUN} {number}\n"
    return replace(bundle, main=SourceFile(bundle.main.name, text))


def _report(arguments: argparse.Namespace, measured: Measured) -> None:
    document: dict[str, Any] = {
        "task": arguments.task,
        "cached": not arguments.uncached,
        "concurrency": arguments.concurrency,
        **measured.document(),
    }
    if arguments.json:
        print_json(document)
        return
    times = ", ".join(f"{name} {value}" for name, value in document["milliseconds"].items())
    sys.stdout.write(
        f"{document['calls']} calls in {document['seconds']} s: {document['calls_per_second']} a second\n"
        f"milliseconds: {times}\n"
    )
    for reason, number in document["errors"].items():
        sys.stdout.write(f"errors: {number} {reason}\n")
