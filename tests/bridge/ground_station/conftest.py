"""The conversation that most tests begin with."""

import pytest

from support.ground_talk import Talk


@pytest.fixture
def talk() -> Talk:
    found = Talk()
    found.say()
    return found
