"""Pages about diagnostic codes, read from files and joined to one document.

Each code has one Markdown file in the folder `pages`. All files have this shape:

    # code
    severity: error
    stage: model
    What is wrong, and why it matters for the robot; lists show only the first sentence.
    ## Example
    Fenced texts that are reported with exactly this code, at the line that ends in `// <- here`.
    ## Fix
    A sentence or two and fenced texts that are free of it.
    ## See also
    - `another-code`

A fence says what it holds: `robosc` (the model), `robosc library=NAME` (a library that the model imports), `cif` (a
CIF model), `cif library=NAME` (a file that it imports), `gen` or `wmod` (plain automata), or `console` (a session at a
shell, for a fault that no text can show: a NUL, a file of 16 MiB).
"""

import re
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.resources import files

from robosc.errors import InternalError, Severity, UnknownNameError
from robosc.model.findings import did_you_mean

MARK = "// <- here"
"""Ends the line of an example at which the finding is reported."""

_SUFFIX = ".md"
_SECTIONS = ("Example", "Fix", "See also")
_FENCE = re.compile(r"^```(\S[^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_FENCED_OR_HEADING = re.compile(r"^```.*?^```$|^(?=#)", re.MULTILINE | re.DOTALL)
_REFERENCE = re.compile(r"^- `([a-z0-9-]+)`$", re.MULTILINE)
_HEAD = re.compile(
    r"# (?P<code>[a-z0-9-]+)\n\nseverity: (?P<severity>\w+)\nstage: (?P<stage>\w+)\n\n(?P<text>.*)", re.DOTALL
)


class Stage(StrEnum):
    """Stage that reports a code."""

    TEXT = "text"
    """Reading the text: spelling, brackets, sizes."""
    MODEL = "model"
    """Checking the model: names, types, behaviours."""
    SYNTHESIS = "synthesis"
    """Synthesis, which alone knows the controlled system."""
    EXPLANATION = "explanation"
    """`robosc explain-synthesis`, which goes through what the controlled system does."""
    TARGET = "target"
    """Making a supervisor or a package for one kind of use."""


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced text of a page.

    Attributes:
        kind: `robosc`, `cif`, `gen`, `wmod` or `console`.
        library: Name of the library that it holds, or None where it holds the robot or a session.
        text: Text between the fences.
    """

    kind: str
    library: str | None
    text: str

    @property
    def marked_lines(self) -> tuple[int, ...]:
        """Lines, from 1, that bear the mark."""
        return tuple(number for number, line in enumerate(self.text.splitlines(), 1) if line.endswith(MARK))

    def to_json(self) -> dict[str, object]:
        """The block as plain JSON values."""
        return {"kind": self.kind, "library": self.library, "text": self.text, "lines": list(self.marked_lines)}


@dataclass(frozen=True, slots=True, repr=False)
class Page:
    """Explanation of one code.

    Attributes:
        code: The code.
        severity: Severity of its findings.
        stage: Stage that reports it.
        summary: Description of what is wrong, in one sentence.
        markdown: The whole page.
        example: Texts that are reported with this code.
        fixed: Texts that are not.
        see_also: Other codes.
    """

    code: str
    severity: Severity
    stage: Stage
    summary: str
    markdown: str
    example: tuple[Block, ...]
    fixed: tuple[Block, ...]
    see_also: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<page about {self.code}: {self.summary}>"

    def __str__(self) -> str:
        return self.markdown

    def _repr_markdown_(self) -> str:
        return self.markdown

    def head_json(self) -> dict[str, object]:
        """Code, severity, stage and summary as plain JSON values."""
        return {
            "code": self.code,
            "severity": str(self.severity),
            "stage": str(self.stage),
            "summary": self.summary,
        }

    def to_json(self) -> dict[str, object]:
        """The page as plain JSON values."""
        return {
            **self.head_json(),
            "markdown": self.markdown,
            "example": [block.to_json() for block in self.example],
            "fixed": [block.to_json() for block in self.fixed],
            "see_also": list(self.see_also),
        }


@cache
def codes() -> tuple[str, ...]:
    """Every code that has a page, sorted."""
    names = (item.name for item in (files(__package__) / "pages").iterdir())
    return tuple(sorted(name.removesuffix(_SUFFIX) for name in names if name.endswith(_SUFFIX)))


class UnknownCodeError(UnknownNameError):
    """A diagnostic code that there is not."""


def page(code: str) -> Page:
    """The page about a code.

    Raises:
        UnknownCodeError: No page is about it; the message names the nearest code.
    """
    # The command `check` prints codes in brackets.
    wanted = code.strip("[]").lower()
    if wanted not in codes():
        near = did_you_mean(wanted, codes())
        hint = f"did you mean '{near}'?" if near else "'robosc explain --list' lists them"
        raise UnknownCodeError(f"there is no diagnostic code '{code}'; {hint}")
    text = (files(__package__) / "pages" / f"{wanted}{_SUFFIX}").read_text(encoding="utf-8")
    return parse_page(wanted, text)


def pages() -> tuple[Page, ...]:
    """Every page, by code."""
    return tuple(page(code) for code in codes())


def parse_page(code: str, markdown: str) -> Page:
    """The page in a text.

    Raises:
        InternalError: It does not have the shape of a page; the message names `code`.
    """
    head = _HEAD.fullmatch(markdown)
    if head is None or head["code"] != code:
        raise InternalError(f"the page about {code} does not begin with '# {code}', its severity and its stage")
    try:
        severity, stage = Severity(head["severity"]), Stage(head["stage"])
    except ValueError as error:
        raise InternalError(f"the page about {code}: {error}") from error
    text, sections = _sections(code, head["text"])
    return Page(
        code=code,
        severity=severity,
        stage=stage,
        summary=_first_sentence(text),
        markdown=markdown,
        example=_blocks(sections["Example"]),
        fixed=_blocks(sections["Fix"]),
        see_also=tuple(_REFERENCE.findall(sections.get("See also", ""))),
    )


def _sections(code: str, text: str) -> tuple[str, dict[str, str]]:
    """Return the text before the first heading, and the text below each heading."""
    parts = re.split(r"^## (.*)\n", text, flags=re.MULTILINE)
    names = tuple(parts[1::2])
    if names not in (_SECTIONS, _SECTIONS[:-1]):
        raise InternalError(f"the page about {code} has other sections than {', '.join(_SECTIONS)}")
    return parts[0], dict(zip(names, parts[2::2], strict=True))


def _first_sentence(text: str) -> str:
    paragraph = " ".join(text.strip().split("\n\n")[0].split())
    return re.split(r"(?<=[.])\s", paragraph, maxsplit=1)[0].removesuffix(".")


def _blocks(section: str) -> tuple[Block, ...]:
    found = []
    for match in _FENCE.finditer(section):
        kind, _, library = match[1].partition(" library=")
        found.append(Block(kind, library or None, match[2]))
    return tuple(found)


def document() -> str:
    """All pages as one Markdown document, with an index that leads to each."""
    found = pages()
    rows = [
        f"| [{item.code}](#{item.code}) | {item.severity} | {item.stage} | {_cell(item.summary)} |" for item in found
    ]
    index = "\n".join(["| code | severity | stage | what is wrong |", "|---|---|---|---|", *rows])
    return "\n".join([_OPENING, index, "", *(_chapter(item.markdown) for item in found)])


_OPENING = """\
# Diagnostic codes

Every finding of RoboSC has a code, which stays the same from version to version: `robosc check` prints it in brackets
behind the message, and `robosc explain CODE` prints its chapter of this document. An *error* makes a model unusable. A
*warning* is very likely a mistake; `robosc check --strict` fails for one. A *note* is worth knowing.

The *stage* says who finds it: reading the *text*, checking the *model*, the *synthesis* of the supervisor, its
*explanation* by `robosc explain-synthesis`, or what is made for one *target* or deployment. In the examples the finding
is reported at the line that ends in `// <- here`.
"""


def _cell(text: str) -> str:
    return text.replace("|", r"\|")


def _chapter(markdown: str) -> str:
    """A page as a chapter: headings one level lower, and other codes as links."""
    lowered = _FENCED_OR_HEADING.sub(lambda match: match[0] or "#", markdown)
    return _REFERENCE.sub(r"- [\1](#\1)", lowered)
