"""Retry decisions, without making calls or waiting.

Only idempotent calls are retried: every task has the same result for the same request, and a job is submitted with an
idempotency key. The delays grow exponentially with random jitter, so that clients that lost a server at the same time
do not retry at the same time (Marc Brooker, "Exponential Backoff And Jitter", AWS Architecture Blog, 2015).
"""

import random
import time
from collections.abc import Callable
from dataclasses import dataclass

import grpc

from robosc_client.convert.failures import Failure
from robosc_client.errors import (
    ClientError,
    DeadlineError,
    JobError,
    RequestRefusedError,
    ServerBusyError,
    ServerUnavailableError,
    ServiceError,
)

# gRPC measures a deadline with a clock of its own.
_CLOCK_TOLERANCE_S = 0.05

_LOST = frozenset({grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED})
"""Codes of calls that no server has answered. A client never retries a call that its own program has cancelled, so any
CANCELLED here comes from the other end: gRPC cancels calls of an overloaded server before the server sees them."""

_BUSY = frozenset({"SERVER_BUSY", "QUOTA_EXCEEDED"})

_REFUSALS = frozenset(
    {
        grpc.StatusCode.INVALID_ARGUMENT,
        grpc.StatusCode.PERMISSION_DENIED,
        grpc.StatusCode.RESOURCE_EXHAUSTED,
        grpc.StatusCode.UNAUTHENTICATED,
    }
)
_JOB_CODES = frozenset({grpc.StatusCode.NOT_FOUND, grpc.StatusCode.FAILED_PRECONDITION, grpc.StatusCode.ALREADY_EXISTS})


@dataclass(frozen=True, slots=True, kw_only=True)
class RetryPolicy:
    """Policy for repeating failed calls.

    Attributes:
        attempts: Maximum number of calls, the first included; 1: no retries.
        watch_attempts: The same for a watch, counted from its last message.
        first_s: The first delay, in seconds; the actual delay is random, between a half and the whole of it.
        factor: Ratio of each delay to the one before: from 1 to 10.
        longest_s: The longest delay.
        longest_asked_s: Maximum delay that a server may request; a longer request raises its error.
        scatter: Function that returns random numbers from 0 to 1.
        clock: Monotonic clock, in seconds.
    """

    attempts: int = 4
    watch_attempts: int = 10
    first_s: float = 0.1
    factor: float = 2.0
    longest_s: float = 10.0
    longest_asked_s: float = 60.0
    scatter: Callable[[], float] = random.random
    clock: Callable[[], float] = time.monotonic

    def __post_init__(self) -> None:
        is_sound = 0 < self.first_s <= self.longest_s and 1 <= self.factor <= 10
        if min(self.attempts, self.watch_attempts) < 1 or not is_sound:
            raise ValueError("a retry policy needs at least one attempt, and delays that grow by a factor from 1 to 10")


DEFAULT_RETRIES = RetryPolicy()

NO_RETRIES = RetryPolicy(attempts=1, watch_attempts=1)
"""Policy without retries."""


class Attempts:
    """Attempts of one call."""

    def __init__(self, policy: RetryPolicy, address: str, deadline_s: float | None, *, is_watch: bool = False) -> None:
        """Begin.

        Args:
            policy: Policy for retries.
            address: Address that the call is made to, for messages.
            deadline_s: Seconds from now that all attempts and delays may take together; None: any number.
            is_watch: True if the next attempt resumes after the received messages.
        """
        self._policy = policy
        self._address = address
        self._deadline_s = deadline_s
        self._begun_s = policy.clock()
        self._most = policy.watch_attempts if is_watch else policy.attempts
        self._is_watch = is_watch
        self._failed = 0

    def timeout_s(self) -> float | None:
        """Return the time limit of the next attempt in seconds; None: none.

        Raises:
            DeadlineError: The deadline has passed.
        """
        left_s = self._remaining_s()
        if left_s is not None and left_s <= 0:
            raise self._deadline_error()
        return left_s

    def succeeded(self) -> None:
        """Reset the number of failures, since a message was received."""
        self._failed = 0

    def delay_after(self, failure: Failure, *, has_answered: bool, is_closed: bool = False) -> float:
        """Return the seconds until the next attempt.

        Args:
            failure: Failure of the last one.
            has_answered: True if it had received anything.
            is_closed: True if the client was closed, which cancels its open calls.

        Raises:
            ClientError: There is no next attempt.
        """
        self._failed += 1
        is_retryable = not is_closed and self._is_retryable(failure, has_answered=has_answered)
        if not is_retryable or self._failed >= self._most:
            raise self._error(failure)
        delay_s = self._delay_s(failure.retry_after_s)
        left_s = self._remaining_s()
        if delay_s is None or (left_s is not None and delay_s >= left_s):
            raise self._error(failure)
        return delay_s

    def _is_retryable(self, failure: Failure, *, has_answered: bool) -> bool:
        if failure.code in _LOST:
            return self._is_watch or not has_answered
        is_busy = failure.code is grpc.StatusCode.RESOURCE_EXHAUSTED and failure.reason in _BUSY
        return is_busy and failure.retry_after_s is not None

    def _delay_s(self, asked_s: float | None) -> float | None:
        """Return the delay in seconds; None: the server requests more than the policy allows."""
        policy = self._policy
        # The power does not grow too large, whatever the number of failures.
        grown_s = policy.first_s * policy.factor ** min(self._failed - 1, 64)
        delay_s = min(grown_s, policy.longest_s) * (0.5 + policy.scatter() / 2)
        if asked_s is None:
            return delay_s
        return None if asked_s > policy.longest_asked_s else asked_s + delay_s / 2

    def _remaining_s(self) -> float | None:
        if self._deadline_s is None:
            return None
        return self._begun_s + self._deadline_s - self._policy.clock()

    def _deadline_error(self) -> DeadlineError:
        return DeadlineError(f"no result from {self._address} within {self._deadline_s:g} seconds")

    def _error(self, failure: Failure) -> ClientError:
        """Return the error for a failure."""
        code, reason, message = failure.code, failure.reason, failure.message
        if code is grpc.StatusCode.UNAVAILABLE:
            if reason:
                return ServerUnavailableError(f"the server at {self._address} is unavailable: {message}", reason)
            why = f": {message}" if message else ""
            return ServerUnavailableError(f"no server answers at {self._address}{why}")
        if code is grpc.StatusCode.CANCELLED:
            why = f": {message}" if message else ""
            return ServerUnavailableError(f"the server at {self._address} cancelled the call{why}", reason)
        if code is grpc.StatusCode.DEADLINE_EXCEEDED:
            left_s = self._remaining_s()
            if left_s is not None and left_s <= _CLOCK_TOLERANCE_S:
                return self._deadline_error()
            return DeadlineError(f"no result from {self._address}: {message}", reason)
        if reason in _BUSY:
            return ServerBusyError(f"the server at {self._address} refuses: {message}", reason, failure.retry_after_s)
        if code in _REFUSALS:
            return RequestRefusedError(f"the server at {self._address} refuses: {message}", reason)
        if code in _JOB_CODES:
            return JobError(f"the server at {self._address} answers: {message}", reason)
        if code is grpc.StatusCode.UNIMPLEMENTED:
            return ServiceError(f"the server at {self._address} is not a RoboSC server of this version")
        return ServiceError(f"the server at {self._address} failed ({code.name.lower()}): {message}", reason)
