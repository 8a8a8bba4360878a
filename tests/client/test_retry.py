import math
from itertools import pairwise
from typing import Any

import grpc
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_client import NO_RETRIES, ClientError, DeadlineError, RetryPolicy, ServerBusyError, ServerUnavailableError
from robosc_client.convert.failures import Failure, first_line
from robosc_client.retry import Attempts

AWAY = Failure(grpc.StatusCode.UNAVAILABLE)


def busy(retry_after_s: float | None = 1.5, reason: str = "SERVER_BUSY") -> Failure:
    return Failure(grpc.StatusCode.RESOURCE_EXHAUSTED, "too much to do", reason, retry_after_s)


class Clock:
    """A clock that a test moves."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def attempts_of(clock: Any = None, deadline_s: float | None = None, is_watch: bool = False, **options: Any) -> Attempts:
    policy = RetryPolicy(clock=clock or Clock(), **{"scatter": lambda: 1.0, **options})
    return Attempts(policy, "there:1", deadline_s, is_watch=is_watch)


def delays(attempts: Attempts, failure: Failure = AWAY, *, has_answered: bool = False) -> list[float]:
    """All delays, until there is no next attempt."""
    found: list[float] = []
    with pytest.raises(ClientError):
        while len(found) < 1000:
            found.append(attempts.delay_after(failure, has_answered=has_answered))
    return found


def test_delays_grow_and_end() -> None:
    assert delays(attempts_of(attempts=6, longest_s=1.0)) == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.0])
    assert delays(attempts_of(attempts=6, longest_s=1.0, scatter=lambda: 0.0)) == pytest.approx(
        [0.05, 0.1, 0.2, 0.4, 0.5]
    )


@pytest.mark.parametrize("failure", [AWAY, busy()])
def test_one_attempt(failure: Failure) -> None:
    assert delays(Attempts(NO_RETRIES, "there:1", None), failure) == []


@pytest.mark.parametrize(
    ("failure", "has_answered", "is_worth_it"),
    [
        (AWAY, False, True),
        (AWAY, True, False),
        # A server cancels calls that have not reached it when there are too many.
        (Failure(grpc.StatusCode.CANCELLED), False, True),
        (Failure(grpc.StatusCode.CANCELLED), True, False),
        (busy(), False, True),
        (busy(reason="QUOTA_EXCEEDED"), False, True),
        (busy(None), False, False),
        (busy(reason="CPU_LIMIT"), False, False),
        (busy(reason="REQUEST_TOO_LARGE"), False, False),
        (busy(reason=""), False, False),
        (Failure(grpc.StatusCode.INTERNAL), False, False),
        (Failure(grpc.StatusCode.DEADLINE_EXCEEDED), False, False),
        (Failure(grpc.StatusCode.INVALID_ARGUMENT, reason="SERVER_BUSY", retry_after_s=1.0), False, False),
    ],
)
def test_what_is_made_again(failure: Failure, has_answered: bool, is_worth_it: bool) -> None:
    assert bool(delays(attempts_of(), failure, has_answered=has_answered)) is is_worth_it


def test_a_server_is_asked_again_when_it_says() -> None:
    assert min(delays(attempts_of(), busy(7.0))) >= 7.0
    assert delays(attempts_of(longest_asked_s=5.0), busy(7.0)) == []
    attempts = attempts_of(longest_asked_s=5.0)
    with pytest.raises(ServerBusyError) as caught:
        attempts.delay_after(busy(7.0), has_answered=False)
    assert (caught.value.reason, caught.value.retry_after_s) == ("SERVER_BUSY", 7.0)


def test_no_delay_goes_beyond_the_deadline() -> None:
    clock = Clock()
    attempts = attempts_of(clock, deadline_s=1.0)
    assert attempts.timeout_s() == 1.0
    clock.now_s += 0.95
    assert attempts.timeout_s() == pytest.approx(0.05)
    with pytest.raises(ServerUnavailableError):
        attempts.delay_after(AWAY, has_answered=False)
    clock.now_s += 0.1
    with pytest.raises(DeadlineError, match="from there:1 within 1 seconds"):
        attempts.timeout_s()


def test_the_caller_s_deadline_and_the_server_s() -> None:
    clock = Clock()
    over = Failure(grpc.StatusCode.DEADLINE_EXCEEDED, "works at most 2 seconds", "TIME_LIMIT")
    attempts = attempts_of(clock, deadline_s=5.0)
    with pytest.raises(DeadlineError, match="at most 2 seconds") as caught:
        attempts.delay_after(over, has_answered=True)
    assert caught.value.reason == "TIME_LIMIT"
    clock.now_s += 5.0
    with pytest.raises(DeadlineError, match="within 5 seconds"):
        attempts.delay_after(over, has_answered=True)


def test_a_watch_has_all_attempts_again_after_each_message() -> None:
    attempts = attempts_of(is_watch=True, watch_attempts=3)
    for _ in range(5):
        assert [attempts.delay_after(AWAY, has_answered=True) for _ in range(2)] == pytest.approx([0.1, 0.2])
        attempts.succeeded()
    assert len(delays(attempts, has_answered=True)) == 2


def test_why_nobody_answers() -> None:
    """gRPC's own reason, on one line that no terminal obeys."""
    for detail, words in (("", ""), ("connection refused", ": connection refused")):
        with pytest.raises(ServerUnavailableError) as caught:
            Attempts(NO_RETRIES, "there:1", None).delay_after(
                Failure(grpc.StatusCode.UNAVAILABLE, detail), has_answered=False
            )
        assert str(caught.value) == f"no server answers at there:1{words}"
    assert first_line("\n first \x1b[2J\x07\nsecond") == "first \\x1b[2J\\x07"
    assert len(first_line("x" * 10_000)) < 1000


@given(
    st.integers(1, 400),
    st.floats(0.001, 10),
    st.floats(1, 10),
    st.floats(0, 1),
    st.lists(st.one_of(st.none(), st.floats(0, 1e12)), max_size=100),
    st.floats(0.1, 1e6),
)
def test_delays_are_sound(
    most: int, first_s: float, factor: float, chance: float, asked: list[float | None], deadline_s: float
) -> None:
    """Check delays for any policy and any demand of a server: never too many, too long or beyond the deadline."""
    clock = Clock()
    attempts = attempts_of(clock, deadline_s, attempts=most, first_s=first_s, factor=factor, scatter=lambda: chance)
    waited = []
    try:
        for asked_s in asked:
            attempts.timeout_s()
            failure = AWAY if asked_s is None else busy(asked_s)
            delay_s = attempts.delay_after(failure, has_answered=False)
            assert math.isfinite(delay_s)
            assert (asked_s or 0.0) < delay_s <= (asked_s or 0.0) + 10.0
            clock.now_s += delay_s
            waited.append((asked_s, delay_s))
    except (ServerBusyError, ServerUnavailableError):
        pass
    assert len(waited) < most
    assert clock.now_s < 100.0 + deadline_s
    own = [delay_s for asked_s, delay_s in waited if asked_s is None]
    assert all(later >= earlier * (1 - 1e-9) for earlier, later in pairwise(own))


@pytest.mark.parametrize(
    "wrong",
    [{"attempts": 0}, {"watch_attempts": 0}, {"first_s": 0}, {"first_s": 20.0}, {"factor": 0.5}, {"factor": 11}],
)
def test_wrong_policies(wrong: Any) -> None:
    with pytest.raises(ValueError, match="at least one attempt"):
        RetryPolicy(**wrong)
