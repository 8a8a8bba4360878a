"""
Conversion between the model's data and ROS messages.

Every field is checked at start-up, every value before it is sent.

ROS messages do not check their values: a number that is too large is wrapped, and None becomes
garbage. So each field that is sent gets a conversion of its own, by the message's list of fields.

A *shape* is what the model says about a datum: `boolean`, `integer`, `double` or `string`; a dict
of shapes by property; a list with the shape of an array's elements; or None for no data.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Callable
import importlib
import re
from typing import Any, NamedTuple

from robosc.execution.runtime.protocol import DataDoesNotFit

MAXIMUM_FLOAT32 = 3.4028234663852886e38
_INFINITY = float('inf')
_INTEGER = re.compile(r'(u?)int(8|16|32|64)\Z')
_SEQUENCE = re.compile(r'sequence<(?P<element>.+?)(, [0-9]+)?>\Z|(?P<fixed>.+)\[[0-9]+\]\Z')
_NESTED = re.compile(r'[a-z0-9_]+/[A-Za-z0-9]+\Z')
_STRING = re.compile(r'w?string(<(?P<bound>[0-9]+)>)?\Z')

# Types of fields as genpy, of ROS 1, calls them, in the words of ROS 2. Its own times and
# durations count as messages.
_GENPY_ARRAY = re.compile(r'(?P<element>[^\[]+)\[(?P<length>[0-9]*)\]\Z')

_GENPY_TYPES = {
    'bool': 'boolean',
    'byte': 'int8',
    'char': 'uint8',
    'float32': 'float',
    'float64': 'double',
    'time': 'genpy/Time',
    'duration': 'genpy/Duration',
    'Header': 'std_msgs/Header',
}
_GENPY_OWN = {
    'Time': {'secs': 'uint32', 'nsecs': 'uint32'},
    'Duration': {'secs': 'int32', 'nsecs': 'int32'},
}


class Topic(NamedTuple):
    """
    A topic of the node.

    :ivar identifier: Its name in the model.
    :ivar package: Package of its message type.
    :ivar type_name: Name of its message type.
    :ivar published: Messages of the model that go out on it.
    :ivar received: Messages of the model that come in on it.
    :ivar publisher: Quality of service and depth of what goes out.
    :ivar subscription: Quality of service and depth of what comes in.
    :ivar frames: Frame of each message that goes out with its header filled in.
    """

    identifier: str
    package: str
    type_name: str
    published: tuple[str, ...]
    received: tuple[str, ...]
    publisher: Any
    subscription: Any
    frames: dict[str, str]


class Server(NamedTuple):
    """
    A service or an action that the node asks.

    :ivar name: Its name in the model.
    :ivar is_action: True for an action, False for a service.
    :ivar identifier: Service or action name in the model.
    :ivar package: Package of its type.
    :ivar type_name: Name of its type.
    :ivar frame: Frame of the header of its requests, or None.
    :ivar shares: Name of the first one of its kind with the same identifier, if it is another.
    """

    name: str
    is_action: bool
    identifier: str
    package: str
    type_name: str
    frame: str | None
    shares: str | None = None

    @property
    def subject(self) -> str:
        """Return it in words."""
        return '{} {}'.format('action' if self.is_action else 'service', self.name)


class SetupError(Exception):
    """The model and the installed message types do not fit together; says what and where."""


def load_message(package: str, name: str) -> Any:
    """
    Return the class of a message type.

    :raises SetupError: It cannot be imported.
    """
    return _load(package, 'msg', 'message', name)


def load_server(server: Server) -> Any:
    """
    Return the class of a service's or action's type.

    :raises SetupError: It cannot be imported.
    """
    if server.is_action:
        return _load(server.package, 'action', 'action', server.type_name)
    return _load(server.package, 'srv', 'service', server.type_name)


def _load(package: str, folder: str, kind: str, name: str) -> Any:
    try:
        return getattr(importlib.import_module(f'{package}.{folder}'), name)
    except (ImportError, AttributeError) as error:
        raise SetupError(
            f'the {kind} type {package}/{folder}/{name} is not installed; build {package} and '
            f'source its workspace'
        ) from error


def require_header(message_class: Any, subject: str) -> None:
    """
    Do nothing if a message has a header that can be stamped.

    :raises SetupError: It has none.
    """
    if fields_of(message_class).get('header') != 'std_msgs/Header':
        raise SetupError(
            f'{subject}: it is stamped, but {message_name(message_class)} has no header of type '
            f'std_msgs/Header'
        )


def headers_of(message: Any, subject: str) -> list[Any]:
    """
    Return the headers to be stamped in the request of an action.

    Its own, else those of its fields.

    :raises SetupError: There is none.
    """
    fields = fields_of(message)
    if fields.get('header') == 'std_msgs/Header':
        return [message.header]
    found = []
    for name, field_type in fields.items():
        inner = getattr(message, name)
        if _NESTED.match(field_type) and fields_of(inner).get('header') == 'std_msgs/Header':
            found.append(inner.header)
    if not found:
        raise SetupError(
            f'{subject}: it is stamped, but neither {message_name(type(message))} nor a field has '
            f'a header'
        )
    return found


def fields_of(message: Any) -> dict[str, str]:
    """Return the type of each field of a message or of its class, in order."""
    if hasattr(message, 'get_fields_and_field_types'):
        return dict(message.get_fields_and_field_types())
    message_class: Any = message if isinstance(message, type) else type(message)
    if _is_genpy_own(message_class):
        return dict(_GENPY_OWN[message_class.__name__])
    return dict(zip(message_class.__slots__, map(_translated, message_class._slot_types)))


def message_name(message_class: Any) -> str:
    """
    Return a message class as its ROS names it.

    `geometry_msgs/msg/Twist`, in ROS 1 `geometry_msgs/Twist`.
    """
    if hasattr(message_class, 'get_fields_and_field_types'):
        package, folder = message_class.__module__.split('.')[:2]
        return f'{package}/{folder}/{message_class.__name__}'
    if _is_genpy_own(message_class):
        return f'genpy/{message_class.__name__}'
    return str(message_class._type)


def _is_genpy_own(message_class: Any) -> bool:
    return (
        message_class.__module__.split('.')[0] == 'genpy' and message_class.__name__ in _GENPY_OWN
    )


def _translated(slot_type: str) -> str:
    array = _GENPY_ARRAY.match(slot_type)
    if array is None:
        return _GENPY_TYPES.get(slot_type, slot_type)
    element = _GENPY_TYPES.get(array.group('element'), array.group('element'))
    return (
        '{}[{}]'.format(element, array.group('length'))
        if array.group('length')
        else f'sequence<{element}>'
    )


def basic_field(message_class: Any) -> str:
    """
    Return the field that stands for a basic type: `data`, else the only one.

    :raises SetupError: There are several, or none.
    """
    fields = fields_of(message_class)
    if 'data' in fields:
        return 'data'
    if len(fields) == 1:
        return str(next(iter(fields)))
    raise SetupError(
        'the message {} has {}, so a basic type can stand for none of them: '
        'use an object type'.format(
            message_name(message_class),
            'the fields ' + ', '.join(fields) if fields else 'no field',
        )
    )


def check_shape(message_class: Any, shape: Any, subject: str) -> None:
    """
    Do nothing if a message has every field that the model speaks of, with a type that fits.

    :param message_class: The message's class.
    :param shape: Shape of the data in the model.
    :param subject: Subject of the check, for the error message, e.g. `message scan`.
    :raises SetupError: It does not.
    """
    if isinstance(shape, dict):
        _check_object(message_class, shape, subject, ())
    elif shape is not None:
        name = basic_field(message_class)
        field_type = fields_of(message_class)[name]
        _check_field(field_type, shape, subject, message_class, (name,))


def _check_object(
    message_class: Any, shape: dict[str, Any], subject: str, path: tuple[str, ...]
) -> None:
    fields = fields_of(message_class)
    for name, inner in shape.items():
        if name not in fields:
            raise SetupError(
                "{}: {} has no field '{}'; it has {}".format(
                    subject,
                    message_name(message_class),
                    '.'.join((*path, name)),
                    ', '.join(fields) or 'none',
                )
            )
        _check_field(fields[name], inner, subject, message_class, (*path, name))


def _check_field(
    field_type: str, shape: Any, subject: str, message_class: Any, path: tuple[str, ...]
) -> None:
    array = _SEQUENCE.match(field_type)
    if isinstance(shape, list):
        if array is None:
            raise _misfit(field_type, 'an array', subject, message_class, path)
        _check_field(
            array.group('element') or array.group('fixed'), shape[0], subject, message_class, path
        )
    elif isinstance(shape, dict):
        if '/' not in field_type or array is not None:
            raise _misfit(field_type, 'an object', subject, message_class, path)
        _check_object(_nested_class(field_type), shape, subject, path)
    elif shape is not None and not _fits(field_type, shape):
        raise _misfit(field_type, shape, subject, message_class, path)


def _misfit(
    field_type: str, shape: str, subject: str, message_class: Any, path: tuple[str, ...]
) -> SetupError:
    return SetupError(
        "{}: the field '{}' of {} is {}, in the model it is {}".format(
            subject, '.'.join(path), message_name(message_class), field_type, shape
        )
    )


def _nested_class(field_type: str) -> Any:
    package, _, name = field_type.partition('/')
    return (
        getattr(importlib.import_module('genpy'), name)
        if package == 'genpy'
        else load_message(package, name)
    )


def _fits(field_type: str, shape: str) -> bool:
    if shape == 'boolean':
        return field_type == 'boolean'
    if shape == 'string':
        return _STRING.match(field_type) is not None
    if shape == 'double':
        return field_type in ('float', 'double')
    return _INTEGER.match(field_type) is not None


def converter(field_type: str, shape: str) -> Callable[[Any], Any]:
    """
    Return the function that turns a value of the model into one of a field.

    It raises DataDoesNotFit for a value that the field cannot hold, NaN and infinities included.
    """
    if shape == 'boolean':
        return _to_boolean
    if shape == 'string':
        match = _STRING.match(field_type)
        return (
            _to_string(int(match.group('bound')))
            if match and match.group('bound')
            else _to_any_string
        )
    if shape == 'double':
        return _to_float(MAXIMUM_FLOAT32 if field_type == 'float' else None)
    match = _INTEGER.match(field_type)
    if match is None:
        raise SetupError(f'no integer fits into a field of type {field_type}')
    bits = int(match.group(2))
    return (
        _to_integer(0, 2**bits - 1)
        if match.group(1)
        else _to_integer(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    )


def _to_boolean(value: Any) -> bool:
    if value is True or value is False:
        return bool(value)
    raise DataDoesNotFit(f'{value!r} is not a boolean')


def _to_any_string(value: Any) -> str:
    if isinstance(value, str):
        return value
    raise DataDoesNotFit(f'{value!r} is not a string')


def _to_string(bound: int) -> Callable[[Any], str]:
    def convert(value: Any) -> str:
        text = _to_any_string(value)
        if len(text.encode('utf-8', 'surrogatepass')) > bound:
            raise DataDoesNotFit(f'a string of more than {bound} bytes')
        return text

    return convert


def _to_float(limit: float | None) -> Callable[[Any], float]:
    greatest = limit if limit is not None else _INFINITY

    def convert(value: Any) -> float:
        if not isinstance(value, (int, float)) or value is True or value is False:
            raise DataDoesNotFit(f'{value!r} is not a number')
        number = float(value)
        # False for NaN, too.
        if -greatest <= number <= greatest and -_INFINITY < number < _INFINITY:
            return number
        raise DataDoesNotFit(f'{number!r} does not fit into the field')

    return convert


def _to_integer(low: int, high: int) -> Callable[[Any], int]:
    def convert(value: Any) -> int:
        if not isinstance(value, int) or value is True or value is False:
            raise DataDoesNotFit(f'{value!r} is not an integer')
        if low <= value <= high:
            return value
        raise DataDoesNotFit(f'{value} is outside {low}..{high}')

    return convert


class _Slot(NamedTuple):
    """A field that requests set: where it is, how a value gets there, and its default."""

    path: tuple[str, ...]
    owner: Any
    field: str
    convert: Callable[[Any], Any]
    default: Any


class Sender:
    """
    The one message object of a communication, filled anew for each request.

    :param message_class: The message's class.
    :param shape: Shape of the data in the model.
    :param paths: Every property that some request sets; the empty path for a basic type.
    :param subject: Subject of the message, for error messages.
    :ivar message: The message.
    :ivar is_default: True if it is the all-default one.
    :raises SetupError: The message does not fit the model.
    """

    def __init__(
        self, message_class: Any, shape: Any, paths: tuple[tuple[str, ...], ...], subject: str
    ) -> None:
        check_shape(message_class, shape, subject)
        self.message = message_class()
        self.is_default = True
        self._slots: list[_Slot] = [_slot(self.message, shape, path) for path in paths]

    def fill(self, data: Any) -> None:
        """
        Put data into the message; what it does not mention gets its default.

        :raises DataDoesNotFit: A value does not fit its field.
        """
        is_default = True
        for path, owner, field, convert, default in self._slots:
            value = _part(data, path)
            if value is None:
                setattr(owner, field, default)
            else:
                try:
                    converted = convert(value)
                except DataDoesNotFit as error:
                    raise DataDoesNotFit('{}: {}'.format('.'.join(path) or field, error)) from None
                setattr(owner, field, converted)
                is_default = is_default and converted == default
        self.is_default = is_default


def _part(data: Any, path: tuple[str, ...]) -> Any:
    """Return the part of nested data at a path; None where it is not given."""
    for name in path:
        if data is None:
            return None
        data = data.get(name)
    return data


def _slot(message: Any, shape: Any, path: tuple[str, ...]) -> _Slot:
    owner = message
    names = path or (basic_field(type(message)),)
    for name in names[:-1]:
        owner = getattr(owner, name)
    inner = shape
    for name in path:
        inner = inner[name]
    field_type = fields_of(owner)[names[-1]]
    return _Slot(path, owner, names[-1], converter(field_type, inner), getattr(owner, names[-1]))


def received_field(message_class: Any, shape: Any, subject: str) -> str | None:
    """
    Return the field of a received message that holds the model's datum.

    None if the whole message does.

    :raises SetupError: The message does not fit the model.
    """
    check_shape(message_class, shape, subject)
    return None if shape is None or isinstance(shape, dict) else basic_field(message_class)
