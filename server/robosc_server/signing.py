"""Signatures of supervisors by the server's own key: who trusts the key need not verify them again."""

from pathlib import Path
from typing import TYPE_CHECKING

from google.protobuf.message import DecodeError

from robosc.signatures import SignatureError, SigningUnavailableError, read_private_key, sign
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.task import Result, TaskKind

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey


class SigningError(Exception):
    """The key cannot be used; one sentence for the operator."""


def read_signing_key(file: Path) -> "Ed25519PrivateKey":
    """Return the key in a file.

    Raises:
        SigningError: The file has no key that can be used.
    """
    try:
        return read_private_key(file)
    except OSError as error:
        raise SigningError(f"{file}: {error.strerror}") from error
    except (SignatureError, SigningUnavailableError) as error:
        raise SigningError(str(error)) from error


def signed(kind: TaskKind, result: Result, key: "Ed25519PrivateKey") -> Result:
    """Return a result with the signature of its supervisor, if it has one.

    Stored results are not signed, since the key may be another one when they are sent again.
    """
    if kind is not TaskKind.SYNTHESIZE:
        return result
    try:
        response = pb.SynthesizeResponse.FromString(result.messages[-1])
    except DecodeError:
        return result  # A worker has made it: it may be anything.
    if not response.result.supervisor:
        return result
    response.result.signature = sign(response.result.supervisor, key)
    return Result((*result.messages[:-1], response.SerializeToString()))
