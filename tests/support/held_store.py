"""A database that another process has, which a server in this one is not to have."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from support.waiting import PATIENCE_S

_HOLD = """
import sys
from pathlib import Path
from robosc_server.store import StoreError, open_store
try:
    store = open_store(Path(sys.argv[1]))
except StoreError as error:
    print(error, flush=True)
else:
    print("open", flush=True)
    sys.stdin.read()
"""


@contextmanager
def held_store(folder: Path) -> Iterator[str]:
    """A process that has opened the database of a folder, and is killed at the end; yields `open`, or why it cannot."""
    command = [sys.executable, "-c", _HOLD, str(folder)]
    holder = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert holder.stdout is not None
        yield holder.stdout.readline().strip()
    finally:
        holder.kill()
        holder.communicate(timeout=PATIENCE_S)
