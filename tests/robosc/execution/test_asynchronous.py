"""A controller in an event loop: calls and goals are coroutines, and time is moved by hand."""

import asyncio
import contextlib
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from robosc.execution.runtime.asynchronous import AsyncController, Feedback, GoalRejected
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.event_log import MemoryLog
from robosc.execution.runtime.runner import Status
from robosc.execution.runtime.settings import Settings
from support.execution import system_of

ROBOT = """
robot Walker {
    interface twist use Twist from geometry_msgs
    interface dock use Dock from docks
    interface ask use Ask from asks
    datatype object Vector { x: double }
    datatype object Twist { linear: Vector }
    component Base {
        incoming message walk with identifier: "/cmd_vel", type: Twist links twist
        outgoing message bump with identifier: "/bump", type: none
        behaviour {
            initial marked state free { on response from bump goto stuck }
            marked state stuck { }
        }
    }
    component Asker {
        service ask with request: integer, response: integer links ask
        behaviour {
            variable got: integer(0..9) = 0
            initial marked state asking { on response from ask do got := value goto done on error from ask goto failed }
            marked state done { }
            marked state failed { }
        }
    }
    component Docker {
        action dock with request: none, response: integer, feedback: integer links dock
        behaviour {
            variable far: integer(0..9) = 9
            initial marked state away {
                on feedback from dock do far := value
                on response from dock goto docked
                on error from dock goto lost
            }
            marked state docked { }
            marked state lost { }
        }
    }
    requirement walk needs Base.free and Docker.docked
    requirement ask needs Asker.asking
    requirement dock needs Docker.away and Base.free and Asker.done
    provide walk with { linear: { x: 0.5 } }
    provide ask with 7
}
"""


class Stage:
    """A robot whose coroutines do as a test says, a clock that stands still, and turns of the loop."""

    def __init__(self, settings: Settings | None = None) -> None:
        self.sent: list[Any] = []
        self.clock = ManualClock()
        self.log = MemoryLog()
        self.sleepers: list[tuple[float, asyncio.Future[None]]] = []
        self.reply: Callable[[Any], Awaitable[Any]] = self._echo
        self.work: Callable[[Feedback], Awaitable[Any]] = self._never
        self.controller = AsyncController(
            system_of(ROBOT), self, settings or Settings(policy="priority"), self.clock, self.log, self._sleep
        )
        self.system = self.controller.executor._system

    # The robot.

    def publish(self, message: str, data: Any) -> None:
        self.sent.append((message, data))

    def publish_default(self, identifier: str) -> None:
        self.sent.append(identifier)

    async def call(self, service: str, data: Any) -> Any:
        self.sent.append((service, data))
        return await self.reply(data)

    async def execute(self, action: str, data: Any, feedback: Feedback) -> Any:
        self.sent.append((action, data))
        return await self.work(feedback)

    @staticmethod
    async def _echo(data: Any) -> Any:
        return data

    @staticmethod
    async def _never(feedback: Feedback) -> Any:
        await asyncio.get_running_loop().create_future()

    # Time.

    async def _sleep(self, seconds: float) -> None:
        if seconds <= 0:
            return
        future: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.sleepers.append((self.clock.now_s + seconds, future))
        await future

    async def turns(self) -> None:
        """Let everybody do what can be done without time."""
        for _ in range(20):
            await asyncio.sleep(0)

    async def pass_(self, seconds: float) -> None:
        """Let time pass in small steps, and wake those who slept so long."""
        end_s = self.clock.now_s + seconds
        await self.turns()
        while self.clock.now_s < end_s - 1e-9:
            self.clock.advance(min(0.01, end_s - self.clock.now_s))
            for moment_s, future in self.sleepers:
                if moment_s <= self.clock.now_s + 1e-9 and not future.done():
                    future.set_result(None)
            self.sleepers = [(moment_s, future) for moment_s, future in self.sleepers if not future.done()]
            await self.turns()

    def state(self, component: str) -> Any:
        return self.system.state()[component]["state"]


def played(
    scene: Callable[[Stage, "asyncio.Task[None]"], Awaitable[None]],
    settings: Settings | None = None,
    reply: Callable[[Any], Awaitable[Any]] | None = None,
) -> Stage:
    """A scene in a loop of its own; whatever it leaves running is cancelled."""

    async def play() -> Stage:
        stage = Stage(settings)
        stage.reply = reply or stage.reply
        running = asyncio.create_task(stage.controller.run())
        await stage.turns()
        await asyncio.wait_for(scene(stage, running), 20.0)
        running.cancel()
        with contextlib.suppress(asyncio.CancelledError, RuntimeError):
            for _ in range(100):
                if running.done():
                    break
                await stage.pass_(0.1)
            await running
        others = asyncio.all_tasks() - {asyncio.current_task()}
        assert not others, "something was left running"
        return stage

    return asyncio.run(play())


def test_a_reply_is_what_the_coroutine_returns() -> None:
    async def scene(stage: Stage, running: Any) -> None:
        await stage.pass_(0.15)
        assert stage.state("Asker") == "done"
        assert stage.system.state()["Asker"]["variables"] == {"got": 7}

    assert played(scene).sent[0] == ("ask", 7)


def test_a_failed_call_is_an_error() -> None:
    async def refuse(data: Any) -> Any:
        raise ConnectionError("no route")

    async def scene(stage: Stage, running: Any) -> None:
        await stage.pass_(0.15)
        assert stage.state("Asker") == "failed"
        assert not running.done()

    stage = played(scene, reply=refuse)
    assert any("ConnectionError: no route" in str(entry) for entry in stage.log.entries)


def test_a_goal_gives_feedback_and_a_result_and_then_the_robot_walks() -> None:
    async def work(feedback: Feedback) -> int:
        feedback(4)
        return 1

    async def scene(stage: Stage, running: Any) -> None:
        stage.work = work
        await stage.pass_(0.35)
        assert stage.state("Docker") == "docked"
        assert stage.system.state()["Docker"]["variables"] == {"far": 4}
        stage.controller.receive("/bump", None)
        assert stage.state("Base") == "stuck"

    walking = ("walk", {"linear": {"x": 0.5}})
    sent = played(scene).sent
    assert sent[:3] == [("ask", 7), ("dock", None), walking]
    # Released as soon as it bumps, and once more at the end.
    assert [item for item in sent[3:] if item != walking] == ["/cmd_vel", "/cmd_vel"]


@pytest.mark.parametrize("error", [GoalRejected("busy"), RuntimeError("broken")])
def test_a_goal_that_fails_is_an_error(error: Exception) -> None:
    async def work(feedback: Feedback) -> int:
        raise error

    async def scene(stage: Stage, running: Any) -> None:
        stage.work = work
        await stage.pass_(0.25)
        assert stage.state("Docker") == "lost"

    played(scene)


def test_a_goal_that_turns_against_its_requirements_is_cancelled() -> None:
    ended: list[str] = []

    async def work(feedback: Feedback) -> int:
        try:
            await asyncio.get_running_loop().create_future()
        except asyncio.CancelledError:
            ended.append("cancelled")
            raise
        return 1

    async def scene(stage: Stage, running: Any) -> None:
        stage.work = work
        await stage.pass_(0.25)
        assert stage.sent[-1] == ("dock", None)
        stage.controller.receive("/bump", None)
        await stage.turns()
        assert ended == ["cancelled"]
        # Its own cancel is no error of the action; the goal has ended.
        assert stage.state("Docker") == "away"
        assert stage.system.location("dock") == "idle"

    played(scene)


def test_stop_ends_the_run_at_rest() -> None:
    async def scene(stage: Stage, running: Any) -> None:
        await stage.pass_(0.15)
        stage.controller.stop("enough")
        await stage.turns()
        assert running.done() and running.exception() is None
        assert stage.controller.executor.status is Status.STOPPED

    assert played(scene).sent[-1] == "/cmd_vel"


def test_a_goal_that_brakes_after_its_cancel_is_executing_until_it_stands() -> None:
    async def brakes(feedback: Feedback) -> None:
        with contextlib.suppress(asyncio.CancelledError):
            await asyncio.get_running_loop().create_future()
        await stage_of[0]._sleep(1.0)
        raise asyncio.CancelledError

    stage_of: list[Stage] = []

    async def scene(stage: Stage, running: Any) -> None:
        stage_of.append(stage)
        stage.work = brakes
        await stage.pass_(0.25)
        stage.controller.receive("/bump", None)
        await stage.pass_(0.5)
        assert stage.controller.executor.cancelling == ("dock",)
        assert stage.system.location("dock") == "executing"
        await stage.pass_(1.0)
        assert not stage.controller.executor.cancelling
        assert stage.system.location("dock") == "idle"

    played(scene)


def test_the_end_of_the_run_does_not_break_off_what_a_cancelled_goal_does() -> None:
    done: list[str] = []

    async def brakes(feedback: Feedback) -> None:
        with contextlib.suppress(asyncio.CancelledError):
            await asyncio.get_running_loop().create_future()
        await stage_of[0]._sleep(1.0)
        done.append("stands")

    stage_of: list[Stage] = []

    async def scene(stage: Stage, running: Any) -> None:
        stage_of.append(stage)
        stage.work = brakes
        await stage.pass_(0.25)
        stage.controller.stop("enough")
        # The run waits for half a second; the brakes take longer.
        await stage.pass_(0.75)
        assert running.done() and done == []
        await stage.pass_(0.5)
        assert done == ["stands"]

    played(scene)


def test_a_cancel_of_the_run_stops_the_robot() -> None:
    async def scene(stage: Stage, running: Any) -> None:
        await stage.pass_(0.25)  # The goal is under way.
        running.cancel()
        await stage.turns()
        assert running.cancelled()

    stage = played(scene)
    assert stage.sent[-2:] == [("dock", None), "/cmd_vel"]
    assert stage.controller.executor.reasons == ("cancelled",)


def test_a_goal_that_will_not_end_is_left_behind_after_its_time() -> None:
    async def stubborn(feedback: Feedback) -> None:
        future = asyncio.get_running_loop().create_future()
        with contextlib.suppress(asyncio.CancelledError):
            await future
        await asyncio.get_running_loop().create_future()

    async def scene(stage: Stage, running: Any) -> None:
        stage.work = stubborn
        await stage.pass_(0.25)
        stage.controller.stop("enough")
        await stage.pass_(0.4)
        assert not running.done()
        await stage.pass_(0.2)
        assert running.done()
        # The loop that it runs in ends it, as `asyncio.run` does: whether it brakes or hangs is not known here.
        (left,) = (task for task in asyncio.all_tasks() if "_execute" in repr(task))
        left.cancel()
        await stage.turns()

    played(scene)


def test_a_fault_is_raised_with_the_robot_at_rest() -> None:
    async def scene(stage: Stage, running: Any) -> None:
        stage.controller.stop("a wheel is off", is_fault=True)
        await stage.turns()
        assert running.done()
        assert "a wheel is off" in str(running.exception())

    assert played(scene).sent[-1] == "/cmd_vel"


def test_what_publishing_raises_is_a_fault() -> None:
    async def scene(stage: Stage, running: Any) -> None:
        def broken(message: str, data: Any) -> None:
            raise OSError("cable")

        async def work(feedback: Feedback) -> int:
            return 1

        stage.publish, stage.work = broken, work  # type: ignore[method-assign]
        await stage.pass_(0.5)
        assert running.done() and "cable" in str(running.exception())

    assert "/cmd_vel" in played(scene).sent


def test_a_call_that_takes_too_long_is_an_error_without_another_period() -> None:
    async def slow(data: Any) -> Any:
        await asyncio.get_running_loop().create_future()

    async def scene(stage: Stage, running: Any) -> None:
        await stage.pass_(0.3)
        assert stage.state("Asker") == "asking"
        await stage.pass_(0.3)
        assert stage.state("Asker") == "failed"

    played(scene, Settings(period_s=3600.0, service_timeout_s=0.5), slow)


def test_periods_do_not_drift() -> None:
    async def scene(stage: Stage, running: Any) -> None:
        await stage.pass_(1.05)

    stage = played(scene, Settings(period_s=0.1))
    # At 0, 0.1 and so on: the second decision asks for the goal.
    moments = [entry["time"] for entry in stage.log.entries if entry.get("event") == "dock.request"]
    assert moments == pytest.approx([0.1], abs=0.011)


def test_a_controller_runs_once() -> None:
    async def scene(stage: Stage, running: Any) -> None:
        with pytest.raises(RuntimeError, match="runs once"):
            await stage.controller.run()

    played(scene)


def test_what_comes_before_the_start_is_known_at_the_first_decision() -> None:
    async def play() -> Stage:
        stage = Stage()
        running = asyncio.create_task(stage.controller.run())
        # The task has not begun yet.
        stage.controller.receive("/bump", None)
        await stage.turns()
        assert stage.state("Base") == "stuck"
        running.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await running
        return stage

    stage = asyncio.run(play())
    assert next(entry["event"] for entry in stage.log.entries if entry["kind"] == "event") == "bump.response"


def test_a_stop_before_the_start_is_the_end() -> None:
    async def play() -> Stage:
        stage = Stage()
        stage.controller.stop("never mind")
        await stage.controller.run()
        return stage

    assert asyncio.run(play()).sent == ["/cmd_vel"]
