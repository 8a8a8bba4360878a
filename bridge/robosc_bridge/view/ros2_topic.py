"""The source for a generated ROS 2 node: its topic `/state` (semantics 3.10), read by rclpy in a thread of its own.

Each message holds the state, the numbers of the transitions taken since the one before, and the robot's definition. It
tells neither which requests are enabled nor where services and actions are: with the model the first follows from the
state, as far as the second need not be known.
"""

import asyncio
import contextlib
import json
import os
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import count
from typing import Any

from robosc.supervisor import Supervisor
from robosc_bridge.daemon.states import Command
from robosc_bridge.view.definition import (
    DefinitionError,
    Robot,
    Shape,
    ShapeTransition,
    robot_of,
    shape_of,
    table_of,
    talks_of,
)
from robosc_bridge.view.facts import Happenings, SourceKind, Status
from robosc_bridge.view.sources import (
    RefusedError,
    Sink,
    SourceLostError,
    SourceWrongError,
    ViewError,
    Wish,
    not_replayed,
)

SILENCE_S = 5.0
"""After so long without a message the node is taken for gone."""

MAXIMUM_CHARACTERS = 8 * 2**20
"""Of one message."""

MAXIMUM_TRANSITIONS = 100_000
"""In one message."""

MAXIMUM_WAITING = 1000
"""Entries that wait to be handed on."""

_DEPTH = 10
_SPIN_S = 0.1
_CONTROLLABLE = frozenset({"request", "cancel", "reset"})
_numbers = count(1)


@dataclass(frozen=True, slots=True)
class _Heard:
    """A message.

    Attributes:
        robot: What it defines.
        status: What the node is doing.
    """

    robot: Robot
    status: Status


class StateReader:
    """Reads the texts of the topic; needs no ROS.

    Args:
        supervisor: Of the node, with its model; None: not known.
        scene: For the map.
    """

    def __init__(self, supervisor: Supervisor | None, scene: Any = None) -> None:
        self._supervisor = supervisor
        self._scene = scene
        self._definition: object = None
        self._robot: Robot | None = None
        self._steps: dict[int, _Step] = {}

    def read(self, text: str, time_s: float) -> tuple[Robot, Status, list[dict[str, Any]]]:
        """The robot, its state, and what happened since the message before.

        Args:
            text: Of a message.
            time_s: When it came, in seconds since 1970-01-01 UTC.

        Raises:
            DefinitionError: It makes no sense, or is of another model.
        """
        if len(text) > MAXIMUM_CHARACTERS:
            raise DefinitionError(f"a message on /state has more than {MAXIMUM_CHARACTERS} characters")
        try:
            document = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise DefinitionError("a message on /state is no JSON") from error
        if not isinstance(document, dict):
            raise DefinitionError("a message on /state is no JSON object")
        robot = self._defined(document.get("definition"))
        status = Status(time_s=time_s, components=_components(document.get("current")))
        return robot, status, list(self._entries(document.get("transitions"), time_s))

    def _defined(self, definition: object) -> Robot:
        # Each message has it; it is the same as long as the node lives.
        if self._robot is None or definition != self._definition:
            shape = shape_of(definition)
            self._robot = self._made(shape)
            self._definition = definition
            self._steps = _steps(self._robot)
        return self._robot

    def _made(self, shape: Shape) -> Robot:
        if self._supervisor is not None:
            made = robot_of(self._supervisor, SourceKind.ROS2, version="", can_command=False, scene=self._scene)
            if made.shape != shape:
                raise DefinitionError(f"the node on /state has another model than the one given ({made.shape.name})")
            return made
        return Robot(
            source=SourceKind.ROS2,
            version="",
            is_layer=False,
            shape=shape,
            talks=talks_of(shape),
            table=table_of(shape),
            supervisor=None,
            can_command=False,
            scene=self._scene,
        )

    def _entries(self, transitions: object, time_s: float) -> Iterator[dict[str, Any]]:
        if not isinstance(transitions, list) or len(transitions) > MAXIMUM_TRANSITIONS:
            raise DefinitionError("the transitions on /state are no list of numbers")
        taken: list[_Step] = []
        for number in transitions:
            step = self._steps.get(number) if isinstance(number, int) else None
            if step is None:
                continue
            if taken and not taken[-1].is_followed_by(step):
                yield _entry(taken, time_s)
                taken = []
            taken.append(step)
        if taken:
            yield _entry(taken, time_s)


@dataclass(frozen=True, slots=True)
class _Step:
    """A transition of the definition.

    Attributes:
        number: Its number.
        place: Of its component, in the model's order.
        event: Of it.
        is_silent: Whether it is one of its component alone.
        is_controllable: Whether the executor takes it by itself.
    """

    number: int
    place: int
    event: str
    is_silent: bool
    is_controllable: bool

    def is_followed_by(self, other: "_Step") -> bool:
        """Whether another one belongs to the same event: components are told in the model's order."""
        return not self.is_silent and other.event == self.event and other.place > self.place


def _steps(robot: Robot) -> dict[int, _Step]:
    # With the model the names of silent steps are known.
    names = {
        number: event for event, parts in robot.table.items() for states in parts.values() for number in states.values()
    }

    def step(place: int, component: str, item: ShapeTransition) -> _Step:
        event = names.get(item.id) or item.event or f"{component}.tau"
        return _Step(item.id, place, event, not item.event, not item.event or item.type in _CONTROLLABLE)

    return {
        item.id: step(place, component.name, item)
        for place, component in enumerate(robot.shape.components)
        if component.behaviour
        for state in component.behaviour.states
        for item in state.transitions
    }


def _entry(taken: list[_Step], time_s: float) -> dict[str, Any]:
    return {
        "time": time_s,
        "kind": "event",
        "event": taken[0].event,
        "controllable": taken[0].is_controllable,
        "transitions": [step.number for step in taken],
    }


def _components(current: object) -> Mapping[str, Mapping[str, Any]]:
    if not isinstance(current, dict):
        raise DefinitionError("there is no state on /state")
    for name, part in current.items():
        if not isinstance(part, dict) or not isinstance(part.get("state"), str):
            raise DefinitionError(f"the state of '{name[:100]}' on /state makes no sense")
        if not isinstance(part.get("variables"), dict):
            raise DefinitionError(f"the variables of '{name[:100]}' on /state make no sense")
    return current


@dataclass
class _News:
    """What the thread of rclpy has heard and the event loop has not taken yet."""

    latest: _Heard | None = None
    entries: list[dict[str, Any]] = field(default_factory=list)
    lost: int = 0
    failure: Exception | None = None


class StateTopic:
    """The topic of a node.

    Args:
        namespace: Before `/state`, such as `/robot1`; empty: none.
        supervisor: Of the node, with its model; None: not known.
        scene: For the map.
    """

    def __init__(self, namespace: str = "", supervisor: Supervisor | None = None, scene: Any = None) -> None:
        self._topic = f"/{namespace.strip('/')}/state" if namespace.strip("/") else "/state"
        self._supervisor = supervisor
        self._scene = scene

    async def run(self, sink: Sink) -> None:
        """Tell what the node tells, until cancelled.

        Raises:
            SourceLostError: Nothing is heard of it.
            SourceWrongError: There is no ROS 2, or what is heard makes no sense.
        """
        listener = _Listener(self._topic, StateReader(self._supervisor, self._scene), asyncio.get_running_loop())
        listener.start()
        known: Robot | None = None
        try:
            while True:
                news = await listener.news()
                if news.latest is not None and news.latest.robot is not known:
                    known = news.latest.robot
                    await sink.define(known)
                if news.entries or news.lost:
                    sink.happened(Happenings(news.entries, news.lost))
                if news.latest is not None:
                    sink.show(news.latest.status)
                if news.failure is not None:
                    raise news.failure
        finally:
            listener.close()

    async def order(self, command: Command, by: str) -> None:
        """Not here: a node hears its own topics alone.

        Raises:
            RefusedError: Always.
        """
        raise RefusedError("a ROS 2 node cannot be commanded from here")

    def steer(self, wish: Wish) -> None:
        """Not here: it is live.

        Raises:
            RefusedError: Always.
        """
        raise not_replayed()


class _Listener:
    """Spins a node of rclpy in a thread."""

    def __init__(self, topic: str, reader: StateReader, loop: asyncio.AbstractEventLoop) -> None:
        self._topic = topic
        self._reader = reader
        self._loop = loop
        self._wake = asyncio.Event()
        self._lock = threading.Lock()
        self._news = _News()
        self._is_over = False
        self._heard_s = 0.0
        self._thread = threading.Thread(target=self._run, name="live view hears", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Let the thread end, which it does soon."""
        self._is_over = True

    async def news(self) -> _News:
        """Wait for something that was heard, and take it."""
        await self._wake.wait()
        self._wake.clear()
        with self._lock:
            news, self._news = self._news, _News()
        return news

    def _run(self) -> None:
        try:
            self._listen()
            failure: Exception = SourceLostError(
                f"nothing has come on {self._topic} for {SILENCE_S:g} s: the node has ended, or publishes no state "
                "(its parameter publish_state)"
            )
        except ImportError as error:
            failure = SourceWrongError(f"there is no ROS 2 here: {error}")
        except (DefinitionError, ViewError) as error:
            failure = SourceWrongError(str(error))
        except Exception as error:
            failure = SourceLostError(f"ROS 2: {error}")
        if not self._is_over:
            self._tell(failure=failure)

    def _listen(self) -> None:
        """Until nothing has come for a while."""
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.qos import QoSProfile, ReliabilityPolicy
        from rclpy.signals import SignalHandlerOptions
        from std_msgs.msg import String

        context = rclpy.context.Context()
        # Without handlers of its own: signals are for whoever serves the page.
        rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
        try:
            node = rclpy.create_node(f"robosc_view_{os.getpid()}_{next(_numbers)}", context=context)
            profile = QoSProfile(depth=_DEPTH, reliability=ReliabilityPolicy.RELIABLE)
            node.create_subscription(String, self._topic, self._hear, profile)
            executor = SingleThreadedExecutor(context=context)
            executor.add_node(node)
            self._heard_s = time.monotonic()
            while not self._is_over and time.monotonic() - self._heard_s < SILENCE_S:
                executor.spin_once(timeout_sec=_SPIN_S)
            executor.shutdown()
            node.destroy_node()
        finally:
            rclpy.shutdown(context=context)

    def _hear(self, message: Any) -> None:
        self._heard_s = time.monotonic()
        robot, status, entries = self._reader.read(message.data, time.time())
        self._tell(_Heard(robot, status), entries)

    def _tell(
        self,
        latest: _Heard | None = None,
        entries: list[dict[str, Any]] | None = None,
        failure: Exception | None = None,
    ) -> None:
        with self._lock:
            news = self._news
            news.latest = latest or news.latest
            news.failure = failure
            news.entries += entries or []
            too_many = len(news.entries) - MAXIMUM_WAITING
            if too_many > 0:
                del news.entries[:too_many]
                news.lost += too_many
        with contextlib.suppress(RuntimeError):  # The server has ended.
            self._loop.call_soon_threadsafe(self._wake.set)
