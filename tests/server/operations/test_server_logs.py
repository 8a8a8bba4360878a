"""What lines of the log look like, and what never stands in them."""

import json
import logging
from pathlib import Path
from typing import Any

import pytest
import structlog
from hypothesis import given
from hypothesis import strategies as st

from robosc_server.failures import for_callers
from robosc_server.operations.logs import tell_fault
from robosc_server.operations.request_ids import REQUEST_ID
from robosc_server.operations.settings import LogFormat, LogLevel
from robosc_server.tasks.task import Failure, Reason
from support.small_server import logged

MARKER = "a_word_of_the_model"


def raised() -> ValueError:
    try:
        raise ValueError(MARKER)
    except ValueError as error:
        return error


@pytest.mark.parametrize("form", list(LogFormat))
def test_lines_of_others_go_the_same_way(form: LogFormat) -> None:
    with logged(LogLevel.INFO, form) as log:
        token = REQUEST_ID.set("this-request")
        try:
            logging.getLogger("others.part").warning("%s of %s", "some", "words")
            structlog.get_logger().info("ours", number=3)
            logging.getLogger("others.part").debug("too little")
        finally:
            REQUEST_ID.reset(token)
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
            # To ours alone: pytest keeps what is logged, and cannot send half a character from one process to another.
            record = logging.LogRecord("others", logging.WARNING, __file__, 1, "\udfff", None, None)
            for handler in logging.getLogger().handlers:
                if isinstance(handler.formatter, structlog.stdlib.ProcessorFormatter):
                    handler.handle(record)
        assert len(log.text.splitlines()) == 2


@pytest.mark.parametrize("form", list(LogFormat))
def test_an_exception_is_told_without_its_words_above_debug(form: LogFormat) -> None:
    def told(level: LogLevel) -> str:
        with logged(level, form) as log:
            logging.getLogger("others").error("failed", exc_info=raised())
            structlog.get_logger().error("failed", exc_info=raised())
            tell_fault(raised())
            tell_fault(f'Traceback:\n  File "x.py", line 3, in part\n    code({MARKER})\npart.OddError: {MARKER}\n')
        return log.text

    quiet = told(LogLevel.INFO)
    assert MARKER not in quiet
    assert quiet.count("ValueError") == 3
    assert "part.OddError" in quiet
    assert "x.py:3 part" in quiet
    assert MARKER in told(LogLevel.DEBUG)


def test_what_the_system_says_is_told() -> None:
    with logged(LogLevel.INFO) as log:
        try:
            Path("/nowhere/at/all").read_text()
        except OSError as error:
            structlog.get_logger().error("failed", exc_info=error)
    assert log.lines()[0]["cause"] == "No such file or directory"


def test_how_a_worker_died_is_logged_and_an_exception_in_it_is_not() -> None:
    with logged(LogLevel.INFO) as log:
        died = for_callers(Failure(Reason.WORKER_DIED, "it died", "ended by signal 11"))
        fault = for_callers(Failure(Reason.INTERNAL_FAULT, "a fault", f"Traceback\nKeyError: {MARKER}"))
    assert "ended by signal 11" in log.text
    assert MARKER not in log.text
    assert [line["reason"] for line in log.lines("fault")] == ["WORKER_DIED", "INTERNAL_FAULT"]
    for line, error in zip(log.lines("fault"), (died, fault), strict=True):
        assert line["fault"] in error.message


def test_set_up_twice_each_line_is_written_once() -> None:
    with logged(LogLevel.INFO) as first, logged(LogLevel.INFO) as second:
        logging.getLogger("others").warning("once")
    assert (first.text, len(second.text.splitlines())) == ("", 1)


def test_talkative_libraries_tell_warnings_alone() -> None:
    with logged(LogLevel.DEBUG) as log:
        for name in ("distributed.scheduler", "sqlalchemy.engine", "asyncio"):
            logger: Any = logging.getLogger(name)
            assert not logger.isEnabledFor(logging.INFO)
        logging.getLogger("robosc_server").debug("told")
    assert [line["event"] for line in log.lines()] == ["told"]
