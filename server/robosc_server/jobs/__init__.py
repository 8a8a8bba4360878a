"""Jobs: tasks that go on without their caller."""

from robosc_server.jobs.callers import Caller, caller_of
from robosc_server.jobs.convert import JOB_METHODS, JOB_SERVICE_NAME
from robosc_server.jobs.limits import JobLimits
from robosc_server.jobs.manager import JobManager
from robosc_server.jobs.results import Results
from robosc_server.jobs.scheduler import QueueLimits, Scheduler
from robosc_server.jobs.service import JobService, add_job_service

__all__ = [
    "JOB_METHODS",
    "JOB_SERVICE_NAME",
    "Caller",
    "JobLimits",
    "JobManager",
    "JobService",
    "QueueLimits",
    "Results",
    "Scheduler",
    "add_job_service",
    "caller_of",
]
