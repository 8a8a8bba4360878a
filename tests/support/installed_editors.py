"""Real editors for tests, with nothing but what the manual says to write into their files: Debian's Neovim and Emacs.

Both are driven by keys, as by hands, and asked what they show. The language server is found as any program is.
"""

import base64
import contextlib
import fcntl
import json
import os
import pty
import re
import select
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from support.background import has_ended
from support.waiting import eventually

ROOT = Path(__file__).parents[2]
MANUAL = ROOT / "docs" / "editors.md"
LIMIT_S = 60.0

NVIM = shutil.which("nvim")
"""None: there is no Neovim on this machine, and what needs it is skipped."""

EMACS = shutil.which("emacs") if shutil.which("emacsclient") else None
"""None: there is no Emacs on this machine, and what needs it is skipped."""


def settings_of(editor: str, language: str) -> str:
    """Return the manual's settings for an editor's file, with the path of this project's folder."""
    section = re.search(rf"^## {editor}\n(.*?)(?=^## |\Z)", MANUAL.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    assert section is not None
    blocks = re.findall(rf"^```{language}\n(.*?)^```", section[1], re.DOTALL | re.MULTILINE)
    assert blocks and all("/path/to/editors" in block for block in blocks)
    return "\n".join(blocks).replace("/path/to/editors", str(ROOT / "editors"))


class Home:
    """The folder of a user who has nothing but `robosc-lsp`.

    Args:
        folder: Empty.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._started = folder / "started"
        programs = folder / "programs"
        programs.mkdir(parents=True)
        self._started.touch()
        server = programs / "robosc-lsp"
        server.write_text(
            f'#!/bin/sh\necho $$ >> "{self._started}"\nexec "{sys.executable}" -m robosc_lsp.command "$@"\n'
        )
        server.chmod(0o755)
        kept = {
            name: value for name, value in os.environ.items() if not name.startswith(("XDG_", "NVIM", "EMACS", "VIM"))
        }
        self.variables: Mapping[str, str] = {
            **kept,
            "HOME": str(folder),
            "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
            "TERM": "linux",
            "LC_ALL": "C.UTF-8",
        }

    def without_server(self) -> None:
        """Take the language server away."""
        (self.folder / "programs" / "robosc-lsp").unlink()

    def write(self, name: str, text: str) -> Path:
        """Write a file."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
        return path

    @property
    def servers(self) -> list[int]:
        """The processes of every server that was started."""
        return [int(number) for number in self._started.read_text().split()]

    def is_quiet(self) -> bool:
        """Return True if every server ends before long."""
        return eventually(lambda: all(map(has_ended, self.servers)))


class Neovim:
    """Neovim without a screen, that shows some files; it speaks MessagePack-RPC on its standard streams.

    Args:
        home: Home of its user.
        arguments: Arguments that say what it shows, and how.
    """

    def __init__(self, home: Home, *arguments: str | Path) -> None:
        assert NVIM is not None
        home.write(".config/nvim/init.lua", settings_of("Neovim", "lua"))
        command = [NVIM, "--embed", "--headless", "-n", *map(str, arguments)]
        self._log = tempfile.TemporaryFile()  # noqa: SIM115  # Closed with the editor.
        self.process = subprocess.Popen(
            command,
            cwd=home.folder,
            env=home.variables,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
        )
        self._asked = 0
        self._came = b""

    def lua(self, code: str, *arguments: Any) -> Any:
        """Run a piece of Lua and return its result."""
        return self._call("nvim_exec_lua", code, arguments)

    def type(self, keys: str) -> None:
        """Type keys, named as in mappings."""
        self._call("nvim_input", keys)

    @property
    def is_asking(self) -> bool:
        """True if it waits for an answer in its last line; some versions do nothing else then."""
        now = self._call("nvim_get_mode")
        return bool(now["blocking"] or now["mode"] == "c")

    @property
    def text(self) -> str:
        """The text that is shown."""
        return "\n".join(self.lua("return vim.api.nvim_buf_get_lines(0, 0, -1, false)")) + "\n"

    @property
    def findings(self) -> list[tuple[str, str]]:
        """Findings in the text that is shown: the code, and the words that it refers to."""
        return [
            (item["code"], item["words"])
            for item in self.lua(
                """
                local found = {}
                for _, item in ipairs(vim.diagnostic.get(0)) do
                    local words = vim.api.nvim_buf_get_text(0, item.lnum, item.col, item.end_lnum, item.end_col, {})
                    local code = item.code or item.user_data.lsp.code
                    table.insert(found, { code = code, words = table.concat(words, "\\n") })
                end
                return found
                """
            )
        ]

    def go(self, words: str) -> None:
        """Put the cursor at the `|` of some words, which stand once in the text."""
        before = self.text[: _offset(self.text, words)]
        line, column = before.count("\n") + 1, len(before.rpartition("\n")[2].encode())
        self.lua("vim.api.nvim_win_set_cursor(0, { ... })", line, column)

    def quit(self) -> int:
        """Its status once it has ended, without saving."""
        self.type("<Esc>:qa!<CR>")
        return self.process.wait(LIMIT_S)

    def close(self) -> None:
        """End it, should it still run."""
        self.process.kill()
        self.process.communicate()
        self._log.close()

    def _call(self, method: str, *arguments: Any) -> Any:
        self._asked += 1
        assert self.process.stdin is not None
        self.process.stdin.write(msgspec.msgpack.encode([0, self._asked, method, arguments]))
        self.process.stdin.flush()
        end_s = time.monotonic() + LIMIT_S
        while True:
            answer = self._message(end_s, method)
            if answer[0] == 1 and answer[1] == self._asked:
                assert answer[2] is None, answer[2]
                return answer[3]

    def _message(self, end_s: float, method: str) -> list[Any]:
        assert self.process.stdout is not None
        while True:
            try:
                # One at a time: it speaks only when it is asked.
                found: list[Any] = msgspec.msgpack.decode(self._came)
            except msgspec.DecodeError:
                is_there, _, _ = select.select([self.process.stdout], [], [], max(0.0, end_s - time.monotonic()))
                assert is_there, f"no answer to {method}"
                came = os.read(self.process.stdout.fileno(), 65536)
                assert came, f"it has ended: {self._log_text()}"
                self._came += came
            else:
                self._came = b""
                return found

    def _log_text(self) -> str:
        self._log.seek(0)
        return self._log.read().decode()


class Emacs:
    """Emacs on a pseudo-terminal, that shows a file; it is asked by `emacsclient`.

    Args:
        home: Home of its user.
        file: File that it shows.
    """

    def __init__(self, home: Home, file: Path) -> None:
        assert EMACS is not None
        home.write(".emacs.d/init.el", settings_of("Emacs", "elisp"))
        # Emacs would translate all its packages into machine code first in a new home, and show the output of that.
        home.write(
            ".emacs.d/early-init.el",
            "(setq native-comp-deferred-compilation nil native-comp-jit-compilation nil"
            " native-comp-enable-subr-trampolines nil comp-enable-subr-trampolines nil)",
        )
        self._home = home
        # The name of a socket has to be short.
        self._folder = tempfile.TemporaryDirectory(prefix="emacs-")
        self._socket = Path(self._folder.name) / "server"
        self._number, inner = pty.openpty()
        fcntl.ioctl(inner, termios.TIOCSWINSZ, struct.pack("HHHH", 50, 150, 0, 0))
        begin = f'(progn (setq server-socket-dir "{self._folder.name}") (server-start))'
        # A terminal of its own, from which Emacs reads.
        command = ["setsid", "--ctty", EMACS, "-nw", "--no-splash", "--eval", begin, str(file)]
        self.process = subprocess.Popen(
            command,
            cwd=home.folder,
            env=home.variables,
            stdin=inner,
            stdout=inner,
            stderr=inner,
        )
        os.close(inner)
        self.seen = b""
        self._thread = threading.Thread(target=self._read)
        self._thread.start()
        try:
            assert eventually(self._listens), self.seen
            assert eventually(lambda: self.ask("(buffer-file-name)") == str(file)), self.seen
        except BaseException:
            self.close()
            raise

    def _listens(self) -> bool:
        # Its socket is there a moment before connections are accepted.
        with socket.socket(socket.AF_UNIX) as line, contextlib.suppress(FileNotFoundError, ConnectionRefusedError):
            line.connect(str(self._socket))
            return True
        return False

    def _read(self) -> None:
        # Output must not stay in its way.
        try:
            while came := os.read(self._number, 65536):
                self.seen += came
        except OSError:
            return

    def ask(self, form: str) -> Any:
        """Return the value of a form in the buffer that is shown."""
        encoded = (
            "(with-current-buffer (window-buffer (selected-window)) (require 'json)"
            f" (base64-encode-string (encode-coding-string (json-encode {form}) 'utf-8) t))"
        )
        reply = subprocess.run(
            ["emacsclient", "-s", self._socket, "--eval", encoded],
            env=self._home.variables,
            capture_output=True,
            timeout=LIMIT_S,
            check=False,
        )
        assert reply.returncode == 0, (reply.stdout, reply.stderr, self.seen[-2000:])
        return json.loads(base64.b64decode(reply.stdout.strip().strip(b'"')))

    def type(self, keys: str) -> None:
        """Type keys, as a terminal sends them."""
        os.write(self._number, keys.encode())

    def command(self, name: str) -> None:
        """Call a command by its name."""
        self.type(f"\x1bx{name}\r")

    def answer(self, question: str, keys: str) -> None:
        """Answer what it asks in its last line, once it asks."""
        asked = """(and (active-minibuffer-window)
                        (with-current-buffer (window-buffer (active-minibuffer-window)) (minibuffer-prompt)))"""
        assert eventually(lambda: question in str(self.ask(asked))), self.seen[-2000:]
        self.type(keys)

    @property
    def text(self) -> str:
        """The text that is shown."""
        return str(self.ask("(save-restriction (widen) (buffer-substring-no-properties (point-min) (point-max)))"))

    @property
    def findings(self) -> list[tuple[str, str]]:
        """Findings in the text that is shown: the message, and the words that it refers to."""
        found = self.ask(
            """(vconcat (mapcar (lambda (item)
                                  (vector (flymake-diagnostic-text item)
                                          (buffer-substring-no-properties
                                           (flymake-diagnostic-beg item) (flymake-diagnostic-end item))))
                                (and (bound-and-true-p flymake-mode) (flymake-diagnostics))))"""
        )
        return [(reply, words) for reply, words in found]

    def go(self, words: str) -> None:
        """Put the cursor at the `|` of some words, which stand once in the text."""
        offset = _offset(self.text, words)
        self.ask(f"(goto-char (+ (point-min) {offset}))")

    def quit(self) -> int:
        """Its status once it has ended, without saving."""
        self.type("\x07")
        self.ask("(progn (mapc (lambda (buffer) (with-current-buffer buffer (set-buffer-modified-p nil)))"
                 " (buffer-list)) t)")  # fmt: skip
        self.type("\x18\x03")
        # Servers are processes that it asks about.
        self.type("yes\r")
        return self.process.wait(LIMIT_S)

    def close(self) -> None:
        """End it, should it still run."""
        self.process.kill()
        self.process.wait()
        self._thread.join(LIMIT_S)
        os.close(self._number)
        self._folder.cleanup()


def _offset(text: str, words: str) -> int:
    """Return the offset of the `|` of some words, which stand once in a text."""
    plain = words.replace("|", "")
    assert text.count(plain) == 1, f"{plain!r} stands {text.count(plain)} times there"
    return text.index(plain) + words.index("|")


@contextmanager
def ended[T: (Neovim, Emacs)](start: Callable[[], T], home: Home) -> Iterator[T]:
    """An editor that ends as it should at the end of a block, and its servers with it."""
    editor = start()
    try:
        yield editor
        assert editor.quit() == 0
        assert home.is_quiet(), "the server runs though the editor has ended"
    finally:
        editor.close()
