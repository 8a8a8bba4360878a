"""Fixtures that the tests of the live view's page share."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from support.browser import CHROMIUM, running_browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """One for all tests of a file."""
    if CHROMIUM is None:
        pytest.skip("there is no Chromium on this machine")
    with running_browser() as running:
        yield running
