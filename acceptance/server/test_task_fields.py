"""Time that the server needs to see that a request would take long to parse."""

import time
from typing import Any

import pytest

from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.fields import has_few_fields, nested_of
from robosc_server.tasks.requests import RequestLimits

LIMITS = RequestLimits()
EMPTY_FILES = pb.CheckRequest(bundle=pb.Bundle(libraries=[pb.SourceFile() for _ in range(500_000)])).SerializeToString()


@pytest.mark.real_time
def test_looking_takes_less_time_than_parsing() -> None:
    nested = nested_of(pb.CheckRequest)

    def seconds(work: Any) -> float:
        begun_s = time.process_time()
        work()
        return time.process_time() - begun_s

    looks = min(seconds(lambda: has_few_fields(EMPTY_FILES, nested, LIMITS.fields)) for _ in range(5))
    parses = min(seconds(lambda: pb.CheckRequest.FromString(EMPTY_FILES)) for _ in range(5))
    assert looks < parses / 2, (looks, parses)
