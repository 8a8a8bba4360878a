"""Count of the fields of a serialized message, before it is parsed.

A megabyte of empty files is half a million messages: the parser takes a tenth of a second for them, though their
bytes are within every limit. The count reads the encoding itself (protobuf.dev: Encoding), and stops at the limit.
"""

from typing import Any

_VARINT, _FIXED_64, _DELIMITED, _BEGIN_GROUP, _END_GROUP, _FIXED_32 = range(6)
_VARINT_BYTES = 10
_NESTING = 100
_MORE = 0x80
"""The bit of a byte that another one of the same number follows."""

type Nested = dict[int, Nested]
"""By number of a field that is a message: the same of that message."""


def nested_of(message_type: Any) -> Nested:
    """Return the fields of a message that are messages.

    Args:
        message_type: Class of the message.
    """
    return _nested(message_type.DESCRIPTOR, {})


def _nested(descriptor: Any, made: dict[str, Nested]) -> Nested:
    found = made.get(descriptor.full_name)
    if found is None:
        found = made[descriptor.full_name] = {}
        for field in descriptor.fields:
            if field.message_type is not None:
                found[field.number] = _nested(field.message_type, made)
    return found


def has_few_fields(content: bytes, nested: Nested, limit: int) -> bool:
    """Return True if a message has no more fields than it may have, those of messages in it included.

    Takes a time in proportion to the limit, however long the message is.

    Args:
        content: The serialized message. If it cannot be parsed, the result has no meaning: the parser reports that.
        nested: Fields of the message that are messages.
        limit: Fields that it may have.
    """
    place, end = 0, len(content)
    around: list[tuple[int, Nested]] = []
    groups = 0
    try:
        for _ in range(limit):
            while place >= end:
                if not around:
                    return True
                end, nested = around.pop()
            # Most numbers have one byte, and a call for each would take twice the time of all the rest.
            tag, place = content[place], place + 1
            if tag >= _MORE:
                tag, place = _varint(content, place - 1)
            kind = tag & 7
            if kind == _DELIMITED:
                size, place = content[place], place + 1
                if size >= _MORE:
                    size, place = _varint(content, place - 1)
                # The parser knows no field of a group, and reads none of the messages that its content might be.
                inner = None if groups else nested.get(tag >> 3)
                if inner is None:
                    place += size
                elif size:
                    around.append((end, nested))
                    end, nested = place + size, inner
            elif kind == _VARINT:
                if content[place] < _MORE:
                    place += 1
                else:
                    _, place = _varint(content, place)
            elif kind == _FIXED_64:
                place += 8
            elif kind == _FIXED_32:
                place += 4
            else:
                # Groups are deprecated; the parser refuses deep nesting and unbalanced ends.
                groups += 1 if kind == _BEGIN_GROUP else -1
                if not 0 <= groups <= _NESTING:
                    return True
    except (IndexError, ValueError):
        return True
    return place >= end and all(place >= outer for outer, _ in around)


def _varint(content: bytes, place: int) -> tuple[int, int]:
    """Return the number at a place, and the place behind it."""
    number = 0
    for shift in range(0, 7 * _VARINT_BYTES, 7):
        byte, place = content[place], place + 1
        number |= (byte & 0x7F) << shift
        if byte < _MORE:
            return number, place
    raise ValueError("a number of more than ten bytes")
