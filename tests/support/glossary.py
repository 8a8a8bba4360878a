"""Words of the glossary in the text of a page: their first occurrences, and the links there."""

import re

WORDS = {
    "request": r"requests?",
    "response": r"responses?",
    "feedback": r"feedback",
    "reset": r"resets?",
    "tau": r"taus?",
    "marked": r"marked",
    "controllable": r"controllable",
    "release": r"releases?",
    "layer": r"layers?",
    "livelock": r"livelocks?",
    "guard": r"guards?",
    "invariant": r"invariants?",
    "decision diagram": r"decision diagrams?",
    "batch": r"batch(?:es)?",
    "policy": r"polic(?:y|ies)",
    "assumption": r"assumptions?",
    "strategy": r"strateg(?:y|ies)",
    "event log": r"event logs?",
}
"""Sections of the glossary, and the forms of their words."""

_SILENT = re.compile(r"^```.*?^```$|^#[^\n]*$|`(?:[^`\n]|\n(?!\n))*`|!?\[[^\]]*\]\([^)]*\)", re.MULTILINE | re.DOTALL)


def unlinked(text: str, name: str) -> int | None:
    """Return the place in a page where a word stands before it is linked to the glossary; None: there is none.

    Headings, code and links to elsewhere do not count.
    """
    link = re.search(rf"\]\([^)]*glossary\.md#{name.replace(' ', '-')}\)", text)
    prose = _SILENT.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    found = re.search(rf"\b{WORDS[name]}\b", prose, re.IGNORECASE)
    return None if found is None or (link is not None and link.start() < found.start()) else found.start()
