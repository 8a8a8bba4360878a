"""Writing of a supervisor file with its signature file, so that they never contradict each other."""

from pathlib import Path

from robosc.cli.output import UsageError, write_bytes
from robosc.signatures import signature_file


def write_supervisor(output: Path, content: bytes, signature: bytes) -> None:
    """Write a supervisor's file, and then what belongs beside it.

    A signature that is there stays beside the same bytes, which it still vouches for, as where `robosc sign` has made
    it; beside others it is replaced or removed. Until the file is written it is not touched: whatever goes wrong,
    what is left is the file that was there with its signature, or the new one with a signature that does not fit it.

    Args:
        output: The supervisor's file; one that is no plain file (a device, a pipe) has nothing beside it.
        content: Its bytes.
        signature: Signature of the server; empty: it has not signed.

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
