"""Fixtures that the tests of the live view's page share."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from support.browser import CHROMIUM, Visit, running_browser, visit
from support.live_view import StandIn
from support.view_messages import definition, update


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """One for all tests of a file."""
    if CHROMIUM is None:
        pytest.skip("there is no Chromium on this machine")
    with running_browser() as running:
        yield running


@pytest.fixture
def server() -> Iterator[StandIn]:
    """Stand-in that shows a robot."""
    with StandIn([definition(), update()]) as standing_in:
        yield standing_in


@pytest.fixture
def seen(browser: Browser, server: StandIn) -> Iterator[Visit]:
    """Page of the server, in which no error may occur."""
    with visit(browser, server.address) as opened:
        server.wait_for_pages(1)
        yield opened
        assert opened.errors == []
