"""`robosc key` and `robosc sign`: key pairs, and signatures of supervisor files; reports about supervisor files."""

import argparse
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from robosc.cli.arguments import given_path
from robosc.cli.output import ExitCode, UsageError, print_json, write_bytes
from robosc.errors import InvalidSupervisorError
from robosc.pipeline.files import FileAccessError, read_bounded
from robosc.source import visible

if TYPE_CHECKING:
    from robosc.signatures import PublicKey, SignatureError

_KEY = """\
Make a key pair for signing supervisor files: NAME.key, the private key, which only its owner may read and which has no
password, and NAME.pub, the public key, one line of text for those who are to trust it. No file is overwritten.
"""

_SIGN = """\
Sign a supervisor file: FILE.rsup.sig is written beside it. A program that trusts the key, such as a bridge that has the
public key in its configuration, executes that supervisor without verifying it again. Verify it before you sign it.
"""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add both commands."""
    parser = commands.add_parser("key", help="make a key pair for signing supervisor files", description=_KEY)
    parser.add_argument("name", type=given_path, metavar="NAME", help="name of the files NAME.key and NAME.pub")
    parser.add_argument("--comment", default="", metavar="TEXT", help="owner of the key, written to NAME.pub")
    parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
    parser.set_defaults(run=run_key)

    parser = commands.add_parser("sign", help="sign a supervisor file", description=_SIGN)
    parser.add_argument("supervisor", type=given_path, metavar="FILE.rsup", help="the supervisor file to sign")
    parser.add_argument(
        "--key", type=given_path, required=True, metavar="FILE.key", help="the private key to sign with"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
    parser.set_defaults(run=run_sign)


def run_key(arguments: argparse.Namespace) -> int:
    """Make a pair.

    Raises:
        UsageError: A file is there already or cannot be written, or the comment is no line.
        SigningUnavailableError: The package for it is not installed.
    """
    from robosc.signatures import make_key_pair

    private, public = (arguments.name.with_name(arguments.name.name + end) for end in (".key", ".pub"))
    try:
        key = make_key_pair(private, public, arguments.comment)
    except ValueError as error:
        raise UsageError(str(error)) from error
    except OSError as error:
        raise UsageError(f"cannot write {error.filename or private}: {error.strerror or error}") from error
    if arguments.json:
        print_json({"private": str(private), "public": str(public), "fingerprint": key.fingerprint})
    else:
        sys.stdout.write(f"{private}: private key: keep it to yourself\n{public}: public key {key}\n")
    return ExitCode.OK


def run_sign(arguments: argparse.Namespace) -> int:
    """Sign a file that is a supervisor.

    Raises:
        UsageError: A file cannot be read or written.
        InvalidSupervisorError: It is no supervisor.
        SignatureError: The key cannot be used.
        SigningUnavailableError: The package for it is not installed.
    """
    from robosc.signatures import read_private_key, sign, signature_file

    content = read_supervisor(arguments.supervisor)
    name, deployment = name_and_deployment(content)
    try:
        key = read_private_key(arguments.key)
    except OSError as error:
        raise UsageError(f"cannot read {arguments.key}: {error.strerror or error}") from error
    file = signature_file(arguments.supervisor)
    write_bytes(file, sign(content, key))
    if arguments.json:
        print_json({"file": str(file), "model": name, "deployment": deployment})
    else:
        sys.stdout.write(f"{file}: signature of a {deployment or 'supervisor'} for {visible(name)}\n")
    return ExitCode.OK


def name_and_deployment(content: bytes) -> tuple[str, str | None]:
    """Return the name of what a supervisor file is for, and its deployment; None if it is for automata.

    Raises:
        InvalidSupervisorError: The bytes are no supervisor, of a robot or of automata.
    """
    from robosc.pipeline.systems import decode_system
    from robosc.supervisor.codec import decode

    with suppress(InvalidSupervisorError):
        return decode_system(content).system.name, None
    supervisor = decode(content)
    return supervisor.model.name, str(supervisor.deployment)


def read_supervisor(file: Path) -> bytes:
    """The bytes of a supervisor file.

    Raises:
        UsageError: It cannot be read.
    """
    from robosc.supervisor.codec import MAXIMUM_BYTES

    return _read(file, MAXIMUM_BYTES)


def signer_of(file: Path, content: bytes, trusted: Sequence[Path]) -> "PublicKey":
    """Return the key, out of those in some files, that has signed a supervisor file.

    Args:
        file: File of the supervisor.
        content: Its bytes.
        trusted: Files with public keys.

    Raises:
        UsageError: A file cannot be read.
        SignatureError: None of the keys has, or a file holds no key.
        SigningUnavailableError: The package for it is not installed.
    """
    from robosc.signatures import (
        MAXIMUM_KEY_BYTES,
        MAXIMUM_SIGNATURE_BYTES,
        read_public_keys,
        signature_file,
        signer,
    )

    keys = [
        key
        for path in trusted
        for key in read_public_keys(_read(path, MAXIMUM_KEY_BYTES).decode("utf-8", "replace"), str(path))
    ]
    return signer(content, _read(signature_file(file), MAXIMUM_SIGNATURE_BYTES), keys)


def _read(file: Path, most: int) -> bytes:
    try:
        return read_bounded(file, most)
    except FileAccessError as error:
        raise UsageError(str(error)) from error


def report_signer(arguments: argparse.Namespace, key: "PublicKey") -> None:
    """Print whose signature it is, unless the output is JSON or quiet."""
    if not arguments.quiet and not arguments.json:
        sys.stdout.write(visible(f"{arguments.supervisor}: signed by {key}") + "\n")


def report_malformed(arguments: argparse.Namespace, error: "InvalidSupervisorError | SignatureError") -> ExitCode:
    """Print that a file is no supervisor, or not signed as it must be, and return the exit status."""
    from robosc.certification.file_report import malformed_json

    if arguments.json:
        print_json(malformed_json(error))
    else:
        sys.stderr.write(f"{arguments.supervisor}: {visible(str(error))}\n")
    return ExitCode.FAILED
