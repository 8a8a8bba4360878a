"""A typed client of the RoboSC service.

The names are imported on use: the command must be able to answer Ctrl-C before gRPC is loaded.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from robosc_client.client import Client
    from robosc_client.errors import (
        ClientError,
        CredentialsError,
        DeadlineError,
        RequestRefusedError,
        ServerUnavailableError,
        ServiceError,
    )
    from robosc_client.results import Generation, Progress, Statistics, Summary, Synthesis, SynthesisStatus

_HOMES = {
    "Client": "client",
    "ClientError": "errors",
    "CredentialsError": "errors",
    "DeadlineError": "errors",
    "Generation": "results",
    "Progress": "results",
    "RequestRefusedError": "errors",
    "ServerUnavailableError": "errors",
    "ServiceError": "errors",
    "Statistics": "results",
    "Summary": "results",
    "Synthesis": "results",
    "SynthesisStatus": "results",
}

__all__ = [
    "Client",
    "ClientError",
    "CredentialsError",
    "DeadlineError",
    "Generation",
    "Progress",
    "RequestRefusedError",
    "ServerUnavailableError",
    "ServiceError",
    "Statistics",
    "Summary",
    "Synthesis",
    "SynthesisStatus",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its module on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
