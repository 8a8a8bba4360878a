"""Form of lines of the log, and content that never stands in them."""

import time

import pytest

from robosc_server.operations.worker_output import loggable_fields


@pytest.mark.real_time
@pytest.mark.parametrize(
    "words", ["\n" * 60_000, " " * 60_000, '  File "' * 8_000, "a." * 30_000, '  File "/robosc/' * 4_000]
)
def test_a_workers_words_are_looked_through_in_no_time(words: str) -> None:
    begun_s = time.process_time()
    loggable_fields(words)
    assert time.process_time() - begun_s < 1.0
