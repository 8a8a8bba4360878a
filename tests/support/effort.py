"""Effort of random tests: how many examples they try, and which.

Without ROBOSC_EFFORT the examples are always the same ones, whatever else the process has run or loaded. With it they
are that many times as many, and others for each ROBOSC_SEED: `make soak`.
"""

import math
import os
from collections.abc import Mapping
from unittest.mock import patch

import hypothesis
from hypothesis.internal.conjecture import providers


def effort_of(variables: Mapping[str, str]) -> tuple[float, int]:
    """The effort and the seed that an environment asks for; an effort of 0 where it asks for none.

    Raises:
        ValueError: It asks for what cannot be; one sentence.
    """
    effort, seed = variables.get("ROBOSC_EFFORT"), variables.get("ROBOSC_SEED", "0")
    try:
        number = 0.0 if effort is None else float(effort)
    except ValueError:
        number = math.nan
    # Fewer examples than those of `make test` would pass for a run of it.
    if effort is not None and not 1 <= number < math.inf:
        raise ValueError(f"ROBOSC_EFFORT is how many times the examples are tried, at least 1; it is {effort!r}")
    try:
        return number, int(seed)
    except ValueError:
        raise ValueError(f"ROBOSC_SEED is a whole number; it is {seed!r}") from None


def _asked() -> tuple[float, int, str]:
    try:
        return *effort_of(os.environ), ""
    except ValueError as error:
        return 0.0, 0, str(error)


EFFORT, SEED, WRONG = _asked()
"""Examples for each one of `make test` (0: those of `make test` itself); the first seed of tests that go through seeds
one by one; and why nothing is to be run, in one sentence, or nothing."""


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
        max_examples=examples(30),
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
