"""A typed client of the RoboSC service."""

from robosc_client.client import Client
from robosc_client.errors import (
    ClientError,
    DeadlineError,
    RequestRefusedError,
    ServerUnavailableError,
    ServiceError,
)
from robosc_client.results import Generation, Progress, Statistics, Summary, Synthesis, SynthesisStatus

__all__ = [
    "Client",
    "ClientError",
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
