"""The parts of `soak/outgrow.py` that judge: its ledger finds every kind of fault, and jobs are the same again."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from robosc_client import Check, Generate, Synthesize
from support.job_ledger import Ledger, StoredJob
from support.job_mix import MixedJob, digest, mixed_job, right_digest
from support.outgrown_site import cluster_commands, proxy_configuration

SOUND = StoredJob("a", "1-0-0", "succeeded", "", 1, 1)


def ledger() -> Ledger:
    """A ledger of one job whose result is right."""
    made = Ledger(results={"a": "right"}, expected={"a": "right"})
    made.accept("1-0-0", "a")
    return made


def test_a_sound_run_has_no_problem() -> None:
    made = ledger()
    counted = made.counted([SOUND])
    assert made.problems == []
    assert (counted["accepted"], counted["answered"], counted["right"], counted["wrong"]) == (1, 1, 1, 0)
    assert (counted["lost"], counted["ended_twice"], counted["attempts"]) == (0, 0, {"1": 1})


@pytest.mark.parametrize(
    ("stored", "count", "words"),
    [
        ([], "lost", "was accepted and is lost"),
        ([replace(SOUND, state="running", ends=0)], "lost", "was accepted and is lost"),
        ([replace(SOUND, ends=2)], "ended_twice", "has ended more than once"),
        ([replace(SOUND, ends=0)], "contradicted", "no end was noted"),
        ([replace(SOUND, state="failed", reason="WORKER_DIED")], "contradicted", "another end"),
        ([SOUND, replace(SOUND, id="b", key="1-0-1")], "not_asked_for", "never answered for"),
    ],
)
def test_what_the_database_says_is_compared(stored: list[StoredJob], count: str, words: str) -> None:
    made = ledger()
    assert made.counted(stored)[count] == 1
    assert any(words in problem for problem in made.problems)


def test_a_wrong_result_is_found() -> None:
    made = ledger()
    made.expected["a"] = "other"
    assert made.counted([SOUND])["wrong"] == 1
    assert made.problems == ["job a has a wrong result"]


def test_a_caller_who_was_never_answered_is_found() -> None:
    made = ledger()
    made.results.clear()
    assert made.counted([SOUND])["never_answered"] == 1
    assert made.problems == ["job a has ended and its caller was never answered"]


def test_a_key_has_one_job() -> None:
    made = ledger()
    made.accept("1-0-0", "a")
    assert made.problems == []
    made.accept("1-0-0", "b")
    assert made.problems == ["the key 1-0-0 was answered with two jobs: a and b"]


@pytest.mark.parametrize(("reason", "is_fault"), [("WORKER_DIED", False), ("INTERNAL_FAULT", True)])
def test_a_job_that_was_given_up_is_no_fault_and_any_other_failure_is(reason: str, is_fault: bool) -> None:
    made = Ledger(failures={"a": reason})
    made.accept("1-0-0", "a")
    counted = made.counted([replace(SOUND, state="failed", reason=reason)])
    assert counted["given_up" if not is_fault else "failed"] == {reason: 1}
    assert bool(made.problems) == is_fault


def test_jobs_are_the_same_again_and_of_every_kind_and_size() -> None:
    jobs = [mixed_job(7, number) for number in range(300)]
    assert jobs[:20] == [mixed_job(7, number) for number in range(20)]
    assert {type(job.task) for job in jobs} == {Check, Generate, Synthesize}
    assert {job.size for job in jobs} == {"small", "medium", "large"}
    # A few have the task of an earlier one, all others one of their own.
    assert 270 < len({str(job.task) for job in jobs}) < 300


def test_the_right_result_of_another_model_is_another_one() -> None:
    small = [job for job in map(_job, range(40)) if job.size == "small" and isinstance(job.task, Synthesize)][:4]
    assert len({right_digest(job.task) for job in small}) == 4
    assert digest(b"a", b"bc") != digest(b"ab", b"c")


def _job(number: int) -> MixedJob:
    return mixed_job(3, number)


def test_the_proxy_admits_all_watches_of_one_connection() -> None:
    text = proxy_configuration(1, [2, 3])
    assert "server server1 127.0.0.1:3 check" in text
    assert "tune.h2.max-concurrent-streams 2000" in text


def test_nobody_elsewhere_reaches_the_cluster(tmp_path: Path) -> None:
    for command in cluster_commands(tmp_path, 8786):
        given = dict(pairwise(command))
        assert (given["--host"], given["--dashboard-address"]) == ("127.0.0.1", "127.0.0.1:0")
