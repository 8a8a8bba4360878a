"""Writing of a supervisor file with its signature file, so that they never contradict each other."""

from pathlib import Path

from robosc.cli.output import UsageError, write_bytes
from robosc.signatures import signature_file


def write_supervisor(output: Path, content: bytes, signature: bytes) -> None:
    """Write a supervisor's file, and then what belongs beside it.

    If the bytes of the file do not change, an existing signature stays, such as one of `robosc sign`; otherwise it is
    replaced or removed, after the file was written. So an error leaves the previous file with its signature, or the new
    file with a signature that does not verify.

    Args:
        output: Path of the supervisor's file; a device or a pipe gets no signature file beside it.
        content: Bytes of the file.
        signature: Signature of the server; empty: the server has not signed.

    Raises:
        UsageError: A file cannot be written or removed.
    """
    is_same = _has_content(output, content)
    write_bytes(output, content)
    if not output.is_file():
        return
    beside = signature_file(output)
    if signature:
        write_bytes(beside, signature)
    elif not is_same:
        try:
            beside.unlink(missing_ok=True)
        except OSError as error:
            raise UsageError(f"cannot remove {beside}: {error.strerror or error}") from error


def _has_content(file: Path, content: bytes) -> bool:
    """Return True if a plain file has just these bytes; one that cannot be read does not count."""
    try:
        return file.is_file() and file.stat().st_size == len(content) and file.read_bytes() == content
    except OSError:
        return False
