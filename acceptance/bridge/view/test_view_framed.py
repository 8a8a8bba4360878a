"""The page in a frame: of those that may, and of no others."""

import argparse
import http.server
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from robosc.cli.arguments import Parser
from robosc_view import command
from robosc_view.server import answer_headers
from support.browser import visit
from support.models import EXAMPLES
from support.view_servers import view_process

MODEL = EXAMPLES / "line_follower" / "line_follower.rscd"


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_request(self, *words: object) -> None:
        """Drop a request's line."""


@contextmanager
def site(folder: Path) -> Iterator[str]:
    """The origin of a site that has the files of a folder."""
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(folder))) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


@pytest.mark.parametrize("is_invited", [True, False])
def test_who_is_invited_shows_it_and_nobody_else(browser: Browser, tmp_path: Path, is_invited: bool) -> None:
    with (
        site(tmp_path) as origin,
        site(tmp_path) as other,
        view_process("--model", MODEL, "--framed-by", origin, "--framed-by", "vscode-webview:") as (_, url),
    ):
        (tmp_path / "index.html").write_text(f'<iframe src="{url}" width="1200" height="900"></iframe>')
        with visit(browser, origin if is_invited else other) as seen:
            if is_invited:
                framed = seen.page.frame_locator("iframe")
                framed.locator("#robot", has_text="LineFollower").wait_for()
                framed.locator("#link-word", has_text="by hand").wait_for()
                # A site without an icon, and a page that may not take the focus from the one around it.
                assert [error for error in seen.errors if "404" not in error and "autofocus" not in error] == []
            else:
                (frame,) = seen.page.main_frame.child_frames
                frame.wait_for_url("chrome-error:**")
                assert any("frame-ancestors" in error for error in seen.errors)


def test_nobody_unless_somebody_is_named() -> None:
    alone = answer_headers()
    assert "frame-ancestors 'none';" in alone["Content-Security-Policy"]
    assert alone["X-Frame-Options"] == "DENY"
    framed = answer_headers(["https://site:8443", "vscode-webview:"])
    assert "frame-ancestors https://site:8443 vscode-webview:;" in framed["Content-Security-Policy"]
    assert "X-Frame-Options" not in framed


def framing(*words: str) -> list[str]:
    parser: argparse.ArgumentParser = Parser(prog="robosc")
    command.add_parser(parser.add_subparsers())
    found: list[str] = parser.parse_args(["view", *words]).framed_by
    return found


def test_how_they_are_named() -> None:
    named = ["https://site", "http://127.0.0.1:80", "http://[::1]:8066", "vscode-webview:", "vscode-file:"]
    assert framing(*(word for name in named for word in ("--framed-by", name))) == named


@pytest.mark.parametrize(
    "name",
    [
        "",
        "*",
        "'self'",
        "https:",
        "http:",
        "data:",
        "https://*.site",
        "https://site/path",
        "https://site; script-src *",
        "https://site https://other",
        "https://a,b",
        "https://site\n",
        "VSCODE:",
        "vscode-webview",
        "https://",
        "file:",
        "moz-extension:",
        "chrome-extension:",
    ],
)
def test_what_is_no_name(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        framing("--framed-by", name)
    assert "neither an origin" in capsys.readouterr().err
