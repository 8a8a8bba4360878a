"""The source for a bridge in another process, over its gRPC service; each stream is read in a thread of its own."""

import asyncio
import contextlib
import json
import logging
import threading
from collections.abc import Callable, Coroutine
from typing import Any

from google.protobuf.json_format import MessageToDict

from robosc.errors import RoboscError
from robosc.execution.runtime.progress import MissionStanding, Progress, Standing
from robosc.supervisor import Supervisor, decode
from robosc_api.security import Credentials
from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.terminal.client import (
    BridgeClient,
    DriveState,
    RequestedCommand,
    Snapshot,
    StrategyProgress,
    UnreachableError,
    WatchResponse,
    events_of,
    state_name,
)
from robosc_bridge.terminal.client import RefusedError as ClientRefusedError
from robosc_view.definition import DefinitionError, Robot, robot_of, shape_of
from robosc_view.reports import CommunicationInfo, Drive, EventBatch, LaserScan, Notice, SourceKind, Status
from robosc_view.sources import (
    RefusedError,
    ReplayCommand,
    Sink,
    SourceLostError,
    SourceWrongError,
    not_replayed,
)

_log = logging.getLogger(__name__)

RATE_HZ = 25.0
"""Most responses of the bridge a second; its inverse is the greatest age of what is shown."""

FOLLOW_S = 0.5
"""A stop that was not answered for so long is followed by the next one; before, they would only crowd the way."""

_KINDS = {1: "incoming message", 2: "outgoing message", 3: "service", 4: "action"}


class RemoteBridge:
    """A bridge at an address.

    Args:
        address: `HOST:PORT` of its service.
        credentials: Certificates and token.
        scene: Scene for the map.
    """

    def __init__(self, address: str, credentials: Credentials, scene: Any = None) -> None:
        self._address = address
        self._credentials = credentials
        self._scene = scene
        self._defining: asyncio.Task[Robot] | None = None
        self._stop_sent: asyncio.Task[None] | None = None
        self._stop_to_send: asyncio.Task[None] | None = None

    async def run(self, sink: Sink) -> None:
        """Pass on the responses of the bridge to the sink, until cancelled.

        Raises:
            SourceLostError: The bridge cannot be reached any more.
            SourceWrongError: The bridge refuses, or the address is that of another program.
        """
        if self._defining is None or self._defining.done():
            self._defining = _background_task(self._asked(lambda client: robot_from(client.definition(), self._scene)))
        # Those who come and go while a bridge does not answer ask it once.
        await sink.define(await asyncio.shield(self._defining))
        watch = _Watch(self._address, self._credentials, asyncio.get_running_loop())
        watch.start()
        try:
            while True:
                response = await watch.next()
                _pass_on(response, sink)
                watch.go_on()
        finally:
            watch.close()

    async def order(self, command: OperatorCommand, by: str) -> None:
        """Give a command to the bridge, and return when it is done.

        Raises:
            RefusedError: The bridge refuses the command.
        """
        try:
            if command is OperatorCommand.STOP:
                # The command is sent, whether or not its answer is awaited.
                await asyncio.shield(self._stop())
            else:
                await self._asked(lambda client: client.request(RequestedCommand(str(command))))
        except (SourceLostError, SourceWrongError) as error:
            raise RefusedError(str(error)) from error

    def control_replay(self, command: ReplayCommand) -> None:
        """Refuse to control a replay: the source is live.

        Raises:
            RefusedError: Always.
        """
        raise not_replayed()

    def _stop(self) -> asyncio.Task[None]:
        """A stop that is sent from now on: one that waits to be sent serves all who want it meanwhile."""
        if self._stop_to_send is None:
            before = self._stop_sent
            if before is None or before.done():
                self._stop_sent = _background_task(self._asked(BridgeClient.stop))
                return self._stop_sent
            self._stop_to_send = _background_task(self._stop_after(before))
        return self._stop_to_send

    async def _stop_after(self, before: asyncio.Task[None]) -> None:
        await asyncio.wait([before], timeout=FOLLOW_S)
        self._stop_sent, self._stop_to_send = self._stop_to_send, None
        await self._asked(BridgeClient.stop)

    async def _asked[Found](self, ask: Callable[[BridgeClient], Found]) -> Found:
        """Ask over a connection of its own: one that hangs must not hold up a stop."""

        def asked() -> Found:
            with BridgeClient(self._address, self._credentials) as client:
                return ask(client)

        loop = asyncio.get_running_loop()
        future: asyncio.Future[Found] = loop.create_future()

        def work() -> None:
            found: Any = None
            try:
                found = asked()
            except Exception as error:
                _settle(loop, future, error=_translated(error))
            else:
                _settle(loop, future, found)

        # A thread of its own: those of a pool may all be waiting for a bridge that does not answer.
        threading.Thread(target=work, name="live view asks", daemon=True).start()
        return await future


def _background_task[Found](work: Coroutine[Any, Any, Found]) -> asyncio.Task[Found]:
    """Work that is begun now and goes on even if its result is not awaited."""
    task = asyncio.Task(work, loop=asyncio.get_running_loop(), eager_start=True)
    task.add_done_callback(lambda done: done.cancelled() or done.exception())
    return task


def _settle(loop: asyncio.AbstractEventLoop, future: Any, found: Any = None, error: Exception | None = None) -> None:
    def settle() -> None:
        if future.done():
            return
        if error is None:
            future.set_result(found)
        else:
            future.set_exception(error)

    with contextlib.suppress(RuntimeError):  # The server has ended.
        loop.call_soon_threadsafe(settle)


def _translated(error: Exception) -> Exception:
    match error:
        case UnreachableError():
            return SourceLostError(str(error))
        case ClientRefusedError() | DefinitionError():
            return SourceWrongError(str(error))
        case _:
            return error


class _Watch:
    """A stream of the bridge: one response is read after the one before was passed on, so that nothing piles up."""

    def __init__(self, address: str, credentials: Credentials, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._next: asyncio.Future[WatchResponse] = loop.create_future()
        self._go = threading.Semaphore(1)
        self._is_over = False
        self._client = BridgeClient(address, credentials)
        self._thread = threading.Thread(target=self._run, name="live view watches", daemon=True)

    def start(self) -> None:
        self._thread.start()

    async def next(self) -> WatchResponse:
        """Return the next response; raises the error that ended the stream."""
        response = await self._next
        self._next = self._loop.create_future()
        return response

    def go_on(self) -> None:
        """Let the thread read on, since the response was passed on."""
        self._go.release()

    def close(self) -> None:
        """End the stream; its thread ends soon."""
        self._is_over = True
        self._go.release()
        # Ends what the thread waits for.
        self._client.close()
        if self._next.done() and not self._next.cancelled():
            self._next.exception()  # Its result is awaited no more.

    def _run(self) -> None:
        why: Exception = SourceLostError("the bridge has ended the stream")
        try:
            for response in self._client.watch(with_scans=True, rate_hz=RATE_HZ):
                self._go.acquire()
                if self._is_over:
                    return
                _settle(self._loop, self._next, response)
        except Exception as error:
            why = _translated(error)
        # The cause of its end is reported last, after the response before it was taken.
        self._go.acquire()
        if not self._is_over:
            _settle(self._loop, self._next, error=why)


def _pass_on(response: WatchResponse, sink: Sink) -> None:
    if response.events or response.lost_events:
        sink.append_events(EventBatch(events_of(response), response.lost_events))
    if response.HasField("snapshot"):
        sink.show(status_of(response.snapshot))
    if response.HasField("scan"):
        pose = response.snapshot.drive.pose if response.snapshot.HasField("drive") else None
        place = None if pose is None else (pose.x_m, pose.y_m, pose.heading_rad)
        sink.show_scan(LaserScan(list(response.scan.ranges_m), place))


def robot_from(answer: Any, scene: Any = None) -> Robot:
    """Return the robot that a bridge defines.

    Raises:
        DefinitionError: The definition is invalid.
    """
    supervisor = _supervisor(answer)
    channels = {item.name: item.channel for item in answer.communications}
    if supervisor is not None:
        return robot_of(
            supervisor, SourceKind.BRIDGE, version=answer.version, channels=channels, can_command=True, scene=scene
        )
    try:
        shape = shape_of(json.loads(answer.definition))
    except (ValueError, RecursionError) as error:
        raise DefinitionError(f"the robot's definition is malformed: {str(error)[:300]}") from error
    table: dict[str, dict[str, dict[str, int]]] = {}
    for item in answer.transitions:
        table.setdefault(item.event, {}).setdefault(item.component, {})[item.state] = item.id
    return Robot(
        source=SourceKind.BRIDGE,
        version=answer.version,
        is_layer=answer.is_layer,
        shape=shape,
        communications=tuple(
            CommunicationInfo(item.name, item.component, _KINDS.get(item.kind, ""), item.identifier, item.channel)
            for item in answer.communications
        ),
        table=table,
        supervisor=None,
        can_command=True,
        scene=scene,
    )


def _supervisor(answer: Any) -> Supervisor | None:
    try:
        return decode(answer.supervisor) if answer.supervisor else None
    except RoboscError as error:
        # A later bridge may have another format: all but the reasons is shown.
        _log.warning("the bridge's supervisor cannot be read, so that reasons are not known: %s", error)
        return None


def status_of(snapshot: Snapshot) -> Status:
    """Return the status in a snapshot of the bridge."""
    components = {
        item.name: {"state": item.state, "variables": MessageToDict(item.variables)} for item in snapshot.components
    }
    return Status(
        time_s=snapshot.time.ToNanoseconds() / 1e9,
        state=state_name(snapshot),
        problem=snapshot.problem,
        reasons=[_notice(item) for item in snapshot.reasons],
        warnings=[_notice(item) for item in snapshot.warnings],
        stops=list(snapshot.stops),
        devices={item.name: item.works for item in snapshot.devices},
        components=components,
        communications={item.name: item.location for item in snapshot.communications},
        enabled=list(snapshot.enabled),
        drive=_drive(snapshot.drive) if snapshot.HasField("drive") else None,
        age_s=snapshot.age_s,
        latencies=[
            (item.name, item.p50_s * 1e3, item.p99_s * 1e3, item.max_s * 1e3)
            for item in snapshot.latencies
            if item.count
        ],
        progress=_progress(snapshot.progress) if snapshot.HasField("progress") else None,
        cancelling=list(snapshot.cancelling),
    )


def _progress(progress: StrategyProgress) -> Progress:
    return Progress(
        aims=tuple(map(_standing, progress.aims)),
        assumptions=tuple(map(_standing, progress.assumptions)),
        overdue=tuple(progress.overdue),
        is_followed=progress.is_followed,
        approached=progress.approached or None,
        chosen=progress.chosen or None,
        missions=tuple(
            MissionStanding(item.name, item.visit, item.is_round, item.rounds, tuple(item.detours))
            for item in progress.missions
        ),
    )


def _standing(item: Any) -> Standing:
    unmet_s = item.unmet_s if item.HasField("unmet_s") else None
    return Standing(item.name, item.words, item.is_met, item.times, unmet_s, item.mission or None)


def _drive(drive: DriveState) -> Drive:
    return Drive(
        (drive.pose.x_m, drive.pose.y_m, drive.pose.heading_rad),
        drive.velocity.linear_m_s,
        drive.velocity.angular_rad_s,
        drive.battery_v if drive.HasField("battery_v") else None,
        drive.is_torque_on,
    )


def _notice(item: Any) -> Notice:
    return Notice(item.code, item.text, item.holds_until_reset)
