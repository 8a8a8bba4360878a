"""Rovers for the tests of their driver."""

from collections.abc import Iterator

import pytest

from support.rovers import Bench, rig


@pytest.fixture(params=["pty", "udpin", "udpout"])
def any_bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    with rig(request.param) as found:
        yield found
