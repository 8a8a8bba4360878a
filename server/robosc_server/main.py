"""`robosc-server`: start, tell where, stop gracefully; other commands beside."""

import asyncio
import os
import signal
import sys
from collections.abc import Sequence

# gRPC's own log would tell once more, in its words, what we tell; it is read at its import.
os.environ.setdefault("GRPC_VERBOSITY", "NONE")

from robosc_server.operations.commands import run_command
from robosc_server.operations.logs import set_up_logs
from robosc_server.operations.settings import Settings, load_settings


def main(argv: Sequence[str] | None = None) -> int:
    """Serve until a signal, or run another command; returns the exit status."""
    words = sys.argv[1:] if argv is None else list(argv)
    status = run_command(words)
    if status is not None:
        return status
    settings = load_settings(words)
    set_up_logs(settings.log_format, settings.log_level)
    return _serve(settings)


def _serve(settings: Settings) -> int:
    """Serve until a signal; returns the exit status."""
    # Other commands, such as the health check of a container, need nothing of it, and it takes a while to import.
    from robosc_server.application import StartError, running_server

    async def serve_until_signal() -> None:
        stop = asyncio.Event()
        loop = asyncio.get_running_loop()
        for number in (signal.SIGTERM, signal.SIGINT):
            loop.add_signal_handler(number, stop.set)
        async with running_server(settings) as address:
            sys.stdout.write(f"robosc-server listening on {address}\n")
            sys.stdout.flush()
            await stop.wait()

    try:
        asyncio.run(serve_until_signal())
    except StartError as error:
        sys.stderr.write(f"robosc-server: {error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
