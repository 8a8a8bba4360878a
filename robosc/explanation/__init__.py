"""Explanation of synthesis: the reasons for an empty supervisor, or the restrictions of events by a supervisor.

The names are imported on use: a program that only reads explanations does not load the synthesizer.
"""

from typing import TYPE_CHECKING

from robosc.named_on_use import named_on_use

if TYPE_CHECKING:
    from robosc.explanation.blame import explain_empty
    from robosc.explanation.explain import explain_synthesis
    from robosc.explanation.explanations import (
        EmptyExplanation,
        Explanation,
        document,
        empty_text,
        explanation_text,
        from_text,
        to_text,
        whole_from_text,
    )
    from robosc.explanation.requests import RequestError
    from robosc.explanation.subjects import ModelWords, SystemWords
    from robosc.explanation.troubles import Trouble, troubles_after

_HOMES = {
    "EmptyExplanation": "explanations",
    "Explanation": "explanations",
    "ModelWords": "subjects",
    "RequestError": "requests",
    "SystemWords": "subjects",
    "Trouble": "troubles",
    "document": "explanations",
    "empty_text": "explanations",
    "explain_empty": "blame",
    "explain_synthesis": "explain",
    "explanation_text": "explanations",
    "from_text": "explanations",
    "to_text": "explanations",
    "troubles_after": "troubles",
    "whole_from_text": "explanations",
}

__all__ = [
    "EmptyExplanation",
    "Explanation",
    "ModelWords",
    "RequestError",
    "SystemWords",
    "Trouble",
    "document",
    "empty_text",
    "explain_empty",
    "explain_synthesis",
    "explanation_text",
    "from_text",
    "to_text",
    "troubles_after",
    "whole_from_text",
]


if not TYPE_CHECKING:
    # A type checker knows the names from above, and is to find every other one wrong.
    __getattr__ = named_on_use(__name__, _HOMES)
