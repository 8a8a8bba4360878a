"""RPCs of the job service: they convert messages and raise RefusedError, which the call interceptor reports."""

import asyncio
from collections.abc import AsyncIterable, Awaitable, Callable
from dataclasses import replace
from typing import Any

import grpc
import grpc.aio

from robosc_api import security
from robosc_api.layers import LayeredServices
from robosc_api.v1 import jobs_pb2 as pb
from robosc_server.jobs import convert
from robosc_server.jobs.manager import Caller, JobManager
from robosc_server.store import JobRecord
from robosc_server.tasks.requests import RequestLimits
from robosc_server.tasks.task import Reason, RefusedError, Task, TaskKind, own_key

_ID_CHARACTERS = 64
_JOBS_AT_ONCE = 20
_LIMITS = RequestLimits()

type Context = grpc.aio.ServicerContext[Any, Any]


def caller_of(context: Any) -> Caller:
    """Return the caller of the call under way."""
    # A certificate may contain any characters, but a database accepts no NUL.
    name = "".join(character if character.isprintable() else "?" for character in security.caller_of(context))
    return Caller(name, security.is_admin())


def _unlimited(caller: str) -> None:
    """Admit every caller, without a quota."""


async def _write(context: Context, messages: AsyncIterable[bytes]) -> None:
    async for message in messages:
        await context.write(message)


class JobService(convert.JobServiceServicer):
    """Service that submits, reports on and cancels jobs.

    Args:
        manager: Manager of the jobs.
        accept: Function that checks a request and returns its task, or raises RefusedError.
        identify: Function that returns the caller.
        admit: Function that counts a requested job for a caller's name, or raises RefusedError.
        send: Function that sends the messages of a result, serialized.
        limits: Limits of a request.
        keys: Function that returns the key of a caller's task, from the key of the task and the caller.
    """

    def __init__(
        self,
        manager: JobManager,
        accept: Callable[[TaskKind, bytes], Task],
        identify: Callable[[Context], Caller] = caller_of,
        admit: Callable[[str], None] = _unlimited,
        send: Callable[[Context, AsyncIterable[bytes]], Awaitable[None]] = _write,
        limits: RequestLimits = _LIMITS,
        keys: Callable[[str, str], str] = own_key,
    ) -> None:
        self._keys = keys
        self._manager, self._accept, self._limits = manager, accept, limits
        self._identify, self._admit, self._send = identify, admit, send
        self._last_watched: tuple[JobRecord, int, bytes] | None = None

    async def SubmitJob(  # noqa: N802  # named by the .proto file
        self, content: bytes, context: Context
    ) -> pb.SubmitJobResponse:
        """Accept a task; the request comes as bytes, which are checked before they are parsed."""
        request = convert.submission(content, self._limits)
        idempotency_key = convert.checked_idempotency_key(request.idempotency_key)
        label, retention_s = convert.checked_label(request.label), convert.retention_s_of(request)
        caller = self._identify(context)
        if not idempotency_key:
            # Counting comes first, since it takes less time than checking the request.
            self._count(caller)
        task = self._accept(*convert.kind_and_request(request.task))
        task = replace(task, key=self._keys(task.key, caller.name))
        if idempotency_key:
            # A repeated submission is nothing new, and does not count for the quota.
            if there := await self._manager.submitted(task, caller, idempotency_key):
                return pb.SubmitJobResponse(job=self._job(there), existed=True)
            self._count(caller)
        record, existed = await self._manager.submit(
            task, caller, idempotency_key=idempotency_key, label=label, retention_s=retention_s
        )
        return pb.SubmitJobResponse(job=self._job(record), existed=existed)

    def _count(self, caller: Caller) -> None:
        """Count a requested job for the quota of its caller, unless the queue is full."""
        self._manager.require_room(caller)
        self._admit(caller.name)

    async def GetJob(  # noqa: N802
        self, request: pb.GetJobRequest, context: Context
    ) -> pb.GetJobResponse:
        """Return the state of a job."""
        record = await self._manager.get(_checked_id(request.id), self._identify(context))
        return pb.GetJobResponse(job=self._job(record))

    async def WatchJob(  # noqa: N802
        self, request: pb.WatchJobRequest, context: Context
    ) -> None:
        """Send the state of a job until it has ended."""
        caller = self._identify(context)
        async for record in self._manager.watch(_checked_id(request.id), caller, request.after_revision):
            await context.write(self._watch_response(record))

    async def CancelJob(  # noqa: N802
        self, request: pb.CancelJobRequest, context: Context
    ) -> pb.CancelJobResponse:
        """Cancel a job."""
        record = await self._manager.cancel(_checked_id(request.id), self._identify(context))
        return pb.CancelJobResponse(job=self._job(record))

    async def ListJobs(  # noqa: N802
        self, request: pb.ListJobsRequest, context: Context
    ) -> pb.ListJobsResponse:
        """List jobs, newest first."""
        caller = self._identify(context)
        if request.all_owners and not caller.is_admin:
            raise RefusedError(Reason.PERMISSION_DENIED, "all_owners requires a token with the scope 'admin'")
        chosen = convert.filter_of(request, caller.name)
        size = convert.page_size_of(request)
        # One more job than requested shows whether there is another page.
        found = await self._manager.list_jobs(chosen, convert.page_position(request.page_token, chosen), size + 1)
        token = convert.page_token(found[size - 1], chosen) if len(found) > size else ""
        answer = pb.ListJobsResponse(next_page_token=token)
        for place in range(0, min(size, len(found)), _JOBS_AT_ONCE):
            answer.jobs.extend(map(self._job, found[place : min(place + _JOBS_AT_ONCE, size)]))
            # A long list takes a while: let other calls run in between.
            await asyncio.sleep(0)
        return answer

    async def GetLoad(  # noqa: N802
        self, request: pb.GetLoadRequest, context: Context
    ) -> pb.GetLoadResponse:
        """Return the load of the service."""
        caller = self._identify(context)
        if request.all_callers and not caller.is_admin:
            raise RefusedError(Reason.PERMISSION_DENIED, "all_callers requires a token with the scope 'admin'")
        return convert.load_response(await self._manager.load(caller, all_callers=request.all_callers))

    async def GetJobResult(  # noqa: N802
        self, request: pb.GetJobResultRequest, context: Context
    ) -> None:
        """Send the result of a job."""
        record, messages = await self._manager.result(_checked_id(request.id), self._identify(context))
        await self._send(context, (convert.result_response(record.kind, message) async for message in messages))

    def _watch_response(self, record: JobRecord) -> bytes:
        """Return a serialized WatchJobResponse, which is made once for all watchers that get the same record."""
        waiting_before = self._manager.waiting_before(record)
        last = self._last_watched
        if last is not None and last[0] is record and last[1] == waiting_before:
            return last[2]
        content: bytes = pb.WatchJobResponse(job=convert.job_of(record, waiting_before)).SerializeToString()
        self._last_watched = record, waiting_before, content
        return content

    def _job(self, record: JobRecord) -> pb.Job:
        return convert.job_of(record, self._manager.waiting_before(record))


def add_job_service(service: JobService, services: LayeredServices) -> None:
    """Add the service to those of a server, with serialized results and serialized submissions."""
    convert.add_servicer(service, _SerializedAdapter(services))  # type: ignore[no-untyped-call]  # generated


class _SerializedAdapter:
    """Adapter that passes handlers on to other services, with a serializer that takes serialized messages, too.

    Args:
        services: Services that receive the handlers.
    """

    def __init__(self, services: LayeredServices) -> None:
        self._services = services

    def add_generic_rpc_handlers(self, handlers: Any) -> None:
        """Do nothing: the registered handlers of the same methods take precedence."""

    def add_registered_method_handlers(self, service: str, handlers: dict[str, Any]) -> None:
        """Register the handlers of a service."""
        changed = {name: handler._replace(response_serializer=convert.serialized) for name, handler in handlers.items()}
        changed["SubmitJob"] = changed["SubmitJob"]._replace(request_deserializer=None)
        self._services.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(service, changed),))


def _checked_id(text: str) -> str:
    # Ids have no other form; the check saves a database query.
    if not 0 < len(text) <= _ID_CHARACTERS or not text.isascii() or not text.isprintable():
        raise RefusedError(Reason.NO_SUCH_JOB, "there is no job with this id that the caller may see")
    return text
