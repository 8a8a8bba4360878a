"""Signatures of supervisors that a server has made."""

import argparse
from collections.abc import Collection
from typing import TYPE_CHECKING

from robosc.cli.output import CommandError, ExitCode, UsageError

if TYPE_CHECKING:
    from robosc.signatures import PublicKey


def trusted_keys(arguments: argparse.Namespace) -> "tuple[PublicKey, ...]":
    """Read the keys of `--signed-by`, before the server is called.

    Raises:
        UsageError: A file cannot be read or holds no key, or the package for keys is not installed.
    """
    if not arguments.signed_by:
        return ()
    from robosc.signatures import MAXIMUM_KEY_BYTES, SignatureError, SigningUnavailableError, read_public_keys

    keys: list[PublicKey] = []
    for path in arguments.signed_by:
        try:
            with path.open("rb") as stream:
                text = stream.read(MAXIMUM_KEY_BYTES + 1).decode("utf-8", "replace")
            keys += read_public_keys(text, str(path))
        except OSError as error:
            raise UsageError(f"cannot read {path}: {error.strerror or error}") from error
        except (SignatureError, SigningUnavailableError) as error:
            raise UsageError(str(error)) from error
    return tuple(keys)


def require_signature(keys: "Collection[PublicKey]", supervisor: bytes, signature: bytes) -> None:
    """Do nothing if one of the keys has signed a supervisor file.

    Raises:
        CommandError: None of the keys has signed it.
    """
    from robosc.signatures import SignatureError, signer

    if not signature:
        raise CommandError(
            "the server has not signed the supervisor: it needs a signing_key, or the command no --signed-by",
            ExitCode.SERVICE,
        )
    try:
        signer(supervisor, signature, keys)
    except SignatureError as error:
        raise CommandError(f"the server's supervisor: {error}", ExitCode.SERVICE) from error
