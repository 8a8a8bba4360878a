"""Interceptor of every call: request id, log line, metrics and span, and uniform reporting of failures.

One interceptor does all of this, since each one takes some microseconds of every call.
"""

import asyncio
import logging
from typing import Any

import grpc
import grpc.aio
import structlog

from robosc_api.calls import call_under_way, peer_of, request_id
from robosc_api.failures import reason_of
from robosc_api.layers import Layer, behaviour_of, with_behaviour, writing
from robosc_api.security import token_name
from robosc_api.security.host_sample import HostSample
from robosc_server.clock import running_clock
from robosc_server.operations.failures import abort, code_of, fault_message
from robosc_server.operations.logs import log_fault, request_id_of
from robosc_server.operations.metrics import MethodMetrics, Metrics
from robosc_server.operations.tracing import NO_TRACING, Tracing
from robosc_server.tasks.task import Reason, RefusedError

_HEALTH = "/grpc.health."
_REFUSED_RETRY_S = 1.0

_ON_THE_WAY_S = 0.1
"""Time by which a caller's timer may report a passed deadline before our own, in seconds, apart from rounding."""

_ROUNDED = 0.01
"""Share of a call's time by which its deadline is later for us than for its caller."""


class CallInterceptor(Layer):
    """Outermost layer, which also sees the calls that other layers refuse.

    Handlers may raise `RefusedError`; for any other exception the caller gets the id of an internal error.

    Args:
        metrics: Metrics that count calls.
        tracing: Tracing that receives spans.
    """

    def __init__(self, metrics: Metrics, tracing: Tracing = NO_TRACING) -> None:
        super().__init__()
        self._metrics = metrics
        self._tracing = tracing
        self._is_refusing = False
        self._refusals = HostSample()
        self._log = structlog.get_logger().bind()

    def refuse_new(self) -> None:
        """Refuse new calls from now on, except health checks."""
        self._is_refusing = True

    def under_way(self, idle_methods: frozenset[str] = frozenset()) -> int:
        """Calls that have begun and not ended, health checks aside.

        Args:
            idle_methods: Methods that do not count.
        """
        return sum(
            self._metrics.method(name).under_way
            for name in self._made
            if name not in idle_methods and not name.startswith(_HEALTH)
        )

    def handler(self, inner: Any, details: Any) -> Any:
        """Return the handler of a call inside this layer."""
        call_under_way().request_id = request_id_of(details.invocation_metadata)
        if inner is None:
            self._metrics.unknown_method()
        return super().handler(inner, details)

    def wrap(self, inner: Any, method: str) -> Any:
        """Return a handler inside this layer."""
        answer = behaviour_of(inner)
        if inner.response_streaming:
            answer = writing(answer)
        return with_behaviour(inner, self._measured(answer, method, self._metrics.method(method)))

    def _measured(self, inner: Any, method: str, metrics: MethodMetrics) -> Any:
        if self._tracing.is_on:
            inner = self._traced(inner, method)

        async def measured(request: Any, context: Any) -> Any:
            clock = running_clock()
            begun_s = clock()
            metrics.under_way += 1
            code = _OK
            try:
                if self._is_refusing:
                    _refuse(method)
                answer = await inner(request, context)
                code = _code_of(context)
                return answer
            except grpc.aio.AbortError:
                code = _code_of(context)
                raise
            except RefusedError as error:
                code = code_of(error.reason)
                await abort(context, error)
            except asyncio.CancelledError:
                code = _DEADLINE_EXCEEDED if _is_at_its_deadline(context, clock() - begun_s) else _CANCELLED
                raise
            except grpc.aio.InternalError:
                # gRPC raises this when the caller has gone.
                code = _CANCELLED
                raise
            except Exception as error:
                code = grpc.StatusCode.INTERNAL
                await abort(context, internal_error(error))
            finally:
                metrics.under_way -= 1
                self._ended(method, metrics, context, code, clock() - begun_s)

        return measured

    def _traced(self, inner: Any, method: str) -> Any:
        async def traced(request: Any, context: Any) -> Any:
            with self._tracing.call_span(method, context.invocation_metadata()) as span:
                span.set_attribute("request.id", request_id())
                try:
                    return await inner(request, context)
                finally:
                    span.set_attribute("enduser.id", token_name())

        return traced

    def _ended(self, method: str, metrics: MethodMetrics, context: Any, code: grpc.StatusCode, seconds: float) -> None:
        reason, level = "", logging.INFO
        if code is not _OK:
            if code is not _CANCELLED:
                reason = reason_of(context.trailing_metadata())
            if code in _FAULTS:
                level = logging.WARNING
        metrics.ended(code, reason, seconds)
        skipped = None
        if code is grpc.StatusCode.UNAUTHENTICATED:
            skipped = self._refusals.take(peer_of(context))
            if skipped is None:
                level = logging.DEBUG
        if method.startswith(_HEALTH):
            level = logging.DEBUG
        # The words of a line that is not logged would take longer than the rest.
        if not self._log.is_enabled_for(level):
            return
        words: dict[str, Any] = {"method": method, "code": code.name, "seconds": round(seconds, 6)}
        if reason:
            words["reason"] = reason
        if caller := token_name():
            words["caller"] = caller
        if skipped:
            words["skipped"] = skipped
        self._log.log(level, "call", **words, peer=peer_of(context))


_OK, _CANCELLED, _DEADLINE_EXCEEDED = (
    grpc.StatusCode.OK,
    grpc.StatusCode.CANCELLED,
    grpc.StatusCode.DEADLINE_EXCEEDED,
)
_FAULTS = frozenset({grpc.StatusCode.INTERNAL, grpc.StatusCode.UNKNOWN, grpc.StatusCode.DATA_LOSS})
_CODES = {code.value[0]: code for code in grpc.StatusCode}


def _is_at_its_deadline(context: Any, taken_s: float) -> bool:
    """Return True if a call was cancelled because its deadline has passed, by our timer or by its caller's.

    Both count from when they knew of the call, and a deadline goes over the line in units of up to a hundredth of it,
    rounded up: so the caller's timer is mostly the first one, and all that comes of it here is that the call is
    cancelled.

    Args:
        context: Context of the call.
        taken_s: Time that the call has taken, in seconds.
    """
    left_s: float | None = context.time_remaining()
    if left_s is None:
        return False  # It has no deadline.
    given_s = taken_s + left_s
    return left_s <= min(_ON_THE_WAY_S + _ROUNDED * given_s, given_s / 2)


def _code_of(context: Any) -> grpc.StatusCode:
    """Return the status that the handler has set, as a number or by name; OK if it has set none."""
    code = context.code()
    if isinstance(code, int):
        return _CODES.get(code, grpc.StatusCode.UNKNOWN)
    return grpc.StatusCode.OK if code is None else code


def _refuse(method: str) -> None:
    if not method.startswith(_HEALTH):
        raise RefusedError(
            Reason.SHUTTING_DOWN,
            "the server is shutting down; call another server, or try again later",
            _REFUSED_RETRY_S,
        )


def internal_error(fault: BaseException | str) -> RefusedError:
    """Log an internal error, and return the error for the caller.

    Args:
        fault: The fault, or a traceback of it from another process.
    """
    return RefusedError(Reason.INTERNAL_FAULT, fault_message(log_fault(fault)))
