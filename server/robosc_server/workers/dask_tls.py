"""TLS to a Dask scheduler by Dask's own settings, with clear messages for its problems.

Dask does not distinguish an expired certificate from a wrong one, and reports a rejected client certificate as a
timeout.
"""

import asyncio
import contextlib
import ssl
from typing import Any

from distributed.security import Security

from robosc_server.workers import WorkersError

_SETTINGS = "DASK_DISTRIBUTED__COMM__TLS__CA_FILE, …__TLS__CLIENT__CERT and …__TLS__CLIENT__KEY"


def client_context() -> ssl.SSLContext:
    """Return the TLS context that identifies server and scheduler to each other; read from the files each time.

    Raises:
        WorkersError: Dask's settings name no certificate, key or authority, or a file cannot be used.
    """
    settings: Any = Security()  # type: ignore[no-untyped-call]
    try:
        context = settings.get_connection_args("client")["ssl_context"]
    except (OSError, ValueError) as error:  # An SSLError is an OSError.
        files = settings.get_tls_config_for_role("client")
        named = ", ".join(str(files[kind]) for kind in ("ca_file", "cert", "key") if files[kind])
        raise WorkersError(f"the certificates for the Dask cluster cannot be used ({named}): {error}") from error
    if not isinstance(context, ssl.SSLContext):
        raise WorkersError(f"workers on dask+tls:// need Dask's settings {_SETTINGS}")
    return context


async def tls_fault(host: str, port: int, limit_s: float) -> str | None:
    """Return the reason why TLS with a scheduler fails; None: it works, or no scheduler is reachable.

    Args:
        host: Host of the scheduler.
        port: Port of the scheduler.
        limit_s: Longest time for the attempt, in seconds.
    """
    try:
        context = client_context()
    except WorkersError as error:
        return str(error)
    writer = None
    try:
        async with asyncio.timeout(limit_s):
            reader, writer = await asyncio.open_connection(host, port, ssl=context)
            # The scheduler sends first; only then it is known whether it accepts our certificate (RFC 8446, section 2).
            await reader.read(1)
    except ssl.SSLCertVerificationError as error:
        return f"its certificate is not accepted: {error.verify_message}"
    except ssl.SSLError as error:
        return f"TLS fails: {_openssl_message(error)}"
    except OSError:  # A TimeoutError is one.
        return None
    finally:
        if writer is not None:
            writer.transport.abort()
            with contextlib.suppress(OSError):
                await writer.wait_closed()
    return None


def _openssl_message(error: ssl.SSLError) -> str:
    """Return the words of OpenSSL, such as `tlsv1 alert unknown ca`."""
    return (error.reason or str(error)).replace("_", " ").lower()
