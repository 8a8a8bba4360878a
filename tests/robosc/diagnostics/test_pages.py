"""Every code has a page, every page's example is reported as it says, and what it fixes is sound."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from msgspec.structs import replace

from robosc.automata import to_automata
from robosc.certification import OutcomeStatus, make_supervisor
from robosc.cif import check_cif
from robosc.diagnostics import Block, Page, Stage, codes, document, page, pages, parse_page
from robosc.editing.findings import no_supervisor
from robosc.errors import Diagnostic, InternalError, LanguageError, Severity
from robosc.explanation import ModelWords, explain_synthesis
from robosc.language import parse
from robosc.language.interfaces import find_interfaces, interface_folders
from robosc.language.reading import MAXIMUM_BYTES, decode_source
from robosc.model.check import check
from robosc.model.structure import Deployment
from robosc.plain_automata import check_automata
from robosc.source import Bundle, SourceFile
from support.diagnostic_codes import NO_CODES, assembled_codes, reportable_codes

DOCUMENT = Path(__file__).parents[3] / "docs" / "diagnostics.md"


def bundle_of(blocks: tuple[Block, ...]) -> Bundle:
    """The model and the libraries of a page's blocks."""
    (main,) = (block for block in blocks if block.library is None)
    libraries = [block for block in blocks if block.library is not None]
    files = tuple(SourceFile(f"{block.library}{n}.rscd", block.text) for n, block in enumerate(libraries))
    ending = main.kind if main.kind in ("gen", "wmod") else "rscd"
    return Bundle(SourceFile(f"model.{ending}", main.text), files)


def findings(item: Page, blocks: tuple[Block, ...]) -> tuple[Diagnostic, ...]:
    """Return the findings of a page's stage about its blocks."""
    bundle = bundle_of(blocks)
    if blocks[0].kind == "cif":
        return cif_findings(bundle)
    if blocks[0].kind in ("gen", "wmod"):
        return check_automata(bundle).diagnostics
    # The definitions of ROS's own types come with what the tests are installed with.
    texts = (file.text for file in bundle.files)
    # Some packages of other pages are made up, and their definitions are not searched for.
    searched = (".",) if item.code == "definition-not-found" else ()
    bundle = replace(bundle, searched=searched, interfaces=find_interfaces(texts, interface_folders()))
    if item.stage in (Stage.TEXT, Stage.MODEL):
        checked = check(bundle)
        if checked.model is None:
            with pytest.raises(LanguageError) as raised:
                checked.model_or_raise()
            return raised.value.diagnostics
        return checked.diagnostics
    if item.stage is Stage.EXPLANATION:
        return remarks(bundle)
    deployment = Deployment.LAYER if item.stage is Stage.TARGET else Deployment.CONTROLLER
    made = make_supervisor(bundle, deployment=deployment)
    if made.status is not OutcomeStatus.EMPTY:
        return made.diagnostics
    robot = parse(bundle.main).tree
    assert robot is not None
    return (*made.diagnostics, no_supervisor(made.reason, robot.name.location))


def cif_findings(bundle: Bundle) -> tuple[Diagnostic, ...]:
    """Return the findings about a CIF model."""
    return check_cif(bundle).diagnostics


def remarks(bundle: Bundle) -> tuple[Diagnostic, ...]:
    """Return the warnings of an explanation as findings."""
    checked = check(bundle)
    model = checked.model_or_raise()
    assert checked.places is not None
    system = to_automata(model, Deployment.CONTROLLER)
    assert checked.places is not None
    explanation = explain_synthesis(ModelWords(model, checked.places, system, Deployment.CONTROLLER))
    return tuple(
        Diagnostic(Severity.WARNING, remark.kind, remark.message, remark.location, "") for remark in explanation.remarks
    )


def marked(blocks: tuple[Block, ...]) -> list[tuple[str, int]]:
    """The file and line of every mark."""
    bundle = bundle_of(blocks)
    texts = {file.text: file.name for file in bundle.files}
    return [(texts[block.text], line) for block in blocks for line in block.marked_lines]


PAGES = pages()
AUTOMATIC = ("robosc", "cif", "gen", "wmod")
"""Kinds of texts that are checked."""
SHOWN = [item for item in PAGES if item.example[0].kind in AUTOMATIC]
TYPED = [item for item in PAGES if item.example[0].kind == "console"]


def test_every_code_has_a_page_and_every_page_a_code() -> None:
    assert sorted(reportable_codes()) == list(codes())


def test_no_code_is_hidden_from_the_collection() -> None:
    assert assembled_codes() == ()
    assert not NO_CODES & set(codes())


@pytest.mark.parametrize("item", PAGES, ids=lambda item: item.code)
def test_a_page_has_its_shape(item: Page) -> None:
    assert 20 <= len(item.summary) + len(item.code) <= 130
    assert len(item.summary) <= 100
    assert not item.markdown.endswith("\n\n")
    assert max(map(len, item.markdown.splitlines())) <= 120
    assert item.fixed
    assert {block.kind for block in (*item.example, *item.fixed)} <= {*AUTOMATIC, "console"}
    assert set(item.see_also) <= set(codes()) - {item.code}
    assert len(set(item.see_also)) == len(item.see_also)
    assert not any(block.marked_lines for block in item.fixed)
    prose = re.sub(r"```.*?```", "", item.markdown, flags=re.DOTALL)
    assert len(prose.split()) > 40, "too little is said"


@pytest.mark.parametrize("item", SHOWN, ids=lambda item: item.code)
def test_an_example_is_reported_with_its_code_at_the_mark(item: Page) -> None:
    found = findings(item, item.example)
    assert {(one.code, one.severity) for one in found} == {(item.code, item.severity)}, found
    places = {(one.location.file, one.location.line) for one in found if one.location is not None}
    assert sorted(places) == sorted(marked(item.example))


def test_all_examples_bear_a_mark_where_there_is_a_place() -> None:
    assert [item.code for item in SHOWN if not marked(item.example)] == ["deadlock", "no-robot", "only-uncontrollable"]


@pytest.mark.parametrize("item", PAGES, ids=lambda item: item.code)
def test_what_is_fixed_is_sound(item: Page) -> None:
    if item.fixed[0].kind in AUTOMATIC:
        found = findings(item, item.fixed)
        # A note reports no fault, and what is fixed may well be worth one.
        assert [one for one in found if one.severity is not Severity.NOTE or one.code == item.code] == []


@pytest.mark.parametrize("item", TYPED, ids=lambda item: item.code)
def test_a_session_goes_as_it_is_shown(item: Page, tmp_path: Path) -> None:
    """All commands run in one folder; each expected line is printed, in that order."""
    sessions = [*item.example, *(block for block in item.fixed if block.kind == "console")]
    for number, block in enumerate(sessions):
        lines = block.text.splitlines()
        commands = "\n".join(line.removeprefix("$ ") for line in lines if line.startswith("$ "))
        environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
        result = subprocess.run(
            ["sh", "-ec", commands],
            cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        printed = iter((result.stdout + result.stderr).splitlines())
        for line in lines:
            if not line.startswith("$ "):
                assert line in printed, (line, result.stderr)
        is_example = number < len(item.example)
        assert result.returncode == (1 if is_example and item.severity is Severity.ERROR else 0), result.stderr
        assert (f"[{item.code}]" in result.stderr) == is_example


def test_limits_in_pages_are_those_of_the_source() -> None:
    assert f"more than {MAXIMUM_BYTES} bytes" in page("file-too-large").markdown
    assert f"larger than {MAXIMUM_BYTES // 2**20} MiB" in page("file-too-large").markdown
    with pytest.raises(LanguageError) as raised:
        decode_source(b" " * (MAXIMUM_BYTES + 1), "dump.rscd")
    assert [item.code for item in raised.value.diagnostics] == ["file-too-large"]


def test_the_document_is_what_the_command_prints() -> None:
    """`robosc explain --all > docs/diagnostics.md` writes it anew."""
    assert DOCUMENT.read_text(encoding="utf-8") == document()


def test_the_index_of_the_document_leads_to_a_chapter_for_each_code() -> None:
    text = re.sub(r"^```.*?^```$", "", document(), flags=re.MULTILINE | re.DOTALL)
    assert re.findall(r"^\| \[(.+?)\]\(#(.+?)\) \|", text, flags=re.MULTILINE) == [(code, code) for code in codes()]
    assert re.findall(r"^## (.+)$", text, flags=re.MULTILINE) == list(codes())
    assert re.findall(r"^# (.+)$", text, flags=re.MULTILINE) == ["Diagnostic codes"]
    assert set(re.findall(r"\]\(#(.+?)\)", text)) == set(codes())


def test_what_is_fenced_stays_as_it_is_in_the_document() -> None:
    text = document()
    for item in PAGES:
        for block in (*item.example, *item.fixed):
            assert block.text in text


SOUND = """\
# a-b

severity: note
stage: model

Bad. Very.

## Example

```robosc
x // <- here
```

## Fix

Do.
"""


def test_a_page_is_read() -> None:
    found = parse_page("a-b", SOUND + "\n```robosc library=Lib\ny\n```\n\n## See also\n\n- `c-d`\n- `e-f`\n")
    assert (found.severity, found.stage, found.summary) == (Severity.NOTE, Stage.MODEL, "Bad")
    assert found.example == (Block("robosc", None, "x // <- here\n"),)
    assert found.example[0].marked_lines == (1,)
    assert found.fixed == (Block("robosc", "Lib", "y\n"),)
    assert found.see_also == ("c-d", "e-f")


@pytest.mark.parametrize(
    ("sound", "broken"),
    [
        ("# a-b", "# a-c"),
        ("severity: note", "severity: fatal"),
        ("stage: model", "stage: never"),
        ("stage: model\n", ""),
        ("## Fix", "## Repair"),
        ("## Example", "## Examples"),
    ],
)
def test_a_page_of_another_shape_is_our_fault(sound: str, broken: str) -> None:
    with pytest.raises(InternalError, match="the page about a-b"):
        parse_page("a-b", SOUND.replace(sound, broken))


def test_there_is_no_page_about_nothing() -> None:
    with pytest.raises(KeyError):
        page("../pages/unknown-name")
