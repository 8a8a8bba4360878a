"""Who a caller is: what quotas, queues and jobs go by."""

from typing import Any
from urllib.parse import unquote

from robosc_api.security import CALLER


def caller_of(context: Any) -> str:
    """The name of the caller's token; without one, the name in its certificate; without that, its address.

    The three cannot be taken for each other: names of tokens have no colon, and the others begin with their kind.
    """
    token = CALLER.get()
    if token:
        return token
    names = context.auth_context().get("x509_common_name", ())
    if names:
        return "certificate:" + names[0].decode("utf-8", "backslashreplace")
    kind, _, rest = unquote(context.peer()).partition(":")
    host = rest.rpartition(":")[0] if kind in ("ipv4", "ipv6") else rest
    return f"{kind}:{host}"
