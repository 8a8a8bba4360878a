"""Recognition of errors that a lack of memory has caused, whatever their type."""

import errno

from google.protobuf.message import DecodeError, EncodeError

_PROBE_BYTES = 2**20
"""Size of an allocation that tests whether memory is left."""

_NO_NODE = "`DdNode *node` is `NULL` pointer"
"""Words of dd about an operation that CUDD broke off, which is free of what it had made by then."""


def is_lack_of_memory(error: BaseException) -> bool:
    """Return True if an error that ended a task comes of a lack of memory; ask while the error is being handled.

    Libraries in C report it in ways of their own: Protocol Buffers refuse to read or write a message that is right, and
    a system call reports ENOMEM. Some lose the reason, so it is also tried whether there is memory left: what the task
    has made is still there while its error is handled.

    Args:
        error: The error; requests have been accepted, and messages of results are made here, so both are right.
    """
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, MemoryError | DecodeError | EncodeError):
            return True
        if isinstance(cause, OSError) and cause.errno == errno.ENOMEM:
            return True
        if isinstance(cause, ValueError) and _NO_NODE in str(cause):
            return True
        cause = cause.__cause__ or (None if cause.__suppress_context__ else cause.__context__)
    try:
        bytearray(_PROBE_BYTES)
    except MemoryError:
        return True
    return False
