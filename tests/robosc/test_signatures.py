"""A signature is of one file and one key; whatever else is beside it is reported, and never believed."""

import stat
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robosc.signatures import (
    PublicKey,
    SignatureError,
    SigningUnavailableError,
    UnknownSignerError,
    make_key_pair,
    read_private_key,
    read_public_keys,
    sign,
    signer,
)
from support.effort import examples

DATA = b'{"format": "robosc-supervisor", "supervisor": {}}\n'
# RFC 8032, section 7.1, test 1, as PKCS #8 (RFC 8410).
KNOWN = """-----BEGIN PRIVATE KEY-----
MC4CAQAwBQYDK2VwBCIEIJ1hsZ3v/VpguoRK9JLsLMREScVpezJpGXA7rAMcrn9g
-----END PRIVATE KEY-----
"""
KNOWN_PUBLIC = "ssh-ed25519 AAAAC3NzaC1lZDI1NTE5AAAAINdamAGCsQq31Uv+08lkBzoO4XLz2qYjJa8CGmj3B1Ea"
# printf 'RoboSC supervisor file, version 1\nrobot' | openssl pkeyutl -sign -inkey known.key -rawin -in /dev/stdin
BY_OPENSSL = "3Tmkhu5jrubdqvHleIYNZK6Nxjp1tKD7/1iTQZJ9yWPe09n2lSSD3IwSwVsHhDmnaFxgSFGZTYZMARe/P9N9AQ=="
RSA = (
    "ssh-rsa AAAAB3NzaC1yc2EAAAADAQABAAAAgQC7VJTUt9Us8cKjMzEfYyjiWA4R4/M2bS1GB4t7NXp98C3SC6dVMvDuictGeurT8jNbvJZHtCSuY"
)


def pair(folder: Path, name: str = "ours") -> tuple[Path, PublicKey]:
    private = folder / f"{name}.key"
    return private, make_key_pair(private, folder / f"{name}.pub", name)


@pytest.fixture(scope="module")
def signed(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, PublicKey]:
    private, key = pair(tmp_path_factory.mktemp("keys"))
    return sign(DATA, read_private_key(private)), key


def test_what_is_signed_is_taken_and_names_the_signer(signed: tuple[bytes, PublicKey]) -> None:
    signature, key = signed
    assert signer(DATA, signature, [key]) is key
    assert str(key).startswith("ours (SHA256:")


def test_a_known_key_makes_the_known_signature(tmp_path: Path) -> None:
    """Ed25519 leaves nothing to chance: RFC 8032's first key, and what OpenSSL makes of our text with it."""
    file = tmp_path / "known.key"
    file.write_text(KNOWN)
    file.chmod(0o600)
    (key,) = read_public_keys(KNOWN_PUBLIC, "here")
    assert key.line == KNOWN_PUBLIC
    signature = sign(b"robot", read_private_key(file))
    assert signature.decode() == f"robosc signature 1\n{KNOWN_PUBLIC}\n{BY_OPENSSL}\n"
    assert signer(b"robot", signature, [key]) == key


@settings(max_examples=examples(60), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.integers(0, 10**6), bit=st.integers(0, 7))
def test_a_bit_that_is_changed_in_the_file_is_found(signed: tuple[bytes, PublicKey], place: int, bit: int) -> None:
    signature, key = signed
    with pytest.raises(SignatureError, match="does not fit: the file or its signature has been changed"):
        signer(_flipped(DATA, place, bit), signature, [key])


@settings(max_examples=examples(60), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.integers(0, 10**6), bit=st.integers(0, 7))
def test_a_bit_that_is_changed_in_the_signature_is_found(signed: tuple[bytes, PublicKey], place: int, bit: int) -> None:
    signature, key = signed
    with pytest.raises(SignatureError) as raised:
        signer(DATA, _flipped(signature, place, bit), [key])
    assert "\n" not in str(raised.value)


def _flipped(data: bytes, place: int, bit: int) -> bytes:
    place %= len(data)
    return data[:place] + bytes((data[place] ^ 1 << bit,)) + data[place + 1 :]


@settings(max_examples=examples(60), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(signature=st.one_of(st.binary(max_size=300), st.text(max_size=300).map(str.encode)))
def test_what_is_no_signature_is_reported(signed: tuple[bytes, PublicKey], signature: bytes) -> None:
    with pytest.raises(SignatureError, match=r"malformed|no public key"):
        signer(DATA, signature, [signed[1]])


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text + b"\n",
        lambda text: text.rstrip(b"\n"),
        lambda text: text.replace(b"\n", b"\r\n"),
        lambda text: text.replace(b" 1\n", b" 2\n"),
        lambda text: text.replace(b"\n", b"\x0b"),
        lambda text: text[:-4] + b"==\n",
    ],
)
def test_a_signature_has_one_form_only(signed: tuple[bytes, PublicKey], change: object) -> None:
    assert callable(change)
    with pytest.raises(SignatureError):
        signer(DATA, change(signed[0]), [signed[1]])


def test_another_key_is_unknown_and_a_wrong_name_does_not_make_it_ours(
    signed: tuple[bytes, PublicKey], tmp_path: Path
) -> None:
    private, other = pair(tmp_path, "other")
    theirs = sign(DATA, read_private_key(private))
    with pytest.raises(UnknownSignerError, match="is not a trusted key"):
        signer(DATA, theirs, [signed[1]])
    assert signer(DATA, theirs, [signed[1], other]) == other
    # Their proof under our name.
    lines, own = theirs.splitlines(keepends=True), signed[0].splitlines(keepends=True)
    with pytest.raises(SignatureError, match="does not fit"):
        signer(DATA, lines[0] + own[1] + lines[2], [signed[1]])


def test_a_signature_of_the_bytes_alone_means_something_else(signed: tuple[bytes, PublicKey], tmp_path: Path) -> None:
    """Check that data signed with the same key for another purpose is no supervisor."""
    import base64

    private, key = pair(tmp_path)
    proof = base64.b64encode(read_private_key(private).sign(DATA)).decode()
    with pytest.raises(SignatureError, match="does not fit"):
        signer(DATA, f"robosc signature 1\n{key.line}\n{proof}\n".encode(), [key])


# Keys.


def test_a_private_key_is_its_owners_alone_and_nothing_is_overwritten(tmp_path: Path) -> None:
    private, _ = pair(tmp_path)
    assert stat.S_IMODE(private.stat().st_mode) == 0o600
    before = private.read_bytes()
    with pytest.raises(FileExistsError):
        pair(tmp_path)
    private.unlink()
    with pytest.raises(FileExistsError):
        pair(tmp_path)
    assert not private.exists()
    assert before.startswith(b"-----BEGIN PRIVATE KEY-----")
    private.write_bytes(before)
    private.chmod(0o640)
    with pytest.raises(SignatureError, match="others may read this private key; say: chmod 600"):
        read_private_key(private)


@pytest.mark.parametrize("content", ["", "nothing", KNOWN.replace("K2VwB", "K2VuB"), KNOWN[:60], KNOWN_PUBLIC])
def test_what_is_no_private_key_is_reported(content: str, tmp_path: Path) -> None:
    file = tmp_path / "x.key"
    file.write_text(content)
    file.chmod(0o600)
    with pytest.raises(SignatureError, match=r"no private key in PEM without a password|no Ed25519 key"):
        read_private_key(file)


def test_public_keys_may_have_comments_and_empty_lines_between_them() -> None:
    text = f"# those of the lab\n\n{KNOWN_PUBLIC} her key\n  {KNOWN_PUBLIC}\n"
    first, second = read_public_keys(text, "here")
    assert (first, first.comment, second.comment) == (second, "her key", "")


@pytest.mark.parametrize("text", ["", "# none", "ssh-ed25519", "ssh-ed25519 AAAA", RSA, KNOWN_PUBLIC[:-3], "äöü"])
def test_what_is_no_public_key_is_reported(text: str) -> None:
    with pytest.raises(SignatureError, match=r"^here: (there is )?no "):
        read_public_keys(text, "here")


def test_the_comment_of_a_key_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="one printable line"):
        make_key_pair(tmp_path / "x.key", tmp_path / "x.pub", "a\nssh-ed25519 AAAA")
    assert list(tmp_path.iterdir()) == []


def test_without_the_package_the_core_works_and_says_what_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = "import robosc.cli.main, robosc.cli.sign, robosc.signatures, sys; sys.exit('cryptography' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    monkeypatch.setitem(sys.modules, "cryptography", None)
    for call in (lambda: pair(tmp_path), lambda: read_public_keys(KNOWN_PUBLIC, "here")):
        with pytest.raises(SigningUnavailableError, match=r"pip install 'robosc\[signing\]'"):
            call()
