"""Workers of a Dask cluster: its scheduler distributes tasks, and processes next to its workers run them.

The package `distributed` is imported only if it is needed.
"""

import asyncio
import contextlib
import logging
import uuid
from collections import deque
from concurrent.futures import CancelledError as FutureCancelledError
from typing import Any, Self

from robosc import __version__
from robosc_server.clock import monotonic
from robosc_server.tasks.exceeded import time_exceeded
from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Task, TaskLimits
from robosc_server.workers import OnCpuTime, OnReport, WorkerLostError, WorkersError, ignore_cpu_time
from robosc_server.workers.dask_cpu_time import CpuTimeAccount
from robosc_server.workers.frames import FrameError
from robosc_server.workers.local import TASK_FUNCTION

_LOG = logging.getLogger(__name__)

CONNECT_S = 5.0
"""Time limit of one attempt to connect to the scheduler, in seconds."""

POLL_S = 0.5
"""Period at which the workers of the cluster are listed, in seconds."""

_TLS = "tls://"
_ATTEMPTS = 2
"""Number of times that a task may start."""

_STARTS = 3
"""Number of times that a task is submitted: workers may be lost before they start it."""

_GRACE_S = 30.0
_CANCEL_S = 1.0
_END_S = 5.0
_CLOSE_POLL_S = 0.01
_CPU_REPORT_S = 10.0
_CHECK_S = 3.0
_KEPT_REPORTS = 64
_LOST = "two workers of the cluster were lost during this task"


class _TaskEvents:
    """Events of one running task from the cluster."""

    def __init__(self) -> None:
        self.begun = 0
        self.begun_at = 0.0
        self._reports: deque[Report] = deque(maxlen=_KEPT_REPORTS)
        self._news = asyncio.Event()

    def add(self, event: dict[str, Any]) -> None:
        """Add an event of the cluster."""
        if event["is"] == "begun":
            self.begun += 1
            self.begun_at = monotonic()
        elif event["is"] == "reports":
            self._reports.extend(Report(str(stage), str(message)) for stage, message in event["reports"])
        self._news.set()

    async def forward_reports(self, on_report: OnReport) -> Failure:
        """Forward progress reports, only the newest ones to a slow receiver; return after too many lost workers."""
        while self.begun <= _ATTEMPTS:
            await self._news.wait()
            self._news.clear()
            while self._reports:
                await on_report(self._reports.popleft())
        return Failure(Reason.WORKER_DIED, _LOST)


class DaskWorkers:
    """The workers of a cluster; an asynchronous context, also while the cluster is unavailable.

    Attributes:
        fault: Reason why no task can run, in one sentence; empty if tasks can run.
    """

    def __init__(self, address: str, task_function: str = TASK_FUNCTION, *, must_be_confined: bool = False) -> None:
        """Prepare the workers, without starting them.

        Args:
            address: Address of the scheduler, such as `tcp://HOST:PORT` or `tls://HOST:PORT`.
            task_function: Function that runs tasks there, `package.module:name`.
            must_be_confined: True to run no task on a machine without complete confinement.

        Raises:
            WorkersError: The package `distributed` is missing, or cannot be loaded here; or there is to be TLS, and
                Dask's settings do not say with which certificates.
        """
        try:
            import distributed
        except ImportError as error:
            raise WorkersError(
                "workers on a Dask cluster need the package distributed: pip install 'robosc[dask]'"
            ) from error
        except OSError as error:  # The package reads /proc, which a sandbox may hide.
            raise WorkersError(
                f"workers on a Dask cluster need the package distributed, which cannot be loaded here: {error}"
            ) from error
        self._distributed = distributed
        self._address = address
        if address.startswith(_TLS):
            from robosc_server.workers.dask_tls import client_context

            client_context()
        self._task_function = task_function
        self._must_be_confined = must_be_confined
        self._client: Any = None
        self._threads: dict[str, int] = {}
        self._refused: dict[str, str] = {}
        self._events: dict[str, _TaskEvents] = {}
        self._cpu_accounts: dict[str, CpuTimeAccount] = {}
        self._connection_task: asyncio.Task[None] | None = None
        self._first_poll_done = asyncio.Event()
        self._is_closing = asyncio.Event()
        self.fault = f"the Dask scheduler at {address} has not been reached yet"

    async def __aenter__(self) -> Self:
        self._connection_task = asyncio.create_task(self._keep_connected())
        await self._first_poll_done.wait()
        if self.fault:
            _LOG.error("%s; retrying", self.fault)
        return self

    async def __aexit__(self, *_: object) -> None:
        if self._connection_task is not None:
            self._connection_task.cancel()
            await asyncio.gather(self._connection_task, return_exceptions=True)
        self.fault = "the workers are shut down"
        # End the waits for tasks while the event loop is still running.
        self._is_closing.set()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_END_S):
                while self._events:
                    await asyncio.sleep(_CLOSE_POLL_S)
        for name in tuple(self._cpu_accounts):
            self._close_account(name)

    @property
    def capacity(self) -> int:
        """Number of threads of all usable workers of the cluster; 0 while it is unavailable."""
        return sum(self._threads.values())

    async def run(
        self, task: Task, limits: TaskLimits, on_report: OnReport, on_cpu_time: OnCpuTime = ignore_cpu_time
    ) -> Outcome:
        """Return the outcome of a task; see `Workers.run`.

        The task of a lost worker is run again by another worker, once. Reports come at most ten times a second, and of
        many at once only the last.

        Raises:
            WorkersError: The cluster is unavailable or was lost, has no usable worker, or loses its workers before they
                start the task.
            WorkerLostError: The fork server of a worker ended during the task, more than once.
        """
        events = _TaskEvents()
        for _ in range(_STARTS):
            outcome = await self._run_once(task, limits, on_report, on_cpu_time, events)
            if outcome is not None:
                return outcome
            if events.begun >= _ATTEMPTS:
                return Failure(Reason.WORKER_DIED, _LOST)
        # The task never started, so it cannot be the cause.
        raise WorkersError(f"the Dask cluster at {self._address} loses its workers before they start a task")

    async def _run_once(
        self, task: Task, limits: TaskLimits, on_report: OnReport, on_cpu_time: OnCpuTime, events: _TaskEvents
    ) -> Outcome | None:
        """Return the outcome of a task; None: workers were lost, and it has to be begun anew."""
        from robosc_server.workers.dask_task import run_on_cluster

        client = self._client
        if client is None or not self._threads:
            raise WorkersError(self.fault or f"the Dask cluster at {self._address} has no worker")
        name = f"robosc-{task.kind}-{uuid.uuid4().hex}"
        self._events[name] = events
        self._cpu_accounts[name] = CpuTimeAccount(on_cpu_time, monotonic)
        allowed = sorted(self._threads) if self._refused else None
        future = client.submit(
            run_on_cluster,
            __version__,
            self._task_function,
            self._must_be_confined,
            _topic(client),
            str(task.kind),
            task.request,
            (task.key, task.main_file),
            (limits.seconds, limits.cpu_seconds, limits.memory_bytes, limits.nodes, limits.result_bytes),
            key=name,
            pure=False,
            workers=allowed,
        )
        works = (
            asyncio.create_task(self._answer(future, limits)),
            asyncio.create_task(events.forward_reports(on_report)),
            asyncio.create_task(self._watch_for_loss(client, events, limits, allowed)),
        )
        try:
            done, _ = await asyncio.wait(works, return_when=asyncio.FIRST_COMPLETED)
            # Prefer the answer, if there is one.
            return next(work for work in works if work in done).result()
        finally:
            del self._events[name]
            self._cpu_accounts[name].stop()
            # The CPU time of the last process is reported shortly after this, when it has ended.
            asyncio.get_running_loop().call_later(_CPU_REPORT_S, self._close_account, name)
            for work in works:
                work.cancel()
            with contextlib.suppress(Exception):
                async with asyncio.timeout(_CANCEL_S):
                    if future.done():
                        future.release()
                    else:  # A cancelled future stops its worker.
                        await future.cancel()
                    await asyncio.gather(*works, return_exceptions=True)

    async def _answer(self, future: Any, limits: TaskLimits) -> Outcome | None:
        """Return the answer of the cluster; None: it gave up."""
        from robosc_server.workers.dask_task import ANSWER, LOST, NO_WORKER, outcome_of

        try:
            content = await future.result()
        except FutureCancelledError as error:
            raise WorkersError(f"the Dask scheduler at {self._address} was lost") from error
        except self._distributed.KilledWorker:
            return None
        except Exception as error:  # Any error of the worker, or of the transfer.
            cause = f"{type(error).__name__}: {error}"
            raise WorkersError(f"the Dask cluster at {self._address} cannot run tasks: {cause[:1000]}") from error
        if isinstance(content, bytes) and content[:1] == ANSWER:
            try:
                return outcome_of(content[1:], limits)
            except FrameError as error:
                return Failure(Reason.WORKER_DIED, "the worker process sent an invalid answer", str(error))
        if isinstance(content, bytes) and content[:1] in (NO_WORKER, LOST):
            kind = WorkerLostError if content[:1] == LOST else WorkersError
            raise kind(content[1:1000].decode("utf-8", "replace"))
        raise WorkersError(f"the Dask cluster at {self._address} sent an answer that RoboSC does not know")

    async def _watch_for_loss(
        self, client: Any, events: _TaskEvents, limits: TaskLimits, allowed: list[str] | None
    ) -> Failure | None:
        """End the wait for a task that cannot complete.

        Args:
            client: Client of the cluster that has the task.
            events: Reports of the cluster on the task.
            limits: Limits of the task.
            allowed: The workers that alone may do it; None: any.

        Returns:
            Failure of the task; None: all allowed workers are lost and others are available, but the scheduler would
            still wait for the lost ones.

        Raises:
            WorkersError: The cluster is lost, or has had no worker for a while.
        """
        last_worker_at = monotonic()
        while True:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(POLL_S):
                    await self._is_closing.wait()
            now = monotonic()
            if self._client is not client:
                raise WorkersError(f"the Dask scheduler at {self._address} was lost")
            if self._threads:
                last_worker_at = now
                if allowed is not None and self._threads.keys().isdisjoint(allowed):
                    return None
            if now - last_worker_at > _GRACE_S:
                raise WorkersError(self.fault or f"the Dask cluster at {self._address} has no worker")
            if events.begun and now - events.begun_at > limits.seconds + _GRACE_S:
                return time_exceeded(limits)

    async def _keep_connected(self) -> None:
        """Keep a client connected to the cluster while the cluster is available."""
        while True:
            client = None
            try:
                client = await self._connect()
                await self._monitor(client)
            except Exception as error:  # Any error of the network or of Dask: reported, and retried.
                why = await self._tls_fault() or _sentence(error)
                self._note_fault(f"the Dask scheduler at {self._address} cannot be reached: {why}")
            finally:
                self._client, self._threads, self._refused = None, {}, {}
                self._first_poll_done.set()
                if client is not None:
                    with contextlib.suppress(Exception):
                        async with asyncio.timeout(CONNECT_S):
                            await client.close()
            await asyncio.sleep(POLL_S)

    async def _connect(self) -> Any:
        # Dask's own settings name the certificates for tls://; the files are read again.
        return await self._distributed.Client(  # type: ignore[no-untyped-call]
            self._address, asynchronous=True, timeout=CONNECT_S, set_as_default=False, name="robosc-server"
        )

    async def _tls_fault(self) -> str | None:
        """Return a problem with a certificate, which Dask itself does not report clearly."""
        if not self._address.startswith(_TLS):
            return None
        from robosc_server.workers.dask_tls import tls_fault

        host, _, port = self._address.removeprefix(_TLS).rpartition(":")
        return await tls_fault(host.strip("[]"), int(port), CONNECT_S)

    async def _monitor(self, client: Any) -> None:
        """Track the workers of the cluster until the connection is lost."""
        connection = client.scheduler_comm
        client.subscribe_topic(_topic(client), self._on_event)
        known: dict[str, str] = {}
        while True:
            if client.status != "running" or client.scheduler_comm is not connection:
                raise ConnectionError("the connection was lost")
            async with asyncio.timeout(CONNECT_S):
                threads = dict(await client.nthreads())
            new = [self._check_worker(client, address) for address in threads.keys() - known.keys()]
            examined = dict(await asyncio.gather(*new))
            known = {address: why for address, why in (known | examined).items() if why is not None}
            for address in examined.keys() & known.keys():
                if known[address]:
                    _LOG.error("%s", known[address])
            self._refused = {address: why for address, why in known.items() if why and address in threads}
            self._threads = {address: count for address, count in threads.items() if known.get(address) == ""}
            self._client = client
            if self._threads:
                self._note_fault("")
            else:
                reasons = [*self._refused.values(), f"the Dask cluster at {self._address} has no worker"]
                self._note_fault(reasons[0])
            self._first_poll_done.set()
            await asyncio.sleep(POLL_S)

    async def _check_worker(self, client: Any, address: str) -> tuple[str, str | None]:
        """Return a worker's address, and why it cannot be used: empty if it can, None if it does not answer."""
        from robosc_server.workers.dask_task import mismatch, ready_version

        try:
            async with asyncio.timeout(_CHECK_S):
                version = await client.run(
                    ready_version, self._task_function, self._must_be_confined, workers=[address]
                )
        except (TimeoutError, OSError):
            return address, None
        except Exception as error:  # Any error of the worker, such as a missing RoboSC or another Python.
            return address, f"the Dask worker at {address} cannot load RoboSC: {_sentence(error)}"
        return address, "" if version.get(address) == __version__ else mismatch(
            address, str(version.get(address)), __version__
        )

    def _close_account(self, name: str) -> None:
        """Close the CPU time account of a task that has ended."""
        account = self._cpu_accounts.pop(name, None)
        if account is not None:
            account.close()

    async def _on_event(self, event: tuple[float, Any]) -> None:
        account = self._cpu_accounts.get(event[1]["task"])
        if account is not None:
            account.record_event(event[1])
        events = self._events.get(event[1]["task"])
        if events is not None:
            events.add(event[1])

    def _note_fault(self, fault: str) -> None:
        if fault != self.fault and self._first_poll_done.is_set():
            if fault:
                _LOG.error("%s; retrying", fault)
            else:
                _LOG.info("the Dask cluster at %s is available again", self._address)
        self.fault = fault


def _topic(client: Any) -> str:
    return f"robosc-{client.id}"


def _sentence(error: object) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:500]
