"""Warnings at the start of a server of what others on the network could read or change."""

import logging

import pytest

from robosc_server.application import StartError
from robosc_server.operations.exposure import database_exposure, tracing_exposure
from support.job_workers import StartedWorkers
from support.service import served


@pytest.mark.parametrize(
    ("url", "is_exposed"),
    [
        (None, False),
        ("sqlite:////var/lib/jobs", False),
        ("postgresql://u:p@127.0.0.1:1/n", False),
        ("postgresql://u:p@localhost/n", False),
        ("postgresql://u:p@/n?host=/run/postgresql", False),
        ("postgresql://u:p@db.invalid/n?sslmode=verify-full", False),
        ("postgresql://u:p@db.invalid/n", True),
        ("postgresql+psycopg://u:p@db.invalid/n?sslmode=require", True),
        ("postgresql://u:p@/n?host=db.invalid", True),
        ("postgresql://u:p@/n?host=127.0.0.1&host=db.invalid", True),
    ],
)
def test_a_database_whose_certificate_nobody_checks(url: str | None, is_exposed: bool) -> None:
    assert (database_exposure(url) is not None) == is_exposed


@pytest.mark.parametrize(
    ("endpoint", "is_exposed"),
    [
        (None, False),
        ("http://127.0.0.1:4317", False),
        ("http://[::1]:4317", False),
        ("https://collector.invalid:4317", False),
        ("http://collector.invalid:4317", True),
        ("http://collector.invalid:4317/", True),
    ],
)
def test_traces_that_leave_the_machine_without_tls(endpoint: str | None, is_exposed: bool) -> None:
    assert (tracing_exposure(endpoint) is not None) == is_exposed


def test_a_server_says_at_its_start_what_others_could_read(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    with served(given_workers=StartedWorkers(), tracing_endpoint="http://collector.invalid:4317"):
        pass
    assert [text for text in caplog.messages if "use https" in text] != []
    assert not any("sslmode" in text for text in caplog.messages)
    caplog.clear()
    with (
        pytest.raises(StartError),
        served(given_workers=StartedWorkers(), database_url="postgresql://u:secret@db.invalid:1/n"),
    ):
        pass
    assert any("sslmode=verify-full" in text for text in caplog.messages)
    assert not any("secret" in text for text in caplog.messages)
