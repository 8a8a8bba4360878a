"""Servers of the live view, in the event loop of a test or as processes."""

import contextlib
import os
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator

from robosc_api.security import Credentials
from robosc_bridge.daemon.view_settings import ViewSettings
from robosc_view.definition import Robot
from robosc_view.remote_bridge import RemoteBridge
from robosc_view.server import ViewServer
from robosc_view.sources import Source


@contextlib.asynccontextmanager
async def served(
    make: Callable[[], Source],
    *,
    is_shared: bool = True,
    robot: Robot | None = None,
    settings: ViewSettings | None = None,
) -> AsyncIterator[ViewServer]:
    """A server of a source, on a port of its own choice."""
    server = ViewServer(settings or ViewSettings("127.0.0.1:0"), make, is_shared=is_shared, robot=robot)
    await server.start()
    try:
        yield server
    finally:
        await server.stop()


@contextlib.asynccontextmanager
async def remotely_viewed(address: str) -> AsyncIterator[ViewServer]:
    """The live view of a bridge at an address."""
    async with served(lambda: RemoteBridge(address, Credentials())) as server:
        yield server


_START = """
import sys
from robosc.cli.arguments import Parser
from robosc_view import command
parser = Parser(prog="robosc")
command.add_parser(parser.add_subparsers())
arguments = parser.parse_args(["view", *sys.argv[1:]])
sys.exit(int(arguments.run(arguments)))
"""


@contextlib.contextmanager
def process_of_view(*words: object) -> Iterator[subprocess.Popen[str]]:
    """`robosc view` as a process, on a port of its own choice."""
    started = [sys.executable, "-c", _START, *map(str, words), "--address", "127.0.0.1:0"]
    pipe = subprocess.PIPE
    with subprocess.Popen(started, stdin=pipe, stdout=pipe, text=True, env=dict(os.environ)) as process:
        try:
            yield process
        finally:
            process.kill()


@contextlib.contextmanager
def view_process(*words: object) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start a process like `process_of_view`, and yield it with the address that it prints."""
    with process_of_view(*words) as process:
        assert process.stdout is not None
        yield process, process.stdout.readline().strip()
