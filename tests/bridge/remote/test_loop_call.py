"""Tests of calls in an event loop that other threads ask for."""

import asyncio

from robosc_bridge.remote.loop_call import LoopCall


def test_asked_for_twice_before_it_begins_there_is_one_call() -> None:
    async def run() -> list[int]:
        calls: list[int] = []
        call = LoopCall(lambda: calls.append(1))
        call.ask()
        call.ask()
        assert not calls
        await asyncio.sleep(0)
        return calls

    assert asyncio.run(run()) == [1]


def test_what_is_asked_for_during_a_call_is_another_call() -> None:
    async def run() -> int:
        count = 0

        def function() -> None:
            nonlocal count
            count += 1
            if count == 1:
                call.ask()

        call = LoopCall(function)
        call.ask()
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        return count

    assert asyncio.run(run()) == 2


def test_nothing_is_called_any_more_in_a_loop_that_has_ended() -> None:
    async def make() -> LoopCall:
        return LoopCall(lambda: None)

    asyncio.run(make()).ask()
