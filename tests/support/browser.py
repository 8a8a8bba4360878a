"""A real browser for tests: Debian's Chromium without a window, driven by Playwright."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page, sync_playwright

CHROMIUM = shutil.which("chromium")
"""None: there is no browser on this machine, and what needs one is skipped."""

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip

LIMIT_S = 90.0
"""Maximum waiting time for pages and what is in them, in seconds."""

WIDE = (1720, 1150)
SCREENSHOTS = Path(__file__).parents[2] / "out" / "screenshots"
"""Folder in which pictures of pages are kept, for anyone who wants to see what the tests saw."""


@contextmanager
def running_browser() -> Iterator[Browser]:
    """A browser, ended at the end.

    While it runs, the thread has a loop of asyncio: nothing else in it can have one.
    """
    assert CHROMIUM is not None
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        try:
            yield browser
        finally:
            browser.close()


class Visit:
    """An open page, and the events around it.

    Attributes:
        page: The page.
        errors: Errors in it: exceptions, and errors of the console.
        asked: Addresses of everything that it asked for, WebSockets too.
    """

    def __init__(self, page: Page) -> None:
        self.page = page
        self.errors: list[str] = []
        self.asked: list[str] = []
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", lambda said: self.errors.append(said.text) if said.type == "error" else None)
        page.on("request", lambda request: self.asked.append(request.url))
        page.on("websocket", lambda socket: self.asked.append(socket.url))

    def text(self, selector: str) -> str:
        """Return the text of an element, in one line."""
        return " ".join(self.page.locator(selector).inner_text().split())

    def wait(self, condition: str, argument: Any = None) -> None:
        """Until a JavaScript expression, or function of an argument, is true."""
        self.page.wait_for_function(condition, arg=argument)

    def found(self, question: str, argument: Any = None) -> Any:
        """Return the answer of a JavaScript function, as soon as it is anything but nothing, false or zero."""
        return self.page.wait_for_function(question, arg=argument).json_value()

    def picture(self, name: str) -> Path:
        """Keeps a picture of the page."""
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        path = SCREENSHOTS / f"{name}.png"
        self.page.screenshot(path=path)
        return path


@contextmanager
def visit(browser: Browser, address: str, size: tuple[int, int] = WIDE, **options: Any) -> Iterator[Visit]:
    """Open a page in a window of its own, without anything that was kept before.

    Args:
        browser: The browser.
        address: Address to go to.
        size: Size of the window, in pixels.
        options: Data that the browser reports about its user, as `Browser.new_context` takes it.
    """
    context = browser.new_context(viewport={"width": size[0], "height": size[1]}, **options)
    context.set_default_timeout(LIMIT_S * 1000)
    try:
        opened = Visit(context.new_page())
        opened.page.goto(address)
        yield opened
    finally:
        context.close()
