"""Callers whose token is replaced while they are at work."""

import asyncio
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import grpc
import pytest

from robosc_api.security import Credentials, SecurityError, open_async_channel, open_channel
from support.waiting import PATIENCE_S

METHOD = "/test.Service/Unary"


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A server that answers with the credentials of a call."""

    def answer(request: bytes, context: Any) -> bytes:
        found = dict(context.invocation_metadata())["authorization"]
        return str(found).encode()

    service, _, name = METHOD[1:].partition("/")
    handlers: dict[str, Any] = {name: grpc.unary_unary_rpc_method_handler(answer)}
    server = grpc.server(ThreadPoolExecutor(2))
    server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(service, handlers),))
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    yield f"127.0.0.1:{port}"
    server.stop(0)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "token"


def put(file: Path, text: str) -> None:
    """Replace a file in one step, as a rotation should."""
    made = file.with_name("made")
    made.write_text(text)
    made.chmod(0o600)
    made.replace(file)


def test_a_new_token_is_taken_without_a_new_channel(address: str, file: Path, caplog: pytest.LogCaptureFixture) -> None:
    put(file, "first")
    with open_channel(address, Credentials(token_file=file)) as channel:
        call: Any = channel.unary_unary(METHOD)

        def sent() -> bytes:
            return bytes(call(b"", timeout=PATIENCE_S))

        assert sent() == b"Bearer first"
        put(file, "second\n")
        assert [sent(), sent()] == [b"Bearer second"] * 2
        # Half a file, and none, leave the token as it is, and the log says it once.
        put(file, "")
        assert [sent(), sent()] == [b"Bearer second"] * 2
        file.unlink()
        assert sent() == b"Bearer second"
        assert caplog.text.count("the changed token is not used") == 1
        put(file, "third")
        assert sent() == b"Bearer third"
        file.unlink()
        assert sent() == b"Bearer third"
        assert caplog.text.count("the changed token is not used") == 2
    with pytest.raises(SecurityError, match="No such file"):
        open_channel(address, Credentials(token_file=file))


def test_a_new_token_is_taken_in_asyncio(address: str, file: Path) -> None:
    put(file, "first")

    async def run() -> list[bytes]:
        async with open_async_channel(address, Credentials(token_file=file)) as channel:
            call: Any = channel.unary_unary(METHOD)
            found = [await call(b"", timeout=PATIENCE_S)]
            put(file, "second")
            return [*found, await call(b"", timeout=PATIENCE_S)]

    assert asyncio.run(run()) == [b"Bearer first", b"Bearer second"]
