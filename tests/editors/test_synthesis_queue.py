"""Syntheses beside an editor: one at a time, that of the text edited last first."""

import asyncio

from robosc_lsp.synthesis_queue import SynthesisQueue


async def settled() -> None:
    for _ in range(5):
        await asyncio.sleep(0)


async def test_one_at_a_time_and_the_text_edited_last_first() -> None:
    queue, had = SynthesisQueue(), list[str]()
    ends = {name: asyncio.Event() for name in "abcd"}

    async def synthesize(name: str) -> None:
        async with queue.slot(name):
            had.append(name)
            await ends[name].wait()

    for name in "abcd":
        queue.prefer(name)
    tasks = {name: asyncio.create_task(synthesize(name)) for name in "abcd"}
    await settled()
    assert had == ["a"]
    queue.prefer("c")
    queue.forget("d")
    ends["a"].set()
    await settled()
    assert had == ["a", "c"]
    # A cancelled task keeps no other one waiting, be it while it waits or while it runs.
    tasks["b"].cancel()
    await settled()
    assert had == ["a", "c"]
    tasks["c"].cancel()
    await settled()
    assert had == ["a", "c", "d"]
    ends["d"].set()
    await tasks["d"]
    await asyncio.create_task(synthesize("a"))
    assert had == ["a", "c", "d", "a"]


async def test_one_that_is_cancelled_as_it_is_its_turn_gives_it_on() -> None:
    queue, had = SynthesisQueue(), list[str]()

    async def synthesize(name: str) -> None:
        async with queue.slot(name):
            had.append(name)

    first = queue.slot("a")
    await first.__aenter__()
    tasks = [asyncio.create_task(synthesize(name)) for name in "bc"]
    await settled()
    queue.prefer("b")
    await first.__aexit__(None, None, None)
    tasks[0].cancel()
    await asyncio.wait(tasks)
    assert had == ["c"]
