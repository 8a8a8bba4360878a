"""Signatures of supervisor files: the owner of the key vouches for every byte of the file.

A signature is in a file of its own beside the supervisor (`X.rsup.sig`), so that the supervisor's file is not changed.
It is an Ed25519 signature (S. Josefsson, I. Liusvaara, RFC 8032, 2017) over a line that names the purpose, and the
file. The file contains the whole model, the deployment and the digest of the texts, so the signature covers them, too.

Keys have the formats of other tools. A public key is a line of OpenSSH (`ssh-ed25519 AAAA... comment`), so that
`ssh-keygen -lf` prints its fingerprint. A private key is PKCS #8 in PEM, readable only by its owner. The package
`cryptography` makes, reads and checks keys and signatures; it is imported when it is needed (extra `signing`).
"""

import base64
import binascii
import contextlib
import hashlib
import os
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from robosc.errors import RoboscError

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

SIGNATURE_SUFFIX = ".sig"
"""Behind the whole name of the supervisor's file."""

MAXIMUM_SIGNATURE_BYTES = 1024
"""Largest signature file that is read."""

MAXIMUM_KEY_BYTES = 64 * 1024
"""Largest file with keys that is read."""

_MEANING = b"RoboSC supervisor file, version 1\n"
_HEADER = "robosc signature 1"
_KIND = "ssh-ed25519"


class SignatureError(RoboscError):
    """A key or signature is malformed, or does not belong to what it is beside."""


class UnknownSignerError(SignatureError):
    """A sound signature of a key that is not among those that are trusted."""


class SigningUnavailableError(RoboscError, ImportError):
    """The package that signatures need is not installed."""


@dataclass(frozen=True, slots=True)
class PublicKey:
    """A key that signatures are checked with.

    Attributes:
        line: As OpenSSH writes it, without the comment.
        comment: Owner of the key; decides nothing.
    """

    line: str
    comment: str = field(default="", compare=False)

    @property
    def fingerprint(self) -> str:
        """Fingerprint that `ssh-keygen -lf` prints."""
        digest = hashlib.sha256(base64.b64decode(self.line.partition(" ")[2])).digest()
        return "SHA256:" + base64.b64encode(digest).decode().rstrip("=")

    def __str__(self) -> str:
        return f"{self.comment} ({self.fingerprint})" if self.comment else self.fingerprint


def signature_file(supervisor: Path) -> Path:
    """Return the path of the signature of a supervisor file."""
    return supervisor.with_name(supervisor.name + SIGNATURE_SUFFIX)


def make_key_pair(private: Path, public: Path, comment: str = "") -> PublicKey:
    """Make a new key pair and write it; no file is overwritten.

    Args:
        private: Path of the new private key; only its owner may read the file.
        public: Path of the new public key.
        comment: Owner of the key: one line.

    Raises:
        OSError: A file is there already, or cannot be written; there is neither then.
        ValueError: The comment has a character that ends or spoils a line.
        SigningUnavailableError: `cryptography` is not installed.
    """
    if not comment.isprintable():
        raise ValueError("the comment of a key must be one printable line")
    _require_library()
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
    from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

    key = Ed25519PrivateKey.generate()
    found = PublicKey(_line(key.public_key()), comment.strip())
    content = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    _write_new(private, content, 0o600)
    try:
        _write_new(public, f"{found.line} {found.comment}".strip().encode() + b"\n", 0o644)
    except BaseException:
        with contextlib.suppress(OSError):
            private.unlink()
        raise
    return found


def read_private_key(file: Path) -> "Ed25519PrivateKey":
    """The private key in a file.

    Raises:
        OSError: It cannot be read.
        SignatureError: It is no Ed25519 key without a password, or others may read the file.
        SigningUnavailableError: `cryptography` is not installed.
    """
    _require_library()
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    with file.open("rb") as stream:
        if os.fstat(stream.fileno()).st_mode & 0o077:
            raise SignatureError(f"{file}: others may read this private key; say: chmod 600 {file}")
        content = stream.read(MAXIMUM_KEY_BYTES)
    try:
        key = load_pem_private_key(content, password=None)
    except (ValueError, TypeError, UnsupportedAlgorithm) as error:
        raise SignatureError(f"{file}: no private key in PEM without a password") from error
    if not isinstance(key, Ed25519PrivateKey):
        raise SignatureError(f"{file}: no Ed25519 key")
    return key


def read_public_keys(text: str, place: str) -> tuple[PublicKey, ...]:
    """Return the public keys in a text: one on each line; empty lines and those that begin with # do not count.

    Args:
        text: Text such as the content of a file.
        place: Place of the text, for messages.

    Raises:
        SignatureError: A line is no such key, or there is none.
        SigningUnavailableError: `cryptography` is not installed.
    """
    lines = [line.strip() for line in text.splitlines()]
    found = tuple(_public_key(line, place) for line in lines if line and not line.startswith("#"))
    if not found:
        raise SignatureError(f"{place}: there is no public key ({_KIND} AAAA...)")
    return found


def sign(data: bytes, key: "Ed25519PrivateKey") -> bytes:
    """The signature file of a supervisor file.

    Args:
        data: The bytes of the supervisor file.
        key: Of who vouches for it.
    """
    return _content(_line(key.public_key()), key.sign(_MEANING + data))


def signer(data: bytes, signature: bytes, trusted: Collection[PublicKey]) -> PublicKey:
    """Return the trusted key that has signed a supervisor file.

    Args:
        data: The bytes of the supervisor file.
        signature: Those of its signature file.
        trusted: Keys whose signatures count.

    Raises:
        UnknownSignerError: It is signed by another key.
        SignatureError: The signature is malformed, or is not that of this file: one of the two has been changed.
        SigningUnavailableError: `cryptography` is not installed.
    """
    _require_library()
    from cryptography.exceptions import InvalidSignature

    key, proof = _parts(signature)
    known = next((item for item in trusted if item == key), None)
    try:
        _loaded(key.line, "the signature").verify(proof, _MEANING + data)
    except InvalidSignature:
        raise SignatureError(
            f"the signature of {known or key} does not fit: the file or its signature has been changed"
        ) from None
    if known is None:
        raise UnknownSignerError(f"it is signed by {key}, which is not a trusted key")
    return known


def _parts(signature: bytes) -> tuple[PublicKey, bytes]:
    """Key and proof of a signature file, which has one form only."""
    try:
        header, line, proof = signature.decode("ascii").splitlines()
        key, raw = _public_key(line, "the signature"), base64.b64decode(proof, validate=True)
    except (ValueError, binascii.Error) as error:
        raise SignatureError("the signature is malformed") from error
    if header != _HEADER or _content(key.line, raw) != signature:
        raise SignatureError("the signature is malformed")
    return key, raw


def _content(line: str, proof: bytes) -> bytes:
    return f"{_HEADER}\n{line}\n{base64.b64encode(proof).decode()}\n".encode()


def _public_key(line: str, place: str) -> PublicKey:
    parts = line.split(maxsplit=2)
    return PublicKey(_line(_loaded(line, place)), parts[2] if len(parts) > 2 else "")


def _loaded(line: str, place: str) -> "Ed25519PublicKey":
    _require_library()
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
    from cryptography.hazmat.primitives.serialization import load_ssh_public_key

    try:
        key = load_ssh_public_key(line.encode())
    except (ValueError, UnsupportedAlgorithm) as error:
        raise SignatureError(f"{place}: no public key ({_KIND} AAAA...): {line[:40]!r}") from error
    if not isinstance(key, Ed25519PublicKey):
        raise SignatureError(f"{place}: no Ed25519 key: {line[:40]!r}")
    return key


def _line(key: "Ed25519PublicKey") -> str:
    from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

    return key.public_bytes(Encoding.OpenSSH, PublicFormat.OpenSSH).decode()


def _require_library() -> None:
    try:
        import cryptography  # noqa: F401  # whether it is there
    except ImportError as error:
        raise SigningUnavailableError(
            "signatures need the package cryptography: install the extra signing, as in pip install 'robosc[signing]'"
        ) from error


def _write_new(file: Path, content: bytes, mode: int) -> None:
    """Write a file that is not there yet, with these rights from its first byte on."""
    number = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
    with os.fdopen(number, "wb") as stream:
        stream.write(content)
