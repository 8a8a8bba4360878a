"""Limits on the time and the number of kept jobs, and the periods of the manager that looks after them."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class JobLimits:
    """Limits of jobs, and the periods of their manager.

    Attributes:
        retention_s: Longest time that a job is kept after its end.
        results_bytes: Bytes of kept results. Beyond it, results that no kept job refers to are deleted; where those
            that jobs do refer to are as large, jobs that have ended are forgotten before their time, and new ones are
            refused until then. Each time, those of the caller who has most are chosen.
        jobs_per_owner: Kept jobs of one caller; beyond it, those that ended first are forgotten.
        poll_s: Period, in seconds, at which a server that shares its database looks for what others have done there;
            one that has a database of its own needs it only after that was away.
        lease_s: Time without a sign of life, in seconds, after which a server is taken for dead by those that share
            its database.
        sweep_s: Period, in seconds, of the search for what need not be kept any more.
    """

    retention_s: float = 7 * 86400.0
    results_bytes: int = 2 * 2**30
    jobs_per_owner: int = 10_000
    poll_s: float = 0.5
    lease_s: float = 15.0
    sweep_s: float = 30.0
