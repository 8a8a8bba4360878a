"""Database of jobs and results."""

from robosc_server.store.errors import StoreError, StoreUnavailableError
from robosc_server.store.factory import open_store
from robosc_server.store.records import JobFilter, JobRecord, JobState
from robosc_server.store.store import Store

__all__ = ["JobFilter", "JobRecord", "JobState", "Store", "StoreError", "StoreUnavailableError", "open_store"]
