"""A whole server as a program that a test may kill: job_server.py FOLDER DATABASE_URL WORKERS.

WORKERS is `scripted` (see job_workers); or `local`, two real ones; or `fake`, two real ones whose tasks behave as their
text says (see fake_tasks). The database's URL may be empty. It prints its address.
"""

import asyncio
import contextlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from robosc_server.application import running_server
from robosc_server.operations.logs import configure_logging
from robosc_server.operations.settings import Settings
from robosc_server.workers.local import LocalWorkers
from support.fake_tasks import TASK_FUNCTION
from support.job_workers import StartedWorkers

_PREFIX = "listening on "


async def serve(folder: str, url: str, workers: str) -> None:
    chosen: dict[str, Any] = {"port": 0, "state_dir": Path(folder), "database_url": url or None}
    settings = Settings(**chosen, waiting_tasks_per_caller=1000)
    configure_logging(settings.log_format, settings.log_level)
    kinds: dict[str, Callable[[int], Any]] = {
        "scripted": StartedWorkers,
        "local": LocalWorkers,
        "fake": partial(LocalWorkers, task_function=TASK_FUNCTION),
    }
    made = kinds[workers](2)
    async with running_server(settings, made) as address:
        sys.stdout.write(f"{_PREFIX}{address}\n")
        sys.stdout.flush()
        await asyncio.Event().wait()


@contextmanager
def job_server(folder: Path, url: str = "", workers: str = "scripted") -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Such a program; yields the process and its address, and kills it at the end."""
    process = subprocess.Popen(
        [sys.executable, __file__, str(folder), url, workers],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith(_PREFIX), line
        yield process, line.removeprefix(_PREFIX).strip()
    finally:
        process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(serve(*sys.argv[1:]))
