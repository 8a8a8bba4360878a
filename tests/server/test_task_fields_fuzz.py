"""The count of fields against the parser of protobuf itself, on random messages and on random bytes.

The twin has the parser read every message as one without known fields: it keeps each field as it was sent, in order,
repetitions included, which a parser of the real type would merge.
"""

from functools import cache
from typing import Any

from google.protobuf.descriptor import Descriptor, FieldDescriptor
from google.protobuf.empty_pb2 import Empty
from google.protobuf.message import DecodeError
from google.protobuf.message_factory import GetMessageClass
from google.protobuf.unknown_fields import UnknownFieldSet
from hypothesis import given
from hypothesis import strategies as st

from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.fields import Nested, has_few_fields, nested_of
from support.requests import varint

TYPES = tuple(
    GetMessageClass(descriptor)
    for module in (pb, jobs_pb2)
    for name, descriptor in module.DESCRIPTOR.message_types_by_name.items()
    if name.endswith("Request")
)
_DELIMITED, _GROUP = 2, 3


def fields_of(content: bytes, nested: Nested) -> int:
    """Return the number of fields as the parser finds them; the begin and the end of a group count one each.

    Raises:
        DecodeError: It is no message.
    """
    count = 0
    found: Any = UnknownFieldSet(Empty.FromString(content))
    for field in found:
        count += 1
        if field.wire_type == _GROUP:
            count += in_group(field.data)
        elif field.wire_type == _DELIMITED and field.field_number in nested:
            count += fields_of(field.data, nested[field.field_number])
    return count


def in_group(fields: Any) -> int:
    return 1 + sum(1 + (in_group(field.data) if field.wire_type == _GROUP else 0) for field in fields)


def agrees(content: bytes, nested: Nested) -> bool:
    """Compare the two; return True if the content is a message."""
    try:
        count = fields_of(content, nested)
    except DecodeError:
        # The answer means nothing, but there is one.
        has_few_fields(content, nested, 7)
        return False
    assert has_few_fields(content, nested, count)
    assert has_few_fields(content, nested, count + 5)
    assert not count or not has_few_fields(content, nested, count - 1)
    return True


@cache
def messages(descriptor: Descriptor, depth: int) -> st.SearchStrategy[Any]:
    """Messages of a type, with messages in them down to a depth."""
    values = {
        field.name: _values(field, depth) for field in descriptor.fields if depth > 0 or field.message_type is None
    }
    made = st.fixed_dictionaries({}, optional=values)
    return made.map(lambda found: _message(GetMessageClass(descriptor), found))


def _message(kind: Any, values: dict[str, Any]) -> Any:
    message = kind()
    for name, value in values.items():
        field = kind.DESCRIPTOR.fields_by_name[name]
        if field.is_repeated:
            getattr(message, name).extend(value)
        elif field.message_type is not None:
            getattr(message, name).CopyFrom(value)
        else:
            setattr(message, name, value)
    return message


def _values(field: FieldDescriptor, depth: int) -> st.SearchStrategy[Any]:
    single: st.SearchStrategy[Any]
    if field.message_type is not None:
        single = st.deferred(lambda: messages(field.message_type, depth - 1))
    elif field.enum_type is not None:
        single = st.sampled_from([value.number for value in field.enum_type.values])
    else:
        single = {
            FieldDescriptor.CPPTYPE_BOOL: st.booleans(),
            FieldDescriptor.CPPTYPE_STRING: (
                st.binary(max_size=9) if field.type == FieldDescriptor.TYPE_BYTES else st.text(max_size=9)
            ),
            FieldDescriptor.CPPTYPE_INT32: st.integers(-(2**31), 2**31 - 1),
            FieldDescriptor.CPPTYPE_INT64: st.integers(-(2**63), 2**63 - 1),
            FieldDescriptor.CPPTYPE_UINT32: st.integers(0, 2**32 - 1),
            FieldDescriptor.CPPTYPE_UINT64: st.integers(0, 2**64 - 1),
            FieldDescriptor.CPPTYPE_DOUBLE: st.floats(allow_nan=False),
            FieldDescriptor.CPPTYPE_FLOAT: st.floats(width=32, allow_nan=False),
        }[field.cpp_type]
    return st.lists(single, max_size=3) if field.is_repeated else single


@st.composite
def sent(draw: st.DrawFn) -> tuple[Any, bytes]:
    """A type of request and a message of that type, serialized."""
    kind = draw(st.sampled_from(TYPES))
    return kind, draw(messages(kind.DESCRIPTOR, 4)).SerializeToString()


# Pieces of the encoding, right and wrong ones: tags with a kind, lengths, numbers of too many bytes.
PIECES = st.one_of(
    st.builds(lambda number, kind: varint(number << 3 | kind), st.integers(0, 20), st.integers(0, 7)),
    st.builds(lambda number, kind: varint(number << 3 | kind), st.integers(2**28, 2**34), st.integers(0, 5)),
    st.integers(0, 40).map(lambda number: bytes([number])),
    st.integers(1, 11).map(lambda size: b"\x80" * size + b"\x01"),
    st.binary(max_size=12),
    st.just(b"\xff" * 11),
)
BYTES = st.lists(PIECES, max_size=30).map(b"".join)


@given(sent())
def test_messages_of_every_request(made: tuple[Any, bytes]) -> None:
    kind, content = made
    assert agrees(content, nested_of(kind))


@given(sent(), st.data())
def test_damaged_messages(made: tuple[Any, bytes], data: st.DataObject) -> None:
    kind, content = made
    place = data.draw(st.integers(0, len(content)))
    width = data.draw(st.integers(0, 3))
    damaged = content[:place] + data.draw(BYTES) + content[place + width :]
    is_message = agrees(damaged, nested_of(kind))
    # The twin accepts all that the parser of the type accepts, apart from texts.
    try:
        kind.FromString(damaged)
    except DecodeError:
        return
    assert is_message


@given(BYTES, st.sampled_from(TYPES))
def test_bytes(content: bytes, kind: Any) -> None:
    agrees(content, nested_of(kind))


BOXES = st.recursive(
    st.builds(lambda number: varint(number << 3) + b"\x01", st.integers(1, 9)) | BYTES,
    lambda inner: st.one_of(
        st.builds(
            lambda number, content: varint(number << 3 | _DELIMITED) + varint(len(content)) + content,
            st.integers(1, 4),
            st.lists(inner, max_size=4).map(b"".join),
        ),
        st.builds(
            lambda number, content: varint(number << 3 | 3) + content + varint(number << 3 | 4),
            st.integers(1, 4),
            st.lists(inner, max_size=4).map(b"".join),
        ),
    ),
    max_leaves=20,
)


@given(st.lists(BOXES, max_size=5).map(b"".join), st.sampled_from(TYPES))
def test_messages_and_groups_in_each_other(content: bytes, kind: Any) -> None:
    agrees(content, nested_of(kind))


def test_a_group_hides_nothing_behind_it() -> None:
    """Bytes in a group that are no message are none of the parser's concern; what follows is."""
    group = b"\x9b\x06" + b"\x0a\x0b" + b"\xff" * 11 + b"\x9c\x06"
    costly = group + pb.CheckRequest(bundle=pb.Bundle(libraries=[pb.SourceFile()] * 500)).SerializeToString()
    assert len(pb.CheckRequest.FromString(costly).bundle.libraries) == 500
    assert not has_few_fields(costly, nested_of(pb.CheckRequest), 100)
    assert agrees(costly, nested_of(pb.CheckRequest))
