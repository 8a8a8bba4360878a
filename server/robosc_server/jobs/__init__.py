"""Jobs: stored tasks that continue without their caller."""

from robosc_server.jobs.convert import JOB_METHODS, JOB_SERVICE_NAME
from robosc_server.jobs.manager import Caller, JobManager
from robosc_server.jobs.result_cache import ResultCache
from robosc_server.jobs.retention import JobLimits
from robosc_server.jobs.scheduler import QueueLimits, Scheduler
from robosc_server.jobs.service import JobService, add_job_service, caller_of

__all__ = [
    "JOB_METHODS",
    "JOB_SERVICE_NAME",
    "Caller",
    "JobLimits",
    "JobManager",
    "JobService",
    "QueueLimits",
    "ResultCache",
    "Scheduler",
    "add_job_service",
    "caller_of",
]
