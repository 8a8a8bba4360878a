"""How long and how many jobs are kept, and how often the manager looks after them."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class JobLimits:
    """What jobs may take, and the periods of their manager.

    Attributes:
        retention_s: Longest time that a job is kept after its end.
        results_bytes: Of kept results. Beyond it, results that no kept job refers to are deleted; where those that jobs
            do refer to are as large, jobs that have ended are forgotten before their time, and new ones are refused
            until then. Each time those of the caller who has most.
        jobs_per_owner: Kept jobs of one caller; beyond it, those that ended first are forgotten.
        look_s: How often a server that shares its database looks what others have done there; one that has a database
            of its own needs it only after that was away.
        lease_s: After how long without a sign of life a server is taken for dead by those that share its database.
        sweep_s: How often it is looked for what need not be kept any more.
    """

    retention_s: float = 7 * 86400.0
    results_bytes: int = 2 * 2**30
    jobs_per_owner: int = 10_000
    look_s: float = 0.5
    lease_s: float = 15.0
    sweep_s: float = 30.0
