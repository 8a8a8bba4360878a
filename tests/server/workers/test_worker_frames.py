"""Tests of a worker's messages, however they are cut, long or wrong."""

import json

import hypothesis.strategies as st
import pytest
from hypothesis import given

from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Result, Task, TaskKind, TaskLimits
from robosc_server.workers.frames import (
    HEADER,
    MESSAGES_LIMIT,
    AnswerReader,
    FrameError,
    Tag,
    failure_frame,
    frame,
    report_frame,
    task_frames,
    task_of,
)

LIMITS = TaskLimits(result_bytes=1000)


def read(content: bytes, limits: TaskLimits = LIMITS) -> tuple[list[Report], Outcome | None]:
    """Return the content of a whole answer, and None where it ends too early."""
    reader = AnswerReader(limits)
    reports: list[Report] = []
    place = 0
    while len(content) >= place + HEADER.size:
        announced = reader.read_header(content[place : place + HEADER.size])
        if isinstance(announced, Failure):
            return reports, announced
        tag, length = announced
        begin, place = place + HEADER.size, place + HEADER.size + length
        payload = content[begin:place]
        if len(payload) < length:
            break
        told = reader.read(tag, payload)
        if isinstance(told, Report):
            reports.append(told)
        elif told is not None:
            return reports, told
    return reports, None


@given(
    st.lists(st.binary(max_size=100), min_size=1, max_size=10), st.lists(st.tuples(st.text(), st.text()), max_size=5)
)
def test_an_answer_is_read_as_it_was_said(messages: list[bytes], texts: list[tuple[str, str]]) -> None:
    reports = [Report(*both) for both in texts]
    said = b"".join(map(report_frame, reports)) + b"".join(frame(Tag.MESSAGE, message) for message in messages)
    assert read(said + frame(Tag.RESULT, b"")) == (reports, Result(tuple(messages)))
    assert read(said) == (reports, None)


def test_a_result_of_nothing_is_none() -> None:
    with pytest.raises(FrameError, match="without a message"):
        read(frame(Tag.RESULT, b""))


@given(st.binary(max_size=200))
def test_whatever_comes_there_is_one_kind_of_error(content: bytes) -> None:
    for said in (content, *(frame(tag, content) for tag in Tag)):
        try:
            read(said)
        except FrameError:
            continue


@given(
    st.recursive(st.none() | st.text() | st.integers(), lambda some: st.lists(some) | st.dictionaries(st.text(), some))
)
def test_json_that_is_no_report_is_refused(value: object) -> None:
    for tag in (Tag.REPORT, Tag.FAILURE):
        with pytest.raises(FrameError):
            read(frame(tag, json.dumps(value).encode()))


def test_a_task_is_told_whole() -> None:
    task = Task(TaskKind.VERIFY, b"\x00request", "0123", "robot\ud800.rscd")
    limits = TaskLimits(1.5, 2.5, 3, 4, 5)
    told = task_frames(task, limits)
    _, length = HEADER.unpack(told[: HEADER.size])
    head, rest = told[HEADER.size :][:length], told[HEADER.size + length :]
    assert task_of(head, rest[HEADER.size :]) == (task, limits)


def test_more_than_may_be_is_refused_by_its_length_alone() -> None:
    limit = LIMITS.result_bytes
    whole = frame(Tag.MESSAGE, bytes(limit))
    assert read(whole + frame(Tag.RESULT, b""))[1] == Result((bytes(limit),))
    for begun in (whole + HEADER.pack(b"M", 1), HEADER.pack(b"M", limit + 1), HEADER.pack(b"M", 2**64 - 1)):
        outcome = read(begun)[1]
        assert isinstance(outcome, Failure)
        assert outcome.reason is Reason.RESULT_TOO_LARGE
    with pytest.raises(FrameError, match="a report of"):
        read(HEADER.pack(b"P", 2**30))
    with pytest.raises(FrameError, match="a failure of"):
        read(HEADER.pack(b"F", 2**30))


def test_countless_small_messages_are_too_large_as_well() -> None:
    outcome = read(frame(Tag.MESSAGE, b"") * (MESSAGES_LIMIT + 1))[1]
    assert isinstance(outcome, Failure)
    assert outcome.reason is Reason.RESULT_TOO_LARGE


def test_a_failure_is_cut_and_cleaned() -> None:
    said = Failure(Reason.NODE_LIMIT, "too many \ud800" + "x" * 10_000, "first" + "y" * 100_000 + "last")
    told = read(failure_frame(said))[1]
    assert isinstance(told, Failure)
    assert told.reason is Reason.NODE_LIMIT
    assert told.message.startswith("too many ?xx")
    assert len(told.message) == 4_000
    assert told.details.endswith("last")
    assert len(told.details) == 60_000


@pytest.mark.parametrize("reason", [Reason.UNAUTHENTICATED, Reason.SERVER_BUSY, Reason.NO_SUCH_JOB])
def test_a_worker_may_not_speak_for_the_server(reason: Reason) -> None:
    with pytest.raises(FrameError, match="workers may not report"):
        read(failure_frame(Failure(reason, "what?")))
