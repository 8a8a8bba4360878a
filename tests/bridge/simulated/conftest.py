import sys
from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def quick_hand_over() -> Iterator[None]:
    """dynamixel-sdk spins while it waits: the simulator's thread must not wait 5 ms for each of its turns."""
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(0.0001)
    yield
    sys.setswitchinterval(before_s)
