"""Workers that most tests of this folder share."""

from support.worker_runs import running as running
