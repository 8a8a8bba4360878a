"""The process that synthesizes automata for a page: the request comes on standard input, the result goes out.

It answers with a pickled `SynthesizedModel`, or with the reason why there is none, which only its parent reads.
"""

import argparse
import pickle
import sys
from dataclasses import replace
from pathlib import Path

import msgspec

from robosc.cli import automata
from robosc.cli.output import CommandError
from robosc.errors import RoboscError, Severity
from robosc.explanation import EmptyExplanation, empty_text
from robosc.pipeline.loading import LoadedAutomata
from robosc.pipeline.system_runs import initial_states_in_words
from robosc.pipeline.systems import SystemSynthesis
from robosc_view.automata import distinct_initial_states, too_large
from robosc_view.watched_model import SynthesizedModel, finding_text

MAXIMUM_FINDINGS = 10
"""Errors that are reported; of more the rest is counted."""


def playable_automata(model: LoadedAutomata, found: SystemSynthesis) -> SynthesizedModel | str:
    """Return the automata that a page plays with, or the reason why there are none, in lines.

    Raises:
        UnsupportedModelError: There are too many initial states.
    """
    if found.supervisor is None:
        return _reason(found)
    whole = None if model.libraries else model.main.text
    findings = tuple(finding_text(item.severity, item.message, item.code) for item in found.diagnostics)
    language = Path(model.main.name).suffix.removeprefix(".")
    system = found.supervisor.system
    why_not = too_large(system)
    if why_not:
        return why_not
    # A copy, since the values that a supervisor keeps for itself cannot be pickled.
    begin = distinct_initial_states(system, initial_states_in_words(replace(found.supervisor)))
    return SynthesizedModel(found.supervisor, findings, whole, language, begin)


def _reason(found: SystemSynthesis) -> str:
    wrong = [str(item) for item in found.diagnostics if item.severity is Severity.ERROR]
    more = len(wrong) - MAXIMUM_FINDINGS
    lines = [*wrong[:MAXIMUM_FINDINGS], *([f"and {more} errors more"] if more > 0 else [])]
    if found.reason:
        lines.append(found.reason)
    if isinstance(found.explanation, EmptyExplanation):
        lines += empty_text(found.explanation).splitlines()
    return "\n".join(lines)


def main() -> None:
    """Answer the request."""
    wanted = msgspec.json.decode(sys.stdin.buffer.read())
    text = wanted.pop("text")
    arguments = argparse.Namespace(
        **{**wanted, "model": Path(wanted["model"]), "library_path": (), "interface_path": (), "deployment": None}
    )
    try:
        made = playable_automata(*automata.synthesized(arguments, text=text))
    except (CommandError, RoboscError) as error:
        made = str(error)
    sys.stdout.buffer.write(pickle.dumps(made))


if __name__ == "__main__":
    main()
