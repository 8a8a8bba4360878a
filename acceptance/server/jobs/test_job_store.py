"""The database itself: opening, refusing, surviving."""

import asyncio
import time
from pathlib import Path

import pytest
from sqlalchemy import Connection

from robosc_server.store import open_store


@pytest.mark.real_time
async def test_the_event_loop_is_never_held_up(tmp_path: Path) -> None:
    store = open_store(tmp_path)

    def slow(connection: Connection) -> None:
        time.sleep(0.3)

    loop = asyncio.get_running_loop()
    writing = asyncio.gather(*(store._database.write(slow) for _ in range(2)))
    worst_s, last_s = 0.0, loop.time()
    while not writing.done():
        await asyncio.sleep(0.005)
        worst_s, last_s = max(worst_s, loop.time() - last_s), loop.time()
    await writing
    assert worst_s < 0.25
    store.close()
