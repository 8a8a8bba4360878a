"""The notes for Neovim, in a real one that is set up as they say."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from robosc.formatting import format_text
from robosc.language.words import RESERVED_WORDS
from support.background import children_of, has_ended
from support.editor_models import LIBRARY, ROBOT
from support.hostile_models import products
from support.installed_editors import NVIM, ROOT, Home, Neovim, ended
from support.waiting import eventually

needs_neovim = pytest.mark.skipif(NVIM is None, reason="needs Neovim: apt-get install neovim")

WORDS_ELSEWHERE = frozenset({"always", "constant", "else", "never", "not", "then"})
"""Words that are names where they mean nothing: what begins an item or parts an expression is shown as a word."""


def shown_words() -> list[str]:
    """The words that the syntax file has."""
    lines = (ROOT / "editors" / "neovim" / "syntax" / "robosc.vim").read_text("utf-8").splitlines()
    found = [re.fullmatch(r"syntax keyword roboscWord ((?:[a-z]+ ?)+)", line) for line in lines]
    return [word for match in found if match is not None for word in match[1].split()]


def test_the_words_are_those_of_the_language() -> None:
    assert sorted(shown_words()) == sorted(RESERVED_WORDS | WORDS_ELSEWHERE)


@pytest.fixture
def home(tmp_path: Path) -> Home:
    home = Home(tmp_path / "home of somebody")
    home.write("work/robots/walker.rscd", ROBOT)
    home.write("work/robots/parts.rscd", LIBRARY)
    (home.folder / "work" / ".git").mkdir()
    return home


CLIENTS = """
    if vim.lsp.get_clients then
        return vim.tbl_map(function(client) return client.id end, vim.lsp.get_clients({ bufnr = 0 }))
    end
    return vim.tbl_keys(vim.lsp.buf_get_clients(0))
"""


def is_attached(nvim: Neovim) -> bool:
    """Return True if a server answers for the text that is shown."""
    return len(nvim.lua(CLIENTS)) == 1


@pytest.fixture
def nvim(home: Home) -> Iterator[Neovim]:
    """Neovim that shows a robot, with its server."""
    with ended(lambda: Neovim(home, home.folder / "work/robots/walker.rscd"), home) as nvim:
        assert eventually(lambda: is_attached(nvim))
        yield nvim


def finds(nvim: Neovim, code: str, words: str) -> bool:
    """Return True if something is found before long."""
    return eventually(lambda: (code, words) in nvim.findings)


@needs_neovim
def test_findings_follow_what_is_typed(home: Home) -> None:
    path = home.write("work/robots/wrong.rscd", ROBOT.replace("goto on_", "goto nowhere"))
    with ended(lambda: Neovim(home, path), home) as nvim:
        assert finds(nvim, "unknown-name", "nowhere")
        nvim.go("goto |nowhere")
        nvim.type("cwon_<Esc>")
        assert eventually(lambda: "unknown-name" not in dict(nvim.findings))
        nvim.go("Base.|calm")
        nvim.type("cwclam<Esc>")
        assert finds(nvim, "unknown-name", "clam")


@needs_neovim
def test_what_synthesis_finds_is_shown(nvim: Neovim) -> None:
    assert eventually(lambda: "unused-requirement" in dict(nvim.findings))


@needs_neovim
def test_a_file_is_known_by_its_end(nvim: Neovim) -> None:
    options = nvim.lua("return { vim.bo.filetype, vim.bo.commentstring, vim.bo.shiftwidth, vim.bo.expandtab }")
    assert options == ["robosc", "// %s", 4, True]


@needs_neovim
def test_words_comments_and_texts_are_coloured(nvim: Neovim) -> None:
    def group(words: str) -> str:
        nvim.go(words)
        return str(nvim.lua("return vim.fn.synIDattr(vim.fn.synID(vim.fn.line('.'), vim.fn.col('.'), 1), 'name')"))

    assert group("|robot Walker") == "roboscWord"
    assert group("robot Wal|ker") == ""
    assert group("it 🏃 wa|lks") == "roboscComment"
    assert group('"/bu|tton"') == "roboscText"
    assert group("integer(0..|3) }") == "roboscNumber"
    assert group("state o|n_ {") == ""
    nvim.go("|most: integer")
    nvim.type("i^state<Esc>")
    assert eventually(lambda: "^statemost" in nvim.text)
    nvim.type("a <Esc>")
    assert eventually(lambda: "^state most" in nvim.text)
    assert group("^st|ate most") == "roboscName"


@needs_neovim
def test_hover_over_a_name_is_shown(nvim: Neovim) -> None:
    nvim.go("requirement wa|lk")
    nvim.type("K")
    windows = """
        local found = {}
        for _, window in ipairs(vim.api.nvim_list_wins()) do
            if vim.api.nvim_win_get_config(window).relative ~= "" then
                vim.list_extend(found, vim.api.nvim_buf_get_lines(vim.api.nvim_win_get_buf(window), 0, -1, false))
            end
        end
        return table.concat(found, " ")
    """
    assert eventually(lambda: 'incoming message walk with identifier: "/cmd_vel"' in nvim.lua(windows))


@needs_neovim
def test_states_are_offered_after_goto(nvim: Neovim) -> None:
    nvim.go("goto |on_")
    nvim.type("cw<C-x><C-o>")
    offered = "return vim.tbl_map(function(item) return item.word end, vim.fn.complete_info({ 'items' }).items)"
    assert eventually(lambda: sorted(nvim.lua(offered)) == ["off", "on_"])
    nvim.lua("vim.fn.complete_info()")
    nvim.type("<C-n><C-y><Esc>")
    assert eventually(lambda: "/* 😀 */ on response from power goto o" in nvim.text)


@needs_neovim
def test_a_definition_is_gone_to(nvim: Neovim) -> None:
    where = "return { vim.fn.expand('%:t'), vim.fn.getline('.'):sub(vim.fn.col('.')) }"
    nvim.go("on response from power goto |on_")
    nvim.type("<C-]>")
    assert eventually(lambda: nvim.lua(where) == ["walker.rscd", "on_ { on response from power goto off }"])
    # The definition is in a file that is not open.
    nvim.go("Base.|calm")
    nvim.type("<C-]>")
    assert eventually(lambda: nvim.lua(where)[0] == "parts.rscd" and nvim.lua(where)[1].startswith("calm {"))
    assert eventually(lambda: is_attached(nvim))


@needs_neovim
def test_a_name_is_changed_in_all_files(nvim: Neovim, home: Home) -> None:
    nvim.go("Base.|calm")
    nvim.type("grn")
    # Neovim asks, and suggests the old name.
    assert eventually(lambda: nvim.lua("return vim.fn.getcmdline()") == "calm")
    nvim.type("<C-u>quiet<CR>")
    assert eventually(lambda: nvim.text == ROBOT.replace("calm", "quiet"))
    nvim.type(":wall<CR>")
    saved = home.folder / "work/robots/parts.rscd"
    assert eventually(lambda: saved.read_text("utf-8") == LIBRARY.replace("calm", "quiet"))


@needs_neovim
def test_who_uses_a_name_is_listed(nvim: Neovim) -> None:
    nvim.go("Base.|count <")
    nvim.type("grr")
    listed = "return vim.tbl_map(function(item) return vim.fn.bufname(item.bufnr) end, vim.fn.getqflist())"
    assert eventually(
        lambda: sorted(Path(name).name for name in nvim.lua(listed)) == ["parts.rscd"] * 2 + ["walker.rscd"]
    )


@needs_neovim
def test_a_text_is_formatted(nvim: Neovim) -> None:
    nvim.type("gggqG")
    assert eventually(lambda: nvim.text == format_text(ROBOT))


@needs_neovim
def test_a_name_that_is_nearly_right_is_fixed(nvim: Neovim) -> None:
    nvim.go("Base.|calm")
    nvim.type("cwclam<Esc>")
    assert finds(nvim, "unknown-name", "clam")
    nvim.type("gra")
    assert eventually(lambda: nvim.is_asking)
    nvim.type("1<CR>")
    assert eventually(lambda: nvim.text == ROBOT)


@needs_neovim
def test_files_of_two_folders_have_one_server(nvim: Neovim, home: Home) -> None:
    first = nvim.lua(CLIENTS)
    other = home.write("elsewhere/lonely.rscd", "robot Lonely { component Base from parts import Base }")
    nvim.type(f":edit {str(other).replace(' ', chr(92) + ' ')}<CR>")
    assert finds(nvim, "unknown-name", "parts")
    assert nvim.lua(CLIENTS) == first and len(home.servers) == 1
    # It works in the other folder, too: files that are not open there are named by it.
    home.write("elsewhere/parts.rscd", LIBRARY)
    home.write("elsewhere/third.rscd", "robot Third { component Base from parts import Base }")
    nvim.type(":edit %:h/parts.rscd<CR>")
    assert eventually(lambda: nvim.text == LIBRARY and is_attached(nvim))
    nvim.go("component |Base")
    nvim.type("grr")
    listed = "return vim.tbl_map(function(item) return vim.fn.bufname(item.bufnr) end, vim.fn.getqflist())"
    assert eventually(lambda: "third.rscd" in {Path(name).name for name in nvim.lua(listed)})


@needs_neovim
def test_folders_of_files_that_are_opened_at_once_are_known(home: Home) -> None:
    home.write("elsewhere/parts.rscd", LIBRARY)
    home.write("elsewhere/third.rscd", "robot Third { component Base from parts import Base }")
    files = (home.folder / "work/robots/walker.rscd", home.folder / "elsewhere/parts.rscd")
    with ended(lambda: Neovim(home, "-O", *files), home) as nvim:
        nvim.type("<C-w>l")
        assert eventually(lambda: nvim.text == LIBRARY and is_attached(nvim))
        nvim.go("component |Base")
        nvim.type("grr")
        listed = "return vim.tbl_map(function(item) return vim.fn.bufname(item.bufnr) end, vim.fn.getqflist())"
        assert eventually(lambda: "third.rscd" in {Path(name).name for name in nvim.lua(listed)})
        assert len(home.servers) == 1


@needs_neovim
def test_an_unsaved_library_counts(nvim: Neovim) -> None:
    nvim.type(":split work/robots/parts.rscd<CR>")
    assert eventually(lambda: nvim.text == LIBRARY)
    nvim.go("state |calm")
    nvim.type("cwquiet<Esc><C-w>w")
    assert finds(nvim, "unknown-name", "calm")


@needs_neovim
def test_it_ends_though_synthesis_goes_on(home: Home) -> None:
    path = home.write("long.rscd", products())
    with ended(lambda: Neovim(home, path), home):
        assert eventually(lambda: bool(home.servers and children_of(home.servers[0])))
        (synthesis,) = children_of(home.servers[0])
    assert eventually(lambda: has_ended(synthesis))


@needs_neovim
def test_a_file_can_be_edited_without_a_server(home: Home) -> None:
    home.without_server()
    with ended(lambda: Neovim(home, home.folder / "work/robots/walker.rscd"), home) as nvim:
        nvim.type("<CR>")
        assert eventually(lambda: nvim.text == ROBOT)
        nvim.go("|robot Walker")
        nvim.type("x")
        assert eventually(lambda: nvim.text == ROBOT[1:])
