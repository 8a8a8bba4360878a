"""Effort of random tests: how many examples they try, and which.

Without ROBOSC_EFFORT the examples are always the same ones, whatever else the process has run or loaded. With it they
are that many times as many, and others for each ROBOSC_SEED: `make soak`.
"""

import os
from unittest.mock import patch

import hypothesis
from hypothesis.internal.conjecture import providers

EFFORT = float(os.environ.get("ROBOSC_EFFORT", "0"))
"""Examples for each one of `make test`; 0: those of `make test` itself."""

SEED = int(os.environ.get("ROBOSC_SEED", "0"))
"""First seed of tests that go through seeds one by one."""


def examples(number: int) -> int:
    """Return how many examples a random test tries that tries `number` of them in `make test`."""
    return max(1, round(number * EFFORT)) if EFFORT else number


def seeds(number: int) -> range:
    """Return the seeds that a random test with the marker `random` goes through, `number` of them in `make test`."""
    return range(SEED, SEED + examples(number))


def load_profile() -> None:
    """Let Hypothesis choose examples as the effort says."""
    # Deadlines and health checks would judge the machine, which runs other tests beside.
    hypothesis.settings.register_profile(
        "robosc",
        max_examples=examples(50),
        derandomize=not EFFORT,
        database=None,
        deadline=None,
        print_blob=True,
        suppress_health_check=[hypothesis.HealthCheck.too_slow],
    )
    hypothesis.settings.load_profile("robosc")
    # Hypothesis also draws constants from all modules that happen to be loaded, so that examples would depend on the
    # tests that ran before.
    patch.object(providers, "is_local_module_file", lambda path: False).start()
