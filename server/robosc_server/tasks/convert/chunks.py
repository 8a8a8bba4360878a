"""Chunks of long results: generated files and graphs as lists, digests and chunks."""

import hashlib
from collections.abc import Iterable, Iterator

from robosc.targets import GeneratedFiles
from robosc_api.v1 import synthesis_pb2 as pb

CHUNK_BYTES = 64 * 1024
"""Maximum size of a chunk, in bytes."""


def listing(files: GeneratedFiles) -> list[pb.GeneratedFile]:
    """Return the list of files by path, without their content."""
    found = []
    for path, text in files.items():
        content = text.encode("utf-8")
        is_program = path in files.executables
        digest = hashlib.sha256(content).digest()
        found.append(pb.GeneratedFile(path=path, size=len(content), digest=digest, executable=is_program))
    return found


def digest_of(files: Iterable[pb.GeneratedFile]) -> bytes:
    """Return the SHA-256 over all files of a list."""
    total = hashlib.sha256()
    for file in files:
        total.update(file.path.encode("utf-8") + b"\0" + bytes([file.executable]) + file.digest)
    return total.digest()


def file_chunks(files: GeneratedFiles) -> Iterator[pb.FileChunk]:
    """Yield the content of all files in chunks, file by file."""
    for number, text in enumerate(files.values()):
        content = text.encode("utf-8")
        for offset in range(0, len(content), CHUNK_BYTES):
            yield pb.FileChunk(file=number, offset=offset, data=content[offset : offset + CHUNK_BYTES])


def content_chunks(content: bytes) -> Iterator[bytes]:
    """Yield a content in chunks."""
    for offset in range(0, len(content), CHUNK_BYTES):
        yield content[offset : offset + CHUNK_BYTES]
