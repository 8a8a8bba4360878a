"""Tests of the form of log lines, and of the contents that never stand in them."""

import json
import logging
from pathlib import Path
from typing import Any

import grpc.aio
import pytest
import structlog
from hypothesis import given
from hypothesis import strategies as st

from robosc_api.calls import CALL, Call
from robosc_server.operations.failures import public_failure
from robosc_server.operations.logs import log_fault, request_id_of
from robosc_server.operations.settings import LogFormat, LogLevel
from robosc_server.tasks.task import Failure, Reason
from robosc_server.workers.exit_reasons import ProcessExit, exit_description
from support.small_server import logged

MARKER = "a_word_of_the_model"

_TRACEBACK = (
    f'Traceback (most recent call last):\n  File "/some/where/robosc_server/tasks/run.py", line 3, in part\n'
    f"    code({MARKER})\nSyntaxError: {MARKER}\n"
)


def raised() -> ValueError:
    try:
        raise ValueError(MARKER)
    except ValueError as error:
        return error


@pytest.mark.parametrize("form", list(LogFormat))
def test_lines_of_others_go_the_same_way(form: LogFormat) -> None:
    with logged(LogLevel.INFO, form) as log:
        call = Call()
        call.request_id = "this-request"
        token = CALL.set(call)
        try:
            logging.getLogger("others.part").warning("%s of %s", "some", "words")
            structlog.get_logger().info("ours", number=3)
            logging.getLogger("others.part").debug("too little")
        finally:
            CALL.reset(token)
    first, second = log.text.splitlines()
    if form is LogFormat.JSON:
        line = json.loads(first)
        assert line.pop("time").endswith("Z")
        expected = {"level": "warning", "event": "some of words", "logger": "others.part", "request": "this-request"}
        assert line == expected
        assert json.loads(second)["number"] == 3
    else:
        assert first.endswith("Z warning some of words logger=others.part request=this-request")
        assert second.endswith("Z info    ours number=3 request=this-request")


@pytest.mark.parametrize("form", list(LogFormat))
@given(text=st.text(), key=st.text(min_size=1, max_size=5))
def test_whatever_is_logged_is_one_line(form: LogFormat, text: str, key: str) -> None:
    with logged(LogLevel.INFO, form) as log:
        structlog.get_logger().info("ours", value=text, values=[text], odd={key: text}, raw=text.encode())
        logging.getLogger("others").warning("%s", text)
    assert log.text.count("\n") == 2
    if form is LogFormat.TEXT:
        assert len(log.text.splitlines()) == 2
    else:
        assert log.lines()[0]["value"] == text
        assert log.lines()[1]["event"] == text


def test_half_a_character_can_be_logged() -> None:
    for form in LogFormat:
        with logged(LogLevel.INFO, form) as log:
            structlog.get_logger().info("ours", value="\ud800")
            # The record goes to our handlers alone: pytest keeps what is logged, and cannot send half a character from
            # one process to another.
            record = logging.LogRecord("others", logging.WARNING, __file__, 1, "\udfff", None, None)
            for handler in logging.getLogger().handlers:
                if isinstance(handler.formatter, structlog.stdlib.ProcessorFormatter):
                    handler.handle(record)
        assert len(log.text.splitlines()) == 2


@pytest.mark.parametrize("form", list(LogFormat))
def test_an_exception_is_logged_without_its_words_above_debug(form: LogFormat) -> None:
    def logged_text(level: LogLevel) -> str:
        with logged(level, form) as log:
            logging.getLogger("others").error("failed", exc_info=raised())
            structlog.get_logger().error("failed", exc_info=raised())
            log_fault(raised())
            log_fault(_TRACEBACK)
        return log.text

    quiet = logged_text(LogLevel.INFO)
    assert MARKER not in quiet
    assert quiet.count("ValueError") == 3
    assert "SyntaxError" in quiet
    assert "robosc_server/tasks/run.py:3" in quiet
    assert MARKER in logged_text(LogLevel.DEBUG)


def test_what_the_system_says_is_reported() -> None:
    with logged(LogLevel.INFO) as log:
        try:
            Path("/nowhere/at/all").read_text()
        except OSError as error:
            structlog.get_logger().error("failed", exc_info=error)
    assert log.lines()[0]["cause"] == "No such file or directory"


def test_how_a_worker_died_is_logged_and_an_exception_in_it_is_not() -> None:
    with logged(LogLevel.INFO) as log:
        facts = exit_description(ProcessExit(-11, 1.5, 2**20))
        died = public_failure(Failure(Reason.WORKER_DIED, "it died", f"{facts}\nFatal Python error\n{MARKER}"))
        fault = public_failure(Failure(Reason.INTERNAL_FAULT, "a fault", f"Traceback\nKeyError: {MARKER}"))
    ending = "was ended by SIGSEGV after 1.50 s of CPU time, with at most 1048576 bytes resident"
    assert log.lines("fault")[0]["ending"] == ending
    assert MARKER not in log.text
    assert [line["reason"] for line in log.lines("fault")] == ["WORKER_DIED", "INTERNAL_FAULT"]
    for line, error in zip(log.lines("fault"), (died, fault), strict=True):
        assert line["fault"] in error.message


@pytest.mark.parametrize("reason", [Reason.MEMORY_LIMIT, Reason.CPU_LIMIT])
def test_a_task_beyond_a_limit_is_refused_and_is_no_fault(reason: Reason) -> None:
    ending = exit_description(ProcessExit(1, 1.5, 2**20))
    with logged(LogLevel.INFO) as log:
        refused = public_failure(Failure(reason, "it needs more than it may", f"{ending}\n{MARKER}"))
    assert refused == Failure(reason, "it needs more than it may")
    (line,) = log.lines()
    assert (line["level"], line["event"], line["reason"], line["ending"]) == ("info", "limit", reason, ending)
    assert MARKER not in log.text


@pytest.mark.parametrize(
    "words",
    [
        f"was ended by SIGSEGV after 1.50 s of CPU time, with at most 1 bytes resident{MARKER}",
        f"{MARKER}\nwas ended by SIGSEGV after 1.50 s of CPU time, with at most 1 bytes resident",
        f'  File "/x/robosc_server/{MARKER}.py", line 3, in run\n',
        f'  File "/x/{MARKER}/x.py", line 3, in {MARKER}\n',
        f'  File "/x/robosc_server/tasks/run.py", line 3, in {MARKER}\n',
        f'  File "/{MARKER}/robosc_server/tasks/run.py", line 3, in x\n',
        f"{MARKER}: {MARKER}",
        f"robosc_server.operations.failures.{MARKER}: no",
        f"builtins.{MARKER}",
        MARKER,
    ],
)
@pytest.mark.parametrize("reason", [Reason.WORKER_DIED, Reason.INTERNAL_FAULT])
def test_workers_can_say_what_they_like_and_nothing_of_it_is_logged_above_debug(words: str, reason: Reason) -> None:
    with logged(LogLevel.INFO) as log:
        public_failure(Failure(reason, MARKER, words))
    (line,) = log.lines()
    assert MARKER not in json.dumps(line)
    assert line["reason"] == reason


@pytest.mark.parametrize("form", list(LogFormat))
def test_what_workers_say_at_debug_is_one_short_line_without_control(form: LogFormat) -> None:
    lying = f"KeyError: x\n2026-01-01T00:00:00.000Z error   forged\r\x1b[2J\x85\u2028\x9b2J\u202e{MARKER}"
    with logged(LogLevel.DEBUG, form) as log:
        public_failure(Failure(Reason.WORKER_DIED, "it died", lying))
        public_failure(Failure(Reason.WORKER_DIED, "it died", "\n" * 60_000 + " " * 60_000 + "x" * 60_000 + MARKER))
    assert len(log.text.splitlines()) == 4
    assert all(line.isprintable() for line in log.text.splitlines())
    assert log.text.count(MARKER) == 2
    assert len(log.text) < 30_000


def test_set_up_twice_each_line_is_written_once() -> None:
    with logged(LogLevel.INFO) as first, logged(LogLevel.INFO) as second:
        logging.getLogger("others").warning("once")
    assert (first.text, len(second.text.splitlines())) == ("", 1)


def test_talkative_libraries_log_warnings_alone() -> None:
    with logged(LogLevel.DEBUG) as log:
        for name in ("distributed.scheduler", "sqlalchemy.engine", "asyncio"):
            logger: Any = logging.getLogger(name)
            assert not logger.isEnabledFor(logging.INFO)
        logging.getLogger("robosc_server").debug("said")
    assert [line["event"] for line in log.lines()] == ["said"]


def test_callers_that_go_while_they_are_answered_are_no_errors() -> None:
    grpc_log = logging.getLogger("grpc._cython.cygrpc")
    # Set up twice, as by two servers of one process.
    with logged(LogLevel.INFO), logged(LogLevel.INFO) as log:
        for error in (grpc.aio.InternalError("Failed grpc_call_start_batch"), ValueError("another")):
            try:
                raise error
            except Exception:
                grpc_log.exception("raised in core by servicer method [/s/M]")
        grpc_log.error("without an exception")
    assert [line.get("error") or line["event"] for line in log.lines()] == ["ValueError", "without an exception"]


def test_random_request_ids_differ() -> None:
    # More than are drawn at once.
    ids = [request_id_of(()) for _ in range(2000)]
    assert len(set(ids)) == len(ids)
    assert all(len(identity) == 16 and set(identity) <= set("0123456789abcdef") for identity in ids)
