"""The command `robosc-server`: serves until a signal, or runs another command."""

import asyncio
import gc
import logging
import os
import sys
from collections.abc import Sequence

# gRPC would log the same errors again; it reads this variable at its import.
os.environ.setdefault("GRPC_VERBOSITY", "NONE")

from robosc_server.operations.commands import run_command
from robosc_server.operations.descriptors import raise_descriptor_limit
from robosc_server.operations.logs import configure_logging
from robosc_server.operations.settings import Settings
from robosc_server.operations.settings_sources import load_settings
from robosc_server.operations.shutdown import ShutdownSignals
from robosc_server.workers.kernel import keep_memory_private

_COLLECT_EVERY = 20_000
"""Number of new Python objects between two runs of the cyclic garbage collector; of calls, some megabytes."""


def main(argv: Sequence[str] | None = None) -> int:
    """Serve until a signal, or run another command; returns the exit status."""
    words = sys.argv[1:] if argv is None else list(argv)
    status = run_command(words)
    if status is not None:
        return status
    settings = load_settings(words)
    configure_logging(settings.log_format, settings.log_level)
    keep_memory_private()
    raise_descriptor_limit()
    return _serve(settings)


def _serve(settings: Settings) -> int:
    """Serve until a signal; returns the exit status."""
    # Other commands do not need the application, which is slow to import.
    import uvloop

    from robosc_server.application import StartError, running_server

    shutdown = ShutdownSignals(settings.drain_seconds)

    async def serve_until_signal() -> None:
        shutdown.listen()
        async with running_server(settings) as address:
            _collect_less_often()
            _announce(address)
            await shutdown.requested()

    try:
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            runner.run(serve_until_signal())
    except StartError as error:
        sys.stderr.write(f"robosc-server: {error}\n")
        return 1
    finally:
        shutdown.finished()
    return 0


def _collect_less_often() -> None:
    """Have the cyclic garbage collector run less often, and leave out what lives as long as the server.

    A call leaves few objects in cycles, and most of what a run looks at are modules.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(_COLLECT_EVERY, *gc.get_threshold()[1:])


def _announce(address: str) -> None:
    """Print the address, to a person with the way to more; the server runs even if standard output cannot be written.

    Programs that start a server read the address at the end of the line.
    """
    more = "; 'robosc-server --help' lists its settings and commands, Ctrl-C stops it" if sys.stdout.isatty() else ""
    try:
        sys.stdout.write(f"robosc-server listening on {address}{more}\n")
        sys.stdout.flush()
    except OSError as error:
        logging.getLogger(__name__).warning(
            "listening on %s; the address cannot be written to standard output: %s", address, error
        )
        # The interpreter would try again at its exit.
        sys.stdout = None


if __name__ == "__main__":
    sys.exit(main())
