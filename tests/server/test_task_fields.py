"""Counting the fields of serialized messages against messages that are made field by field."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.jobs.convert import submission
from robosc_server.tasks.fields import Nested, has_few_fields, nested_of
from robosc_server.tasks.requests import RequestLimits, accept_request
from robosc_server.tasks.task import Reason, RefusedError, TaskKind
from support.requests import varint

LIMITS = RequestLimits()
LOOP: Nested = {}
LOOP |= {1: LOOP, 200: LOOP, 2**29 - 1: LOOP}
"""Of a message that may hold itself."""


def delimited(number: int, content: bytes) -> bytes:
    return varint(number << 3 | 2) + varint(len(content)) + content


def fixed(number: int, wire_type: int, content: bytes) -> bytes:
    return varint(number << 3 | wire_type) + content


NUMBERS = st.integers(1, 20)
PLAIN = st.one_of(
    st.builds(fixed, NUMBERS, st.just(0), st.integers(0, 2**64 - 1).map(varint)),
    st.builds(fixed, NUMBERS, st.just(1), st.binary(min_size=8, max_size=8)),
    st.builds(fixed, NUMBERS, st.just(5), st.binary(min_size=4, max_size=4)),
    st.builds(delimited, st.sampled_from([2, 17]), st.binary(max_size=200)),
).map(lambda content: (content, 1))


def joined(parts: list[tuple[bytes, int]]) -> tuple[bytes, int]:
    return b"".join(content for content, _ in parts), sum(count for _, count in parts)


def inside(number: int, message: tuple[bytes, int]) -> tuple[bytes, int]:
    return delimited(number, message[0]), message[1] + 1


MESSAGES = st.lists(
    st.recursive(
        PLAIN,
        lambda fields: st.builds(inside, st.sampled_from(list(LOOP)), st.lists(fields, max_size=4).map(joined)),
        max_leaves=30,
    ),
    max_size=6,
).map(joined)


@given(MESSAGES)
def test_the_count_is_that_of_the_fields_it_was_made_of(message: tuple[bytes, int]) -> None:
    content, count = message
    assert has_few_fields(content, LOOP, count)
    assert has_few_fields(content, LOOP, count + 7)
    if count:
        assert not has_few_fields(content, LOOP, count - 1)


@given(st.binary(max_size=300))
def test_bytes_that_are_no_message_are_left_to_the_parser(content: bytes) -> None:
    has_few_fields(content, LOOP, 5)
    has_few_fields(b"\xff" * 300 + content, LOOP, 5)


def test_which_fields_are_messages() -> None:
    found = nested_of(jobs_pb2.SubmitJobRequest)
    task = found[jobs_pb2.SubmitJobRequest.DESCRIPTOR.fields_by_name["task"].number]
    check = task[jobs_pb2.Task.DESCRIPTOR.fields_by_name["check"].number]
    assert sorted(check[1]) == [1, 2, 4]
    assert check[1][1] == {}


def libraries(count: int, **texts: str) -> Any:
    files = [pb.SourceFile(name=f"{number}.rscd", **texts) for number in range(count)]
    return pb.CheckRequest(bundle=pb.Bundle(main=pb.SourceFile(name="robot.rscd"), libraries=files))


def test_as_much_as_there_may_be_is_accepted() -> None:
    limit = LIMITS.bundle_files
    files = [pb.SourceFile(name=f"{number}.props", text="x" * 10) for number in range(limit)]
    request = pb.VerifyRequest(
        bundle=libraries(limit - 1, text="y" * 10).bundle, properties=["z" * 9] * limit, property_files=files
    )
    request.bundle.searched.extend(["w" * 9] * limit)
    request.options.engine = "auto"
    assert accept_request(TaskKind.VERIFY, request.SerializeToString(), LIMITS)


EMPTY_FILES = delimited(1, delimited(2, b"") * 500_000)
COSTLY = {
    "files": EMPTY_FILES,
    "places": delimited(1, delimited(3, b"") * 500_000),
    "bundles": delimited(1, b"") * 500_000,
    "names": delimited(1, delimited(2, delimited(1, b"a")) * 200_000),
    "groups": b"\x9b\x06\x9c\x06" * 250_000,
    "unknown": b"\x98\x06\x01" * 300_000,
}


@pytest.mark.parametrize("what", COSTLY)
@pytest.mark.parametrize("submits", [False, True])
def test_what_would_take_long_to_parse_is_not_parsed(what: str, submits: bool) -> None:
    request = COSTLY[what]
    assert len(request) < LIMITS.request_bytes
    with pytest.raises(RefusedError, match="more than 8100 fields") as caught:
        if submits:
            submission(delimited(1, delimited(1, request)), LIMITS)
        else:
            accept_request(TaskKind.CHECK, request, LIMITS)
    assert caught.value.reason is Reason.REQUEST_TOO_LARGE


def test_a_submission_that_is_none() -> None:
    for content in (b"\xff", b"\xff" * 20_000, delimited(1, b"\xff" * 20_000)):
        with pytest.raises(RefusedError) as caught:
            submission(content, LIMITS)
        assert caught.value.reason is Reason.MALFORMED_REQUEST
    with pytest.raises(RefusedError, match="accepts at most") as caught:
        submission(b"\0" * (LIMITS.submission_bytes + 1), LIMITS)
    assert caught.value.reason is Reason.REQUEST_TOO_LARGE
