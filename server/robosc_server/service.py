"""The RPCs: conversion at the border, work in the pool, and every failure as one gRPC status."""

import asyncio
import logging
import secrets
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any, NoReturn

import grpc
import grpc.aio

from robosc_server import convert
from robosc_server.pool import PoolBusyError, WorkerPool
from robosc_server.settings import Settings
from robosc_server.work import (
    CheckOutcome,
    Failed,
    GenerateOutcome,
    Job,
    Refused,
    Report,
    SynthesizeOutcome,
)

_LOG = logging.getLogger(__name__)

Context = grpc.aio.ServicerContext[Any, Any]


class _FaultError(Exception):
    """A fault of ours; its text is for the log only."""


class SynthesisService(convert.SynthesisServiceServicer):
    """Checks, synthesizes and generates; one job a request."""

    def __init__(self, pool: WorkerPool, settings: Settings) -> None:
        self._pool = pool
        self._settings = settings

    async def Check(  # noqa: N802  # named by the .proto file
        self, request: convert.CheckRequest, context: Context
    ) -> convert.CheckResponse:
        """Find everything that is wrong with a bundle."""
        async with self._translated(context):
            job = convert.check_job(request, self._settings.max_bundle_bytes)
            return convert.check_response(await self._run(job, CheckOutcome, _drop))
        raise AssertionError("unreachable: a failed request is aborted")

    async def Synthesize(  # noqa: N802
        self, request: convert.SynthesizeRequest, context: Context
    ) -> None:
        """Make a supervisor: progress, then the result."""

        async def report(progress: Report) -> None:
            await context.write(convert.progress_response(progress))

        async with self._translated(context):
            job = convert.synthesize_job(request, self._settings.max_bundle_bytes)
            outcome = await self._run(job, SynthesizeOutcome, report)
            await context.write(convert.synthesize_response(outcome))

    async def Generate(  # noqa: N802
        self, request: convert.GenerateRequest, context: Context
    ) -> convert.GenerateResponse:
        """Make a supervisor and the files of a target around it."""
        async with self._translated(context):
            job = convert.generate_job(request, self._settings.max_bundle_bytes)
            return convert.generate_response(await self._run(job, GenerateOutcome, _drop))
        raise AssertionError("unreachable: a failed request is aborted")

    async def _run[O: CheckOutcome | SynthesizeOutcome | GenerateOutcome](
        self, job: Job, kind: type[O], on_report: Callable[[Report], Awaitable[None]]
    ) -> O:
        """The outcome of a job within the server's limit.

        Raises:
            TimeoutError: The limit has passed.
            RequestError: The job names something that is not there.
        """
        async with asyncio.timeout(self._settings.max_synthesis_seconds):
            outcome = await self._pool.run(job, on_report)
        if isinstance(outcome, Refused):
            raise convert.RequestError(outcome.message)
        if isinstance(outcome, Failed):
            raise _FaultError(outcome.details)
        if not isinstance(outcome, kind):
            raise _FaultError(f"a worker answered {type(job).__name__} with {type(outcome).__name__}")
        return outcome

    @asynccontextmanager
    async def _translated(self, context: Context) -> AsyncIterator[None]:
        """End the RPC with the right status for what goes wrong inside.

        A caller that goes away, or whose deadline passes, has this task cancelled by gRPC; the pool then
        kills the worker.
        """
        try:
            yield
        except convert.RequestError as error:
            await context.abort(grpc.StatusCode.INVALID_ARGUMENT, str(error))
        except convert.BundleTooLargeError as error:
            await context.abort(grpc.StatusCode.RESOURCE_EXHAUSTED, str(error))
        except PoolBusyError:
            await context.abort(grpc.StatusCode.RESOURCE_EXHAUSTED, "the server has too much to do; try again later")
        except TimeoutError:
            limit = f"{self._settings.max_synthesis_seconds:g}"
            await context.abort(
                grpc.StatusCode.DEADLINE_EXCEEDED, f"the server works at most {limit} seconds on a request"
            )
        except grpc.aio.AbortError:
            raise
        except Exception as error:
            await _abort_with_fault(context, error)


async def _drop(report: Report) -> None:
    """Progress of a request whose response has no place for it."""


async def _abort_with_fault(context: Context, error: Exception) -> NoReturn:
    """Log a fault under an id and tell the caller the id alone."""
    fault = secrets.token_hex(4)
    if isinstance(error, _FaultError):
        _LOG.error("fault %s: %s", fault, error)
    else:
        _LOG.error("fault %s", fault, exc_info=error)
    await context.abort(grpc.StatusCode.INTERNAL, f"internal error {fault}, please report it with the server's log")
