"""The notes for Emacs, in a real one that is set up as they say, with eglot."""

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from robosc.formatting import format_text
from robosc.language.words import RESERVED_WORDS
from support.background import children_of, has_ended
from support.editor_models import LIBRARY, ROBOT
from support.hostile_models import products
from support.installed_editors import EMACS, LIMIT_S, ROOT, Emacs, Home, ended
from support.waiting import eventually

MODE = ROOT / "editors" / "emacs" / "robosc-mode.el"

WORDS_ELSEWHERE = frozenset({"always", "constant", "else", "never", "not", "then"})
"""Words that are names where they mean nothing: what begins an item or parts an expression is shown as a word."""


def test_the_words_are_those_of_the_language() -> None:
    found = re.search(r"\(regexp-opt\s+'\(([^)]*)\)\s+'symbols\)", MODE.read_text("utf-8"))
    assert found is not None
    assert sorted(re.findall(r'"([^"]*)"', found[1])) == sorted(RESERVED_WORDS | WORDS_ELSEWHERE)


def batch(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run Emacs without a screen and return its output."""
    assert EMACS is not None
    command = [EMACS, "--batch", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)


@pytest.fixture(scope="module")
def eglot() -> None:
    """Skips what needs an Emacs with eglot."""
    if EMACS is None:
        pytest.skip("needs Emacs: apt-get install emacs-nox elpa-eglot")
    if batch("--eval", "(progn (package-initialize) (require 'eglot))").returncode != 0:
        pytest.skip("needs eglot, which Emacs has from 29 on: apt-get install elpa-eglot")


needs_eglot = pytest.mark.usefixtures("eglot")
needs_emacs = pytest.mark.skipif(EMACS is None, reason="needs Emacs: apt-get install emacs-nox")


@pytest.fixture
def home(tmp_path: Path) -> Home:
    home = Home(tmp_path / "home")
    home.write("work/robots/walker.rscd", ROBOT)
    home.write("work/robots/parts.rscd", LIBRARY)
    (home.folder / "work" / ".git").mkdir()
    return home


def is_attached(emacs: Emacs) -> bool:
    """Return True if a server answers for the text that is shown."""
    return emacs.ask("(and (fboundp 'eglot-current-server) (eglot-current-server) t)") is True


@pytest.fixture
def emacs(eglot: None, home: Home) -> Iterator[Emacs]:
    """Emacs that shows a robot, with its server."""
    with ended(lambda: Emacs(home, home.folder / "work/robots/walker.rscd"), home) as emacs:
        assert eventually(lambda: is_attached(emacs))
        yield emacs


def finds(emacs: Emacs, message: str, words: str) -> bool:
    """Return True if something is found before long."""
    return eventually(lambda: any(message in text and found == words for text, found in emacs.findings))


@needs_emacs
def test_it_compiles_without_warnings(tmp_path: Path) -> None:
    copy = tmp_path / MODE.name
    copy.write_text(MODE.read_text("utf-8"), "utf-8")
    done = batch("-Q", "--eval", "(setq byte-compile-error-on-warn t)", "-f", "batch-byte-compile", copy)
    assert done.returncode == 0 and not done.stderr and copy.with_suffix(".elc").exists(), done.stderr


@needs_emacs
def test_the_documentation_of_the_mode_is_in_order() -> None:
    done = batch("-Q", "--eval", f'(progn (require \'checkdoc) (checkdoc-file "{MODE}"))')
    assert done.returncode == 0 and not done.stderr, done.stderr


@needs_eglot
def test_findings_follow_what_is_typed(home: Home) -> None:
    path = home.write("work/robots/wrong.rscd", ROBOT.replace("goto on_", "goto nowhere"))
    with ended(lambda: Emacs(home, path), home) as emacs:
        assert finds(emacs, "nowhere", "nowhere")
        emacs.go("goto |nowhere")
        emacs.type("\x1bdon_")  # M-d
        assert eventually(lambda: "goto on_" in emacs.text and "nowhere" not in str(emacs.findings))
        emacs.go("Base.|calm")
        emacs.type("\x1bdclam")
        assert finds(emacs, "clam", "clam")


@needs_eglot
def test_a_file_is_known_by_its_end(emacs: Emacs) -> None:
    assert emacs.ask("(list (symbol-name major-mode) comment-start indent-tabs-mode)") == ["robosc-mode", "// ", None]


@needs_emacs
def test_words_comments_and_texts_are_coloured(home: Home) -> None:
    home.without_server()
    with ended(lambda: Emacs(home, home.folder / "work/robots/walker.rscd"), home) as emacs:

        def face(words: str) -> object:
            emacs.go(words)
            return emacs.ask("(progn (font-lock-ensure) (get-text-property (point) 'face))")

        assert face("|robot Walker") == "font-lock-keyword-face"
        assert face("robot |Walker") is None
        assert face("it 🏃 |walks") == "font-lock-comment-face"
        assert face('"/|button"') == "font-lock-string-face"
        assert face("goto |on_ }") is None
        emacs.go("|most: integer")
        emacs.type("^state ")
        assert eventually(lambda: "^state most" in emacs.text)
        assert face("^|state most") is None
        emacs.command("comment-line")
        assert eventually(lambda: "\n    // constant ^state most: integer = 2\n" in emacs.text)


@needs_emacs
def test_lines_are_indented_by_their_braces(home: Home) -> None:
    home.without_server()
    lines = [line.strip() for line in format_text(ROBOT).splitlines()]
    path = home.write("flat.rscd", "\n".join([*lines, "/*", "  as it is {", "*/"]))
    with ended(lambda: Emacs(home, path), home) as emacs:
        emacs.type("\x18h")  # C-x h
        emacs.type("\x1b\x1c")  # C-M-\
        assert eventually(lambda: emacs.text == format_text(ROBOT) + "/*\n  as it is {\n*/")
        emacs.type("\x1b<")
        emacs.type("robot Typed {\rcomponent C {\r}\r}\r")
        assert eventually(lambda: emacs.text.startswith("robot Typed {\n    component C {\n    }\n}\nrobot"))


@needs_eglot
def test_hover_over_a_name_is_shown(emacs: Emacs) -> None:
    emacs.go("requirement wa|lk")
    emacs.type("\x06")  # C-f: what it shows is that of where the cursor comes to.
    # Not asked meanwhile: it shows it when it has nothing else to do.
    assert eventually(lambda: b'incoming message walk with identifier: "/cmd_vel"' in emacs.seen)
    emacs.type("\x08.")  # C-h .
    windows = """(mapconcat (lambda (window) (with-current-buffer (window-buffer window) (buffer-string)))
                            (window-list) " ")"""
    assert eventually(lambda: 'incoming message walk with identifier: "/cmd_vel"' in emacs.ask(windows))


@needs_eglot
def test_states_are_completed_after_goto(emacs: Emacs) -> None:
    emacs.go("goto |on_")
    emacs.type("\x1bd")
    emacs.type("\x1b\t")  # C-M-i
    # Both begin like this; they are listed when it is asked again.
    assert eventually(lambda: "on response from power goto o }" in emacs.text)
    emacs.type("\x1b\t")
    windows = """(mapcan (lambda (window) (split-string (with-current-buffer (window-buffer window) (buffer-string))))
                         (remq (selected-window) (window-list)))"""
    assert eventually(lambda: {"on_", "off"} <= set(emacs.ask(windows) or ()))
    assert "calm" not in emacs.ask(windows)
    emacs.type("f\x1b\t")
    assert eventually(lambda: "/* 😀 */ on response from power goto off }" in emacs.text)


@needs_eglot
def test_a_definition_is_gone_to(emacs: Emacs) -> None:
    where = "(list (buffer-name) (buffer-substring-no-properties (point) (line-end-position)))"
    emacs.go("on response from power goto |on_")
    emacs.type("\x1b.")  # M-.
    assert eventually(lambda: emacs.ask(where) == ["walker.rscd", "on_ { on response from power goto off }"])
    # The definition is in a file that is not open.
    emacs.go("Base.|calm")
    emacs.type("\x1b.")
    assert eventually(lambda: emacs.ask(where)[0] == "parts.rscd" and emacs.ask(where)[1].startswith("calm {"))
    assert eventually(lambda: is_attached(emacs))


@needs_eglot
def test_who_uses_a_name_is_listed(emacs: Emacs) -> None:
    emacs.go("Base.|count <")
    emacs.type("\x1b?")  # M-?
    listed = '(and (get-buffer "*xref*") (with-current-buffer "*xref*" (buffer-string)))'
    assert eventually(lambda: {"parts.rscd", "walker.rscd"} <= set(re.findall(r"\w+\.rscd", str(emacs.ask(listed)))))


@needs_eglot
def test_a_name_is_changed_in_all_files(emacs: Emacs, home: Home) -> None:
    emacs.go("Base.|calm")
    emacs.command("eglot-rename")
    emacs.answer("Rename", "quiet\r")
    # It asks before it changes files that are not shown.
    emacs.answer("edit", "y")
    assert eventually(lambda: emacs.text == ROBOT.replace("calm", "quiet"))
    emacs.type("\x18s!")  # C-x s: all of them.
    saved = home.folder / "work/robots/parts.rscd"
    assert eventually(lambda: saved.read_text("utf-8") == LIBRARY.replace("calm", "quiet"))


@needs_eglot
def test_a_text_is_formatted(emacs: Emacs) -> None:
    emacs.command("eglot-format")
    assert eventually(lambda: emacs.text == format_text(ROBOT))


@needs_eglot
def test_a_name_that_is_nearly_right_is_fixed(emacs: Emacs) -> None:
    emacs.go("Base.|calm")
    emacs.type("\x1bdclam")
    assert finds(emacs, "clam", "clam")
    emacs.go("Base.cl|am")
    emacs.command("eglot-code-actions")
    emacs.answer("ction", "\r")
    assert eventually(lambda: emacs.text == ROBOT)


@needs_eglot
def test_an_unsaved_library_counts(emacs: Emacs, home: Home) -> None:
    emacs.type("\x18\x06")  # C-x C-f
    emacs.type("parts.rscd\r")
    assert eventually(lambda: emacs.text == LIBRARY and is_attached(emacs))
    emacs.go("state |calm")
    emacs.type("\x1bdquiet")
    emacs.type("\x18b\r")  # C-x b: back.
    assert finds(emacs, "calm", "calm")
    assert len(home.servers) == 1


@needs_eglot
def test_it_ends_though_synthesis_goes_on(eglot: None, home: Home) -> None:
    path = home.write("long.rscd", products())
    with ended(lambda: Emacs(home, path), home):
        assert eventually(lambda: bool(home.servers and children_of(home.servers[0])))
        (synthesis,) = children_of(home.servers[0])
    assert eventually(lambda: has_ended(synthesis))
