"""Language D.5: comments that accept a finding."""

import json
from pathlib import Path

import pytest

from robosc.certification import make_supervisor
from robosc.cli.main import main
from robosc.diagnostics import Stage, pages
from robosc.formatting import format_text
from robosc.model.acceptances import AFTER_SYNTHESIS, LATER
from robosc.model.check import inspect
from support.models import bundle_of, checked

SHARED = """robot Lamp {{
    component Switch {{ outgoing message pressed with identifier: "/pressed", type: none }}
    component Button {{
{0}
    }}
}}
"""
PUSHED = 'outgoing message pushed with identifier: "/pressed", type: none'


def findings(text: str) -> list[tuple[str, int]]:
    return [(item.code, item.location.line if item.location else 0) for item in checked(text).diagnostics]


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (PUSHED, [("shared-topic", 4)]),
        (f"// robosc: accept shared-topic: both are pressed\n{PUSHED}", []),
        (f"{PUSHED} // robosc: accept shared-topic: both are pressed", []),
        (f"{PUSHED} //robosc:accept shared-topic:both", []),
        # Another code, too far away, no reason, in a text or a block comment.
        (f"// robosc: accept partial-update: no\n{PUSHED}", [("needless-acceptance", 4), ("shared-topic", 5)]),
        (f"// robosc: accept shared-topic: no\n\n{PUSHED}", [("needless-acceptance", 4), ("shared-topic", 6)]),
        (f"// robosc: accept shared-topic\n{PUSHED}", [("needless-acceptance", 4), ("shared-topic", 5)]),
        (f"/* // robosc: accept shared-topic: no */\n{PUSHED}", [("shared-topic", 5)]),
        # Several on lines of their own are for the next line that is none.
        (
            f"// robosc: accept shared-topic: yes\n// robosc: accept partial-update: no\n{PUSHED}",
            [("needless-acceptance", 5)],
        ),
        # A finding of synthesis is not judged by a check of the model.
        (f"// robosc: accept competing-requests: maybe\n{PUSHED}", [("shared-topic", 5)]),
    ],
)
def test_a_comment_accepts_what_is_on_its_line_or_the_next(lines: str, expected: list[tuple[str, int]]) -> None:
    assert findings(SHARED.format(lines)) == expected


def test_an_error_cannot_be_accepted() -> None:
    found = checked("robot R { requirement x needs false } // robosc: accept unknown-name: so what").diagnostics
    assert [item.code for item in found] == ["unknown-name"]
    assert found[0].severity == "error"


def test_what_is_accepted_keeps_its_reason_and_editors_honour_it() -> None:
    bundle = bundle_of(SHARED.format(f"// robosc: accept shared-topic: both\n{PUSHED}"))
    result = inspect(bundle).checked
    assert result.diagnostics == () and result.model is not None
    (item,) = result.accepted
    assert (item.code, item.accepted, item.to_json()["accepted"]) == ("shared-topic", "both", "both")
    assert str(item).endswith("[shared-topic] (accepted: both)")


COMPETING = """robot R {
    component C {
        incoming message a with identifier: "/a", type: none
        incoming message b with identifier: "/a", type: none // robosc: accept competing-requests: in turn
        incoming message c with identifier: "/c", type: none // robosc: accept unused-requirement: none
    }
}
"""


def test_findings_of_synthesis_are_accepted_too() -> None:
    made = make_supervisor(bundle_of(COMPETING))
    assert [item.code for item in made.diagnostics] == ["needless-acceptance"]
    assert [(item.code, item.accepted) for item in made.accepted] == [("competing-requests", "in turn")]


def test_check_all_shows_what_is_accepted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "r.rscd"
    file.write_text(SHARED.format(f"{PUSHED} // robosc: accept shared-topic: both"), encoding="utf-8")
    assert main(["check", "--strict", str(file)]) == 0
    assert "shared-topic" not in "".join(capsys.readouterr())
    assert main(["check", "--strict", "--all", str(file)]) == 0
    assert "[shared-topic] (accepted: both)" in capsys.readouterr().err
    assert main(["check", "--json", str(file)]) == 0
    assert "accepted" not in json.loads(capsys.readouterr().out)
    assert main(["check", "--json", "--all", str(file)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["diagnostics"], found["accepted"][0]["accepted"]) == ([], "both")


def test_the_formatter_keeps_them() -> None:
    text = SHARED.format(f"// robosc: accept shared-topic: both\n{PUSHED}")
    assert findings(format_text(text, "r.rscd")) == []


def test_the_codes_of_later_stages_are_those_of_their_pages() -> None:
    assert {item.code for item in pages() if item.stage not in (Stage.TEXT, Stage.MODEL)} == LATER
    assert AFTER_SYNTHESIS < LATER
