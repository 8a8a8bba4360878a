"""The language server over real JSON-RPC: what it finds, shows, offers and changes."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException

from robosc.formatting import format_text
from robosc_lsp import server
from robosc_lsp.project import Project
from support.editor import Editor, part_of, position_of, with_edits
from support.editor_models import LIBRARY, ROBOT, write_definitions
from support.models import STOPPING

# The robot cannot be kept from getting to a state without a way back.
FALL = """robot Fall {
    component Base {
        outgoing message fallen with type: none
        incoming message rise with type: none
        behaviour {
            initial marked state standing { on response from fallen goto lying }
            state lying { on request to rise goto standing }
        }
    }
    requirement rise needs Base.standing
}
"""

# Its supervisor has to keep it from walking into where nothing leads back from.
TRAP = """robot Trap {
    component Base {
        incoming message leave with type: none
        incoming message come with type: none
        incoming message stay with type: none
        behaviour {
            initial marked state home {
                on request to stay
                on request to leave goto away
            }
            state away { on request to come goto home }
        }
    }
    requirement come needs Base.home
}
"""


@pytest.fixture(autouse=True)
def definitions(tmp_path: Path) -> None:
    write_definitions(tmp_path)


@pytest.fixture
def editor(tmp_path: Path) -> Iterator[Editor]:
    """An editor with a robot and its library, none of which is saved; without synthesis, so that findings are final."""
    with Editor(tmp_path, "--synthesis-seconds", "0") as editor:
        editor.open("parts.rscd", LIBRARY)
        editor.open("walker.rscd", ROBOT)
        yield editor


def labels(found: lsp.CompletionList) -> list[str]:
    """Return the labels of the offered completions, in order."""
    return [item.label for item in sorted(found.items, key=lambda item: item.sort_text or "")]


def complete(editor: Editor, name: str, words: str) -> list[str]:
    """Return the completions that are offered at the `|` of some words."""
    place = editor.at(name, words)
    found = editor.run(
        editor.client.text_document_completion_async(lsp.CompletionParams(place.text_document, place.position))
    )
    return labels(found)


def typed(editor: Editor, words: str, instead_of: str = "") -> list[str]:
    """Return the completions at the `|` of some words that are put into the robot instead of others."""
    new = ROBOT.replace(instead_of, words.replace("|", "")) if instead_of else words.replace("|", "")
    editor.replace("walker.rscd", new)
    return complete(editor, "walker.rscd", words)


# Findings


def test_findings_come_as_one_types(editor: Editor) -> None:
    assert editor.codes("walker.rscd") == []
    at = ROBOT.index("goto on_")
    editor.edit("walker.rscd", (at, at + len("goto on_"), "goto nowhere"))
    (found,) = editor.findings("walker.rscd", bool)
    assert found.code == "unknown-name" and found.source == "robosc"
    assert found.severity is lsp.DiagnosticSeverity.Error
    assert part_of(editor.texts["walker.rscd"], found.range) == "nowhere"
    editor.edit("walker.rscd", (at, at + len("goto nowhere"), "goto on_"))
    assert "unknown-name" not in editor.codes("walker.rscd")


def test_an_unsaved_library_is_what_counts(editor: Editor, tmp_path: Path) -> None:
    assert editor.codes("walker.rscd") == []
    editor.replace("parts.rscd", LIBRARY.replace("state calm", "state quiet"))
    assert editor.codes("walker.rscd", bool) == ["unknown-name"]
    editor.save("parts.rscd", LIBRARY)
    editor.close("parts.rscd")
    assert editor.codes("walker.rscd", lambda codes: "unknown-name" not in codes) == []


def test_a_text_that_is_odd_keeps_nobody_else_from_findings(editor: Editor) -> None:
    # A text while a user splits an emoji, and a mark that some editors put before every text.
    editor.open("odd.rscd", "\ufeff// \ud83d\nrobot Odd { component c { incoming message m with type: nne } }")
    editor.open("other.rscd", "robot Other { component c { incoming message m with type: nne } }")
    for name in ("odd.rscd", "other.rscd"):
        (found,) = editor.findings(name, bool)
        assert found.code == "unknown-name" and part_of(editor.texts[name], found.range) == "nne"


def test_a_long_line_with_emoji_is_answered(editor: Editor) -> None:
    components = " ".join(
        f"component c{number} {{ incoming message m{number} with type: none }}" for number in range(1500)
    )
    editor.open("long.rscd", f"robot Long {{ /* 😀 */ {components} }}")
    parameters = lsp.SemanticTokensParams(editor.document("long.rscd"))
    found = editor.run(editor.client.text_document_semantic_tokens_full_async(parameters))
    assert len(found.data) == 5 * 3001
    assert list(found.data[:5]) == [0, 6, 4, 0, 1]
    assert found.data[-4] == len("c1499 { incoming message ")


def test_of_a_file_under_two_paths_each_shows_its_own_text(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    (tmp_path / "real" / "walker.rscd").write_text("robot Old { }")
    with Editor(tmp_path, "--synthesis-seconds", "0") as editor:
        editor.open("link/walker.rscd", "robot New { }")
        editor.open("real/walker.rscd", "robot Newer { }")
        editor.close("real/walker.rscd")
        editor.edit("link/walker.rscd", (0, 0, " "))
        (found,) = editor.findings("link/walker.rscd", bool)
        assert part_of(editor.texts["link/walker.rscd"], found.range) == "New"


def test_a_library_that_changes_on_disk_is_read_again(tmp_path: Path) -> None:
    with Editor(tmp_path, "--synthesis-seconds", "0") as editor:
        editor.until(lambda: bool(editor.watched))
        assert [item.method for item in editor.watched] == ["workspace/didChangeWatchedFiles"]
        editor.open("walker.rscd", ROBOT)
        assert "unknown library 'parts'" in editor.findings("walker.rscd", bool)[0].message
        editor.save("parts.rscd", LIBRARY)
        assert editor.codes("walker.rscd", lambda codes: "unknown-name" not in codes) == []


def test_related_places_are_sent(editor: Editor) -> None:
    editor.replace("walker.rscd", ROBOT.replace("marked state on_ {", "marked state off { } state on_ {"))
    found = next(item for item in editor.findings("walker.rscd", bool) if str(item.code).startswith("duplicate"))
    assert found.related_information is not None
    place = found.related_information[0].location
    assert place.uri == editor.uri("walker.rscd")
    assert part_of(editor.texts["walker.rscd"], place.range) == "off"


def test_warnings_of_synthesis_follow_and_are_those_of_the_text(tmp_path: Path) -> None:
    with Editor(tmp_path) as editor:
        editor.open("parts.rscd", LIBRARY)
        editor.open("walker.rscd", ROBOT)
        found = editor.findings("walker.rscd", lambda found: any(item.code == "unused-requirement" for item in found))
        unused = next(item for item in found if item.code == "unused-requirement")
        assert unused.severity is lsp.DiagnosticSeverity.Warning
        assert unused.range.start.line == ROBOT[: ROBOT.index("requirement {")].count("\n")
        # Findings in the library are reported there, too: here they have no line.
        assert any("parts.rscd:" in item.message for item in found if item.code == "never-enabled")
        editor.replace("walker.rscd", "robot Empty { }")
        codes = editor.codes("walker.rscd")
        assert "unused-requirement" not in codes and "never-enabled" not in codes


ACCEPTED = """robot Lamps {
    component Switch { outgoing message pressed with identifier: "/pressed", type: none }
    component Button {
        // robosc: accept shared-topic: one person presses both
        outgoing message pushed with identifier: "/pressed", type: none
        // robosc: accept needless-property: left over
        incoming message light with identifier: "/light", type: none
        // robosc: accept competing-requests: one of them will do
        incoming message dim with identifier: "/light", type: none
        // robosc: accept never-enabled: left over, too
        incoming message buzz with identifier: "/buzz", type: none
    }
}
"""


def test_what_the_text_accepts_is_a_hint_with_its_reason(tmp_path: Path) -> None:
    with Editor(tmp_path) as editor:
        editor.open("lamps.rscd", ACCEPTED)
        found = editor.findings("lamps.rscd", lambda found: any(item.code == "competing-requests" for item in found))
        hints = [item for item in found if item.severity is lsp.DiagnosticSeverity.Hint]
        assert [(item.code, part_of(ACCEPTED, item.range), item.message.rpartition("\n")[2]) for item in hints] == [
            ("shared-topic", "pushed", "accepted: one person presses both"),
            ("competing-requests", "dim", "accepted: one of them will do"),
        ]
        # Each of the two that accept nothing is found by a stage of its own.
        left = [(item.code, item.range.start.line) for item in found if item not in hints]
        assert [item for item in left if item[0] == "needless-acceptance"] == [
            ("needless-acceptance", 5),
            ("needless-acceptance", 9),
        ]
        editor.replace("lamps.rscd", ACCEPTED.replace("// robosc: accept", "//"))
        found = editor.findings("lamps.rscd", lambda found: any(item.code == "competing-requests" for item in found))
        assert not any(item.severity is lsp.DiagnosticSeverity.Hint for item in found)
        assert {"shared-topic", "competing-requests"} <= {item.code for item in found}


def test_that_there_is_no_supervisor_is_reported_at_the_robot(tmp_path: Path) -> None:
    with Editor(tmp_path) as editor:
        editor.open("fall.rscd", FALL)
        found = editor.findings("fall.rscd", lambda found: any(item.code == "no-supervisor" for item in found))
        place = next(item.range for item in found if item.code == "no-supervisor")
        assert part_of(FALL, place) == "Fall"
        parameters = lsp.CodeLensParams(editor.document("fall.rscd"))
        (lens,) = editor.run(editor.client.text_document_code_lens_async(parameters))
        assert lens.command.title == "no supervisor"


def test_a_cancel_that_must_be_possible_is_an_error_at_its_transition(tmp_path: Path) -> None:
    with Editor(tmp_path) as editor:
        editor.open("stopping.rscd", STOPPING)
        found = editor.findings("stopping.rscd", lambda found: any(item.code == "forbidden-cancel" for item in found))
        shown = next(item for item in found if item.code == "forbidden-cancel")
        assert shown.severity is lsp.DiagnosticSeverity.Error
        assert part_of(STOPPING, shown.range) == "on cancel to travel goto braking"
        assert "after travel.request, stop.response" in shown.message
        assert shown.related_information is not None
        (asking,) = shown.related_information
        assert part_of(STOPPING, asking.location.range) == "requirement"


DENIED = """robot Courier {
    component Door {
        outgoing message opened with type: none
        behaviour { initial marked state shut { on response from opened goto ajar } marked state ajar { } }
    }
    component Base {
        incoming message enter with type: none
        behaviour { initial marked state outside { on request to enter goto inside } marked state inside { } }
    }
    requirement enter needs Door.ajar
    mission delivery {
        visit Base.outside or Base.inside
        then Base.inside
    }
}
"""


def test_a_mission_that_cannot_be_made_is_reported_with_what_is_to_blame_and_what_helps(tmp_path: Path) -> None:
    with Editor(tmp_path) as editor:
        editor.open("courier.rscd", DENIED)
        found = editor.findings("courier.rscd", lambda found: any(item.code == "unreachable-goal" for item in found))
        shown = next(item for item in found if item.code == "unreachable-goal")
        assert part_of(DENIED, shown.range) == "Base.inside"
        assert shown.related_information is not None
        (blamed,) = shown.related_information
        assert blamed.message == "this requirement is to blame"
        assert part_of(DENIED, blamed.location.range) == "requirement"
        (action,) = everywhere(editor, "courier.rscd")
        assert action.title == "Write 'assume Door.shut leads to Door.ajar'"
        assert action.edit is not None and action.edit.changes is not None
        text = with_edits(DENIED, action.edit.changes[editor.uri("courier.rscd")])
        assert text.endswith("    }\n    assume Door.shut leads to Door.ajar\n}\n")


def test_without_synthesis_there_are_the_findings_of_the_checks(tmp_path: Path) -> None:
    with Editor(tmp_path, "--synthesis-seconds", "0") as editor:
        editor.open("trap.rscd", TRAP)
        assert editor.codes("trap.rscd") == []
        place = editor.document("trap.rscd")
        (lens,) = editor.run(editor.client.text_document_code_lens_async(lsp.CodeLensParams(place)))
        assert lens.command.title == "synthesis is disabled"


# Hover texts


def hover(editor: Editor, name: str, words: str) -> str:
    """Return the hover text for the name at the `|` of some words."""
    place = editor.at(name, words)
    found = editor.run(editor.client.text_document_hover_async(lsp.HoverParams(place.text_document, place.position)))
    assert found is not None
    return str(found.contents.value)


def test_hover_over_a_message_shows_its_type_users_and_plant(editor: Editor) -> None:
    text = hover(editor, "walker.rscd", "requirement wa|lk")
    assert 'incoming message walk with identifier: "/cmd_vel"' in text
    assert "used by requirement (line 17), provide (line 19)" in text
    assert "plant `" in text and "`walk.request`" in text


def test_hover_over_a_part_of_a_library_shows_the_robots_that_use_it(editor: Editor) -> None:
    assert "used by walker.rscd" in hover(editor, "parts.rscd", "state cal|m {")
    assert "used by walker.rscd" in hover(editor, "parts.rscd", "component Ba|se {")


def test_hover_over_a_component_shows_its_plant(editor: Editor) -> None:
    text = hover(editor, "walker.rscd", "Butto|n.off")
    assert "2 states, 1 variable, 3 transitions" in text


def test_what_the_supervisor_adds_is_reported(tmp_path: Path) -> None:
    with Editor(tmp_path) as editor:
        editor.open("trap.rscd", TRAP)
        editor.until(lambda: editor.lenses_refreshed > 0)
        assert "the supervisor adds to `leave.request`: `false`" in hover(editor, "trap.rscd", "to le|ave goto")
        assert "the supervisor adds nothing to `stay.request`" in hover(editor, "trap.rscd", "message st|ay")
        place = editor.document("trap.rscd")
        (lens,) = editor.run(editor.client.text_document_code_lens_async(lsp.CodeLensParams(place)))
        assert lens.command.title == "1 state, supervisor adds conditions to 1 event"
        assert part_of(TRAP, lens.range) == "Trap"


def test_hover_over_words_and_comments_shows_nothing(editor: Editor) -> None:
    for words in ("it 🏃 wa|lks", "re|quirement walk", "|robot Walker"):
        place = editor.at("walker.rscd", words)
        parameters = lsp.HoverParams(place.text_document, place.position)
        assert editor.run(editor.client.text_document_hover_async(parameters)) is None


# Names


def definition(editor: Editor, name: str, words: str) -> lsp.Location:
    """Return the place where the name at the `|` of some words is defined."""
    place = editor.at(name, words)
    found = editor.run(
        editor.client.text_document_definition_async(lsp.DefinitionParams(place.text_document, place.position))
    )
    assert isinstance(found, lsp.Location)
    return found


def test_definitions_are_found_in_their_files(editor: Editor) -> None:
    assert definition(editor, "walker.rscd", "goto on_|") == editor.where("walker.rscd", "state |on_| {")
    assert definition(editor, "walker.rscd", "Base.|calm") == editor.where("parts.rscd", "state |calm| {")
    assert definition(editor, "walker.rscd", "provide w|alk") == editor.where("parts.rscd", "message |walk| with")
    assert definition(editor, "walker.rscd", "times: mo|st") == editor.where("walker.rscd", "constant |most|:")
    assert definition(editor, "walker.rscd", "lin|ear: {") == editor.where("parts.rscd", "{ |linear|: Vector")
    # Behind emoji, where characters and columns differ.
    assert definition(editor, "walker.rscd", "from pa|rts") == editor.where("parts.rscd", "library |parts| {")


def test_of_a_file_that_is_not_open_places_are_as_an_editor_will_show_it(tmp_path: Path) -> None:
    # A byte order mark is not shown, and each end of a line is one.
    saved = "\ufefflibrary Parts { component Lamp {} /* 🤖 */\r component Bell {}\r\n component Horn {}\n}"
    (tmp_path / "parts.rscd").write_bytes(saved.encode())
    with Editor(tmp_path) as editor:
        imported = "\n".join(f"component {name} from Parts import {name}" for name in ("Lamp", "Bell", "Horn"))
        editor.open("robot.rscd", f"robot R {{ {imported} }}")
        found = [definition(editor, "robot.rscd", f"import |{name}").range.start for name in ("Lamp", "Bell", "Horn")]
        assert found == [lsp.Position(0, 26), lsp.Position(1, 11), lsp.Position(2, 11)]


def references(editor: Editor, name: str, words: str, *, declared: bool = True) -> list[lsp.Location]:
    """Return the places where the name at the `|` of some words stands."""
    place = editor.at(name, words)
    context = lsp.ReferenceContext(include_declaration=declared)
    found = editor.run(
        editor.client.text_document_references_async(lsp.ReferenceParams(context, place.text_document, place.position))
    )
    return sorted(found, key=lambda item: (item.uri, item.range.start.line, item.range.start.character))


def test_references_are_found_in_all_files(editor: Editor) -> None:
    places = [
        editor.where("parts.rscd", "variable |count|:"),
        editor.where("parts.rscd", "if |count| > 1"),
        editor.where("walker.rscd", "Base.|count| <"),
    ]
    assert references(editor, "parts.rscd", "variable co|unt") == places
    assert references(editor, "walker.rscd", "Base.coun|t") == places
    assert references(editor, "walker.rscd", "Base.coun|t", declared=False) == places[1:]
    # Two enums of one name in two files are two.
    found = references(editor, "parts.rscd", "enum Lev|el")
    assert {item.uri for item in found} == {editor.uri("parts.rscd")} and len(found) == 2


def test_a_file_that_is_not_open_refers_to_a_library_too(tmp_path: Path) -> None:
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "walker.rscd").write_text(ROBOT, "utf-8")
    with Editor(tmp_path) as editor:
        editor.open("robots/parts.rscd", LIBRARY)
        found = references(editor, "robots/parts.rscd", "variable co|unt", declared=False)
    assert [Path(item.uri).name for item in found] == ["parts.rscd", "walker.rscd"]


def test_highlights_are_those_of_this_file(editor: Editor) -> None:
    place = editor.at("walker.rscd", "Button.la|st")
    found = editor.run(
        editor.client.text_document_document_highlight_async(
            lsp.DocumentHighlightParams(place.text_document, place.position)
        )
    )
    assert [part_of(ROBOT, item.range) for item in found] == ["last"] * 3


def rename(editor: Editor, name: str, words: str, new: str) -> dict[str, str]:
    """The texts after the name at the `|` of some words has got another."""
    place = editor.at(name, words)
    asked = lsp.PrepareRenameParams(place.text_document, place.position)
    assert editor.run(editor.client.text_document_prepare_rename_async(asked)) is not None
    parameters = lsp.RenameParams(place.text_document, place.position, new)
    found = editor.run(editor.client.text_document_rename_async(parameters))
    assert found is not None and found.changes is not None
    return {name: with_edits(text, found.changes.get(editor.uri(name), ())) for name, text in editor.texts.items()}


def test_a_name_is_changed_in_all_files(editor: Editor) -> None:
    texts = rename(editor, "walker.rscd", "Base.|calm", "quiet")
    assert texts["parts.rscd"] == LIBRARY.replace("calm", "quiet")
    assert texts["walker.rscd"] == ROBOT.replace("calm", "quiet")
    texts = rename(editor, "parts.rscd", "enum |Level", "Height")
    assert texts["walker.rscd"] == ROBOT
    assert texts["parts.rscd"] == LIBRARY.replace("Level", "Height")


def test_nothing_is_renamed_while_a_use_may_be_hidden(editor: Editor, tmp_path: Path) -> None:
    editor.replace(
        "walker.rscd",
        ROBOT.replace("requirement walk needs Base.calm and Button.on_", "requirement walk needs Button.on_ and"),
    )
    with pytest.raises(JsonRpcException, match=r"'on_' occurs in line 17 of walker\.rscd"):
        rename(editor, "walker.rscd", "goto |on_", "running")
    # Names of other things are not hidden.
    assert "^state" in rename(editor, "walker.rscd", "goto |off", "state")["walker.rscd"]
    editor.replace("walker.rscd", ROBOT)
    (tmp_path / "latin.rscd").write_bytes(
        "robot L { component Base from parts import Base // für calm\n }".encode("latin-1")
    )
    with pytest.raises(JsonRpcException, match=r"'calm' occurs in latin\.rscd, which is not UTF-8"):
        rename(editor, "walker.rscd", "Base.|calm", "quiet")


def test_nothing_is_renamed_where_not_all_files_are_searched(editor: Editor, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Project, "has_too_many_files", lambda project: True)
    with pytest.raises(JsonRpcException, match="hold more than 1000 models, and 'calm' may occur in any of them"):
        rename(editor, "walker.rscd", "Base.|calm", "quiet")


@pytest.mark.parametrize(
    "broken",
    [
        # The library that the file imports from is not to be seen.
        ROBOT.replace("from parts import", "from parts imprt"),
        ROBOT.replace("from parts import", "from parst import"),
        ROBOT.replace("from parts import", "from 'parts import"),
        ROBOT.replace("component Base from parts import Base", ""),
        # Nor is what stands behind a quote or a comment that is there by mistake.
        ROBOT.replace("requirement walk", '" requirement walk'),
        ROBOT.replace("requirement walk", "' requirement walk").replace("Button.off", "Button.off '"),
        ROBOT.replace("requirement walk", "/* requirement walk"),
    ],
)
def test_nothing_is_renamed_while_errors_hide_a_use_in_another_file(
    editor: Editor, tmp_path: Path, broken: str
) -> None:
    editor.replace("walker.rscd", broken)
    with pytest.raises(JsonRpcException, match=r"'calm' occurs in line \d+ of walker\.rscd, where errors hide"):
        rename(editor, "parts.rscd", "marked state |calm", "quiet")
    # So it is with one that is saved, and from a third file.
    editor.close("walker.rscd")
    (tmp_path / "walker.rscd").write_text(broken, "utf-8")
    editor.open("other.rscd", ROBOT)
    with pytest.raises(JsonRpcException, match=r"'calm' occurs in line \d+ of walker\.rscd, where errors hide"):
        rename(editor, "other.rscd", "Base.|calm", "quiet")
    # A name of the third file alone is nothing to it.
    assert "running" in rename(editor, "other.rscd", "goto |on_", "running")["other.rscd"]


def test_the_name_that_it_has_changes_nothing(editor: Editor) -> None:
    place = editor.at("walker.rscd", "Base.|calm")
    parameters = lsp.RenameParams(place.text_document, place.position, "calm")
    found = editor.run(editor.client.text_document_rename_async(parameters))
    assert found is not None and found.changes == {}


def test_a_word_of_the_language_becomes_a_name(editor: Editor) -> None:
    texts = rename(editor, "walker.rscd", "|most: integer", "state")
    assert texts["walker.rscd"] == ROBOT.replace("most", "^state")


@pytest.mark.parametrize(
    ("words", "new", "why"),
    [
        ("|most: integer", "a b", "is not a valid name"),
        ("|most: integer", "", "is not a valid name"),
        ("|most: integer", "x }", "is not a valid name"),
        ("|most: integer", "größe", "is not a valid name"),
        # Another of that name is there, or would be meant from then on.
        ("state |off {", "on_", "already has another meaning"),
        ("variable |last", "on_", "already has another meaning"),
        ("component |Button", "Base", "already has another meaning"),
    ],
)
def test_a_name_that_cannot_be_is_refused(editor: Editor, words: str, new: str, why: str) -> None:
    with pytest.raises(JsonRpcException, match=why):
        rename(editor, "walker.rscd", words, new)


def test_symbols_of_a_document_stand_one_in_the_other(editor: Editor) -> None:
    (whole,) = editor.run(
        editor.client.text_document_document_symbol_async(lsp.DocumentSymbolParams(editor.document("walker.rscd")))
    )
    assert (whole.name, whole.kind) == ("Walker", lsp.SymbolKind.Module)
    names = [item.name for item in whole.children]
    assert names == ["Base", "power_", "Button", "Level", "Asked", "most"]
    button = next(item for item in whole.children if item.name == "Button")
    assert [item.name for item in button.children] == ["pressed", "power", "last", "off", "on_"]
    for item in (whole, *whole.children, *button.children):
        text = part_of(ROBOT, item.range)
        assert part_of(ROBOT, item.selection_range) == item.name and item.name in text
    assert part_of(ROBOT, button.range).startswith("component Button {")


def test_symbols_of_all_files_are_found(editor: Editor, tmp_path: Path) -> None:
    (tmp_path / "other.rscd").write_text("robot Other { component Basement { } }")
    found = editor.run(editor.client.workspace_symbol_async(lsp.WorkspaceSymbolParams("bse")))
    assert {(item.name, Path(item.location.uri).name) for item in found} >= {
        ("Base", "parts.rscd"),
        ("Basement", "other.rscd"),
    }
    assert not editor.run(editor.client.workspace_symbol_async(lsp.WorkspaceSymbolParams("bsq")))


def test_semantic_tokens_cover_every_name(editor: Editor) -> None:
    legend = editor.initialized.capabilities.semantic_tokens_provider.legend
    found = editor.run(
        editor.client.text_document_semantic_tokens_full_async(lsp.SemanticTokensParams(editor.document("walker.rscd")))
    )
    line = character = 0
    tokens = []
    for index in range(0, len(found.data), 5):
        lines, characters, length, kind, modifiers = found.data[index : index + 5]
        line, character = line + lines, characters + (0 if lines else character)
        where = lsp.Range(lsp.Position(line, character), lsp.Position(line, character + length))
        names = [name for bit, name in enumerate(legend.token_modifiers) if modifiers >> bit & 1]
        tokens.append((part_of(ROBOT, where), legend.token_types[kind], *names))
    assert tokens[0] == ("Walker", "namespace", "declaration")
    assert tokens[1:4] == [("Base", "class", "declaration"), ("parts", "namespace"), ("Base", "class")]
    assert ("on_", "enumMember", "declaration") in tokens and ("on_", "enumMember") in tokens
    assert ("most", "variable", "declaration", "readonly") in tokens and ("most", "variable", "readonly") in tokens
    assert ("pressed", "event") in tokens and ("power", "function") in tokens and ("linear", "property") in tokens


def test_braces_and_comments_are_folded(editor: Editor) -> None:
    text = "// one\n// two\nrobot R {\n    component C {\n    }\n}\n"
    editor.replace("walker.rscd", text)
    found = editor.run(
        editor.client.text_document_folding_range_async(lsp.FoldingRangeParams(editor.document("walker.rscd")))
    )
    ranges = {(item.start_line, item.end_line, item.kind) for item in found}
    assert ranges == {(0, 1, lsp.FoldingRangeKind.Comment), (2, 4, lsp.FoldingRangeKind.Region)}


def formatted(editor: Editor) -> list[lsp.TextEdit]:
    """The edits that format the robot."""
    options = lsp.FormattingOptions(4, insert_spaces=True)
    parameters = lsp.DocumentFormattingParams(editor.document("walker.rscd"), options)
    return list(editor.run(editor.client.text_document_formatting_async(parameters)) or ())


def test_a_text_is_formatted_as_by_the_command(editor: Editor) -> None:
    assert with_edits(ROBOT, formatted(editor)) == format_text(ROBOT)
    editor.replace("walker.rscd", format_text(ROBOT))
    assert formatted(editor) == []
    editor.replace("walker.rscd", ROBOT + "}")
    assert formatted(editor) == []


def actions(editor: Editor, name: str, words: str, *kinds: str) -> list[lsp.CodeAction]:
    """The fixes at the `|` of some words; of some kinds alone if these are given."""
    place = editor.at(name, words)
    where = lsp.Range(place.position, place.position)
    parameters = lsp.CodeActionParams(place.text_document, where, lsp.CodeActionContext([], only=list(kinds) or None))
    return list(editor.run(editor.client.text_document_code_action_async(parameters)))


@pytest.mark.parametrize(
    ("right", "wrong", "title"),
    [("Base.calm", "Base.cl|am", "Write 'calm'"), ("response from pressed", "response t|o pressed", "Write 'from'")],
    ids=["name", "preposition"],
)
def test_a_word_that_is_nearly_right_is_fixed(editor: Editor, right: str, wrong: str, title: str) -> None:
    editor.replace("walker.rscd", ROBOT.replace(right, wrong.replace("|", "")))
    editor.findings("walker.rscd", bool)
    action, *_ = actions(editor, "walker.rscd", wrong)
    assert action.title == title and action.is_preferred and action.kind == lsp.CodeActionKind.QuickFix
    assert action.edit is not None and action.edit.changes is not None
    assert with_edits(editor.texts["walker.rscd"], action.edit.changes[editor.uri("walker.rscd")]) == ROBOT
    assert actions(editor, "walker.rscd", "provide wa|lk") == []


def test_fixes_are_of_the_text_as_it_is(editor: Editor) -> None:
    editor.replace("walker.rscd", ROBOT.replace("goto on_", "goto onn_"))
    editor.findings("walker.rscd", bool)
    at = editor.texts["walker.rscd"].index("on response from power goto onn_")
    editor.edit("walker.rscd", (at, at, "/* x */ "))
    (action,) = actions(editor, "walker.rscd", "goto onn|_")
    assert action.edit is not None and action.edit.changes is not None
    changed = with_edits(editor.texts["walker.rscd"], action.edit.changes[editor.uri("walker.rscd")])
    assert "/* x */ on response from power goto on_ }" in changed
    editor.edit(
        "walker.rscd", (at, at + len("/* x */ on response from power goto onn_"), "on response from power goto on_")
    )
    assert actions(editor, "walker.rscd", "power goto o|n_") == []


TWO_MISTAKES = ROBOT.replace("Base.calm", "Base.clam").replace("goto on_", "goto onn_")


def everywhere(editor: Editor, name: str) -> list[lsp.CodeAction]:
    """The fixes of a whole file."""
    where = lsp.Range(lsp.Position(0, 0), lsp.Position(10_000, 0))
    parameters = lsp.CodeActionParams(lsp.TextDocumentIdentifier(editor.uri(name)), where, lsp.CodeActionContext([]))
    return list(editor.run(editor.client.text_document_code_action_async(parameters)))


def test_what_takes_too_long_is_tried_when_it_is_chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "_FIX_TIME_S", -1.0)
    with Editor(tmp_path, "--synthesis-seconds", "0", resolves_edits=True) as editor:
        editor.open("parts.rscd", LIBRARY)
        editor.open("walker.rscd", TWO_MISTAKES)
        first, second = everywhere(editor, "walker.rscd")
        assert first.edit is not None and first.data is None
        assert second.edit is None and second.data is not None
        resolved = editor.run(editor.client.code_action_resolve_async(second))
        assert resolved.title == second.title and resolved.is_preferred
        text = editor.texts["walker.rscd"]
        for action in (resolved, first):
            assert action.edit is not None and action.edit.changes is not None
            text = with_edits(text, action.edit.changes[editor.uri("walker.rscd")])
        assert text == ROBOT
        assert editor.logged == []
        # Meanwhile somebody has put it right.
        editor.replace("walker.rscd", ROBOT)
        assert editor.run(editor.client.code_action_resolve_async(second)).edit is None
        assert editor.logged == [f"{second.title}: this does not fix the finding in the current text"]


def test_an_editor_that_cannot_ask_later_receives_what_was_not_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "_FIX_TIME_S", -1.0)
    with Editor(tmp_path, "--synthesis-seconds", "0") as editor:
        editor.open("parts.rscd", LIBRARY)
        editor.open("walker.rscd", TWO_MISTAKES)
        assert len(everywhere(editor, "walker.rscd")) == 1
        (entry,) = editor.logged
        assert entry.startswith("1 finding of this range not tried for fixes")


def test_a_control_node_of_several_lines_is_written_as_states(editor: Editor) -> None:
    tree = ROBOT.rstrip().removesuffix("}") + "    Sequence {\n        walk\n        walk\n    }\n}\n"
    editor.open("tree.rscd", tree)
    (action,) = actions(editor, "tree.rscd", "Seq|uence {")
    assert action.edit is not None and action.edit.changes is not None
    changed = with_edits(tree, action.edit.changes[editor.uri("tree.rscd")])
    assert "    component Order {\n        behaviour {" in changed
    assert "Sequence" not in changed


def test_other_kinds_of_actions_are_none_of_these(editor: Editor) -> None:
    editor.replace("walker.rscd", ROBOT.replace("goto on_", "goto onn_"))
    assert actions(editor, "walker.rscd", "goto onn|_", "source.organizeImports") == []
    assert len(actions(editor, "walker.rscd", "goto onn|_", "quickfix")) == 1


def test_a_name_that_is_a_word_is_written_as_a_name(editor: Editor) -> None:
    behaviour = "behaviour { initial marked state ^request { on response from m goto reqest } }"
    text = f"robot R {{ component C {{ outgoing message m with type: none {behaviour} }} }}"
    editor.open("words.rscd", text)
    (action,) = actions(editor, "words.rscd", "goto req|est")
    assert action.title == "Write '^request'"


def test_syntax_of_other_languages_is_fixed(editor: Editor) -> None:
    editor.open("other.rscd", "robot R {\n  requirement A && B disables c // 🤖\n}")
    editor.findings("other.rscd", bool)
    (action,) = actions(editor, "other.rscd", "A |&& B")
    assert action.title == "Write 'and'" and action.edit is not None and action.edit.changes is not None
    changed = with_edits(editor.texts["other.rscd"], action.edit.changes[editor.uri("other.rscd")])
    assert changed == "robot R {\n  requirement A and B disables c // 🤖\n}"


def test_a_fix_that_brings_more_errors_is_not_offered(editor: Editor) -> None:
    messages = "incoming message m with type: none incoming message n with type: none"
    editor.open("lamps.rscd", f"library Lamps {{ component Lamp {{ {messages} }} component Other {{ }} }}")
    editor.open("double.rscd", f"robot R {{ component Own {{ {messages} }} component L from Lamps import Othr }}")
    assert editor.codes("double.rscd", bool) == ["unknown-name"]
    assert [action.title for action in actions(editor, "double.rscd", "import Ot|hr")] == ["Write 'Other'"]
    editor.replace("double.rscd", editor.texts["double.rscd"].replace("Othr", "Lmp"))
    assert editor.codes("double.rscd", bool) == ["unknown-name"]
    assert actions(editor, "double.rscd", "import Lm|p") == []


# Completion


def test_behind_requirement_communications_are_offered(editor: Editor) -> None:
    found = typed(editor, "requirement |\n    requirement walk", "requirement walk")
    assert found[:2] == ["walk", "power"] and "pressed" not in found[:2]
    assert {"always", "never"} <= set(found)


def test_behind_goto_states_are_offered(editor: Editor) -> None:
    assert typed(editor, "on response from power goto o| } }", "on response from power goto off }")[:2] == [
        "off",
        "on_",
    ]


def test_in_values_properties_are_offered(editor: Editor) -> None:
    assert typed(editor, "power with { |data", "power with { data")[:3] == ["data:", "level:", "times:"]
    assert typed(editor, "walk with { linear: { | } }", "walk with { linear: { x: 0.5 } }")[:1] == ["x:"]


def test_values_of_the_expected_enum_come_first(editor: Editor) -> None:
    assert typed(editor, "needs Button.last = | or", "needs Button.last = high or")[:2] == ["high", "low"]
    assert typed(editor, "last: Level = |\n", "last: Level = low\n")[:2] == ["high", "low"]


def test_members_are_offered_behind_a_point(editor: Editor) -> None:
    assert set(typed(editor, "needs Button.| and", "needs Base.calm and")) == {"off", "on_", "last"}


def test_what_can_be_imported_is_offered(editor: Editor) -> None:
    assert "parts" in typed(
        editor, "component Base from |\n    interface", "component Base from parts import Base\n    interface"
    )
    assert typed(editor, "component Base from parts import |\n", "component Base from parts import Base\n")[:1] == [
        "Base"
    ]


def test_types_of_an_installed_ament_index_are_offered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    share = tmp_path / "ros" / "share"
    for package, kind, name in (
        ("robot_msgs", "msg", "Wheel"),
        ("robot_msgs", "srv", "Turn"),
        ("arm_msgs", "msg", "Joint"),
    ):
        folder = share / package / kind
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.{kind}").write_text("bool ok\n---\n" if kind == "srv" else "bool ok\n")
        index = share / "ament_index" / "resource_index" / "packages"
        index.mkdir(parents=True, exist_ok=True)
        (index / package).write_text("")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "ros"))
    with Editor(tmp_path) as editor:
        editor.open("r.rscd", "robot R {\n    interface w use Wh from robot_msgs\n}\n")
        assert {"Wheel", "Turn", "Joint"} <= set(complete(editor, "r.rscd", "use Wh| from"))
        editor.replace("r.rscd", "robot R {\n    interface w use Wheel from \n}\n")
        assert complete(editor, "r.rscd", "Wheel from |")[:1] == ["robot_msgs"]


def test_a_misspelt_field_is_put_right_wherever_it_is_named(editor: Editor) -> None:
    right = """robot R {
    interface i use BatteryState from sensor_msgs
    datatype object Battery { percentage: double }
    datatype enum Level from Battery to { value.percentage < 0.2 -> low default -> high }
    component C { outgoing message m with type: Level links i }
}
"""
    editor.open("battery.rscd", right.replace("percentage", "percentag"))
    place = editor.at("battery.rscd", "percen|tag: double")
    where = lsp.Range(place.position, place.position)
    (action,) = editor.run(
        editor.client.text_document_code_action_async(
            lsp.CodeActionParams(place.text_document, where, lsp.CodeActionContext([]))
        )
    )
    assert action.title == "Write 'percentage'"
    ((_, edits),) = action.edit.changes.items()
    assert with_edits(editor.texts["battery.rscd"], edits) == right


def test_types_that_come_with_robosc_are_offered(editor: Editor) -> None:
    editor.open("r.rscd", "robot R {\n    interface w use MoveB from \n}\n")
    assert "MoveBase" in complete(editor, "r.rscd", "use MoveB| from")
    editor.replace("r.rscd", "robot R {\n    interface w use MoveBase from \n}\n")
    assert complete(editor, "r.rscd", "MoveBase from |")[:1] == ["move_base_msgs"]


def test_types_in_named_folders_are_offered_also_new_ones(tmp_path: Path) -> None:
    messages = tmp_path / "mine" / "own_msgs" / "msg"
    messages.mkdir(parents=True)
    (messages / "Wanted.msg").write_text("bool data\n")
    with Editor(tmp_path, "--synthesis-seconds", "0", "--interface-path", str(tmp_path / "mine")) as editor:
        editor.open("robot.rscd", "robot R { interface x use W }")
        assert "Wanted" in complete(editor, "robot.rscd", "use W|")
        editor.save("mine/own_msgs/msg/Added.msg", "bool data\n")
        assert {"Added", "Wanted"} <= set(complete(editor, "robot.rscd", "use W|"))


def test_in_comments_nothing_is_offered(editor: Editor) -> None:
    assert complete(editor, "walker.rscd", "it 🏃 walks|") == []


def test_what_is_offered_replaces_what_is_typed(editor: Editor) -> None:
    editor.replace("walker.rscd", ROBOT.replace("Base.calm", "Base.ca"))
    place = editor.at("walker.rscd", "Base.ca|")
    found = editor.run(
        editor.client.text_document_completion_async(lsp.CompletionParams(place.text_document, place.position))
    )
    item = next(item for item in found.items if item.label == "calm")
    assert isinstance(item.text_edit, lsp.TextEdit)
    assert with_edits(editor.texts["walker.rscd"], [item.text_edit]) == ROBOT


# Texts in the middle of being typed


@pytest.mark.parametrize(
    "broken",
    [
        ROBOT.replace("requirement walk needs Base.calm and Button.on_", "requirement walk needs Base.calm and"),
        ROBOT.replace("provide walk with { linear: { x: 0.5 } }", "provide walk with { linear: {"),
        ROBOT.replace("service power with request: Asked", "service power with request:"),
        ROBOT.replace("constant most: integer = 2", "constant most: integer = (2"),
        ROBOT.replace("variable last: Level = low", "variable last: Level ="),
        ROBOT[: ROBOT.rindex("}")],
        ROBOT[: ROBOT.index("provide power")],
    ],
)
def test_what_is_sound_is_known(editor: Editor, broken: str) -> None:
    editor.replace("walker.rscd", broken)
    assert "syntax-error" in editor.codes("walker.rscd", bool)
    check_button_is_known(editor)


def check_button_is_known(editor: Editor) -> None:
    (whole,) = editor.run(
        editor.client.text_document_document_symbol_async(lsp.DocumentSymbolParams(editor.document("walker.rscd")))
    )
    assert whole.name
    button = next(item for item in whole.children if item.name == "Button")
    assert {item.name for item in button.children} >= {"pressed", "off", "on_"}
    assert "outgoing message pressed" in hover(editor, "walker.rscd", "response from pre|ssed")
    assert definition(editor, "walker.rscd", "goto on|_") == editor.where("walker.rscd", "state |on_| {")


@pytest.mark.parametrize(
    ("broken", "code"),
    [
        (ROBOT.replace("provide walk", '" provide walk'), "unclosed-string"),
        (ROBOT.replace('"/button"', '"/button'), "unclosed-string"),
        (f'"\n{ROBOT}', "unclosed-string"),
        (ROBOT.replace("constant most", "constant 'most"), "unclosed-string"),
        (ROBOT.replace("provide walk", "/* provide walk"), "unclosed-comment"),
        (ROBOT.replace("variable last", "\0 variable last"), "invalid-character"),
        (ROBOT.replace("robot Walker", "robot"), "syntax-error"),
        (ROBOT.replace("robot Walker", "robot state"), "syntax-error"),
    ],
)
def test_what_hides_the_rest_is_one_error_and_hides_nothing(editor: Editor, broken: str, code: str) -> None:
    editor.replace("walker.rscd", broken)
    assert editor.codes("walker.rscd", bool) == [code]
    if '"/button"' in broken:
        check_button_is_known(editor)
    assert "incoming message walk" in hover(editor, "walker.rscd", "requirement wa|lk")
    found = complete(editor, "walker.rscd", "do last := |value")
    assert found[:2] == ["high", "low"]
    word = editor.position(broken, broken.index("robot") + 3)
    parameters = lsp.HoverParams(editor.document("walker.rscd"), word)
    assert editor.run(editor.client.text_document_hover_async(parameters)) is None


@pytest.mark.parametrize(
    ("broken", "code"),
    [
        (LIBRARY.replace("state calm", '" state calm'), "unclosed-string"),
        (LIBRARY.replace("library", "'\nlibrary"), "unclosed-string"),
        (LIBRARY.replace("message level", "/* message level"), "unclosed-comment"),
        (f"/*{LIBRARY}", "unclosed-comment"),
        (f"\0{LIBRARY}", "invalid-character"),
        (LIBRARY.replace("message walk", "mesage walk"), "syntax-error"),
        (LIBRARY.replace("linear: Vector", "linear Vector"), "syntax-error"),
        (LIBRARY.replace("initial marked state calm", "initial marked stat calm"), "syntax-error"),
    ],
)
def test_what_is_wrong_in_a_library_is_nothing_else_in_the_robot(editor: Editor, broken: str, code: str) -> None:
    editor.replace("parts.rscd", broken)
    (found,) = editor.findings("walker.rscd", bool)
    assert found.code == code and "parts.rscd:" in found.message


# Faults


def test_files_that_are_not_there_are_answered(editor: Editor) -> None:
    nowhere = lsp.TextDocumentIdentifier(editor.uri("nowhere.rscd"))
    start = lsp.Position(0, 0)
    client = editor.client
    assert editor.run(client.text_document_hover_async(lsp.HoverParams(nowhere, start))) is None
    assert editor.run(client.text_document_definition_async(lsp.DefinitionParams(nowhere, start))) is None
    assert not editor.run(client.text_document_completion_async(lsp.CompletionParams(nowhere, start))).items
    assert not editor.run(client.text_document_document_symbol_async(lsp.DocumentSymbolParams(nowhere)))
    assert not editor.run(client.text_document_code_lens_async(lsp.CodeLensParams(nowhere)))


@pytest.mark.parametrize("uri", ["untitled:Untitled-1", "https://example.org/x.rscd", "file:///a%00b.rscd", "file://"])
def test_texts_that_are_no_files_are_known(editor: Editor, uri: str) -> None:
    editor.open(uri, "robot R { component C { behaviour { initial marked state s { transition goto t } } } }")
    assert editor.codes(uri, bool) == ["unknown-name"]


def test_positions_that_are_nowhere_are_answered(editor: Editor) -> None:
    place = editor.document("walker.rscd")
    for position in (lsp.Position(10_000, 0), lsp.Position(0, 10_000), lsp.Position(2**31 - 1, 2**31 - 1)):
        editor.run(editor.client.text_document_hover_async(lsp.HoverParams(place, position)))
        editor.run(editor.client.text_document_completion_async(lsp.CompletionParams(place, position)))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-32"])
def test_columns_are_counted_as_the_editor_does(tmp_path: Path, encoding: str) -> None:
    with Editor(tmp_path, encodings=(encoding,)) as editor:
        assert editor.encoding == encoding
        editor.open("parts.rscd", LIBRARY)
        editor.open("walker.rscd", ROBOT)
        assert definition(editor, "walker.rscd", "from pa|rts").range.start == position_of(
            LIBRARY, LIBRARY.index("parts {"), encoding
        )
        place = editor.at("walker.rscd", "/* 😀 */ on response from po|wer")
        found = editor.run(
            editor.client.text_document_hover_async(lsp.HoverParams(place.text_document, place.position))
        )
        at = ROBOT.index("power goto on_")
        assert found.range == lsp.Range(
            position_of(ROBOT, at, encoding), position_of(ROBOT, at + len("power"), encoding)
        )


def test_folders_that_are_worked_in_can_change(editor: Editor, tmp_path: Path) -> None:
    other = tmp_path.parent / f"{tmp_path.name}-other"
    other.mkdir()
    (other / "far.rscd").write_text("robot Faraway { }")
    folder = lsp.WorkspaceFolder(other.as_uri(), "other")

    def found() -> set[str]:
        symbols = editor.run(editor.client.workspace_symbol_async(lsp.WorkspaceSymbolParams("Faraway")))
        return {item.name for item in symbols}

    for added, removed, names in (([folder], [], {"Faraway"}), ([], [folder], set())):
        event = lsp.WorkspaceFoldersChangeEvent(added, removed)
        editor.client.workspace_did_change_workspace_folders(lsp.DidChangeWorkspaceFoldersParams(event))
        assert found() == names
    shutil.rmtree(other)
