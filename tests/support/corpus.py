"""The corpus: models of the published language (language part A), each with what was once found to be its meaning.

`tests/corpus` holds models and libraries `*.rscd`, beside each a recording `*.json`. A recording has, one fact a
line, the findings (not their wording), the systems with and without supervisor, and one run of the executor. Nothing
here judges: `outcome` works out what a model means now, `differences` compares. A folder `<name>.libraries` beside a
model is given to its run as a library path.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from itertools import zip_longest
from pathlib import Path
from typing import Any

from robosc.automata import Semantics, System, to_automata
from robosc.certification import make_supervisor
from robosc.errors import Diagnostic, LanguageError
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.event_log import Entry, MemoryLog, plain
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.protocol import MissingData
from robosc.execution.runtime.settings import Settings
from robosc.exploration import explore, graph_json
from robosc.language import load_bundle
from robosc.model.check import check
from robosc.model.structure import CommunicationKind, Deployment, Model
from robosc.source import Bundle
from robosc.supervisor import Supervisor
from robosc.supervisor.predicates import state_predicates
from support.execution import RecordingMiddleware

CORPUS = Path(__file__).parents[1] / "corpus"

SMALL = 100
"""States below which a recording holds the whole graph, not only its digest."""

Stimulus = list[Any]
"""Input to an executor: its kind, and more by kind (see `Run.apply`)."""

Recording = dict[str, Any]


def cases() -> tuple[str, ...]:
    """The name of every model and library of the corpus, such as `robots/docking`."""
    return tuple(sorted(str(path.relative_to(CORPUS).with_suffix("")) for path in CORPUS.rglob("*.rscd")))


def recording_path(case: str) -> Path:
    """Return the path of a case's recording."""
    return CORPUS / f"{case}.json"


def recorded(case: str) -> Recording:
    """Return the recording of a case."""
    found: Recording = json.loads(recording_path(case).read_text(encoding="utf-8"))
    return found


def written(recording: Recording) -> str:
    """A recording as the text of its file: every list of facts has a line for each."""
    return f"{_written(recording, 0)}\n"


def _written(value: Any, depth: int) -> str:
    compact = json.dumps(value, ensure_ascii=False, allow_nan=False)
    if not isinstance(value, dict | list) or not value or (depth > 0 and len(compact) <= 100) or depth > 3:
        return compact
    margin, end = " " * (depth + 1), f"\n{' ' * depth}"
    if isinstance(value, dict):
        lines = [f"{margin}{json.dumps(key)}: {_written(item, depth + 1)}" for key, item in value.items()]
        return "{\n" + ",\n".join(lines) + end + "}"
    # The elements of a list are facts: one line each.
    return "[\n" + ",\n".join(f"{margin}{_written(item, 4)}" for item in value) + end + "]"


def outcome(case: str, stimuli: Sequence[Stimulus]) -> Recording:
    """Return the meaning of a case now, in the form of its recording; the executor meets the given stimuli."""
    found: Recording = json.loads(json.dumps(_outcome(case, stimuli)))
    return found


def _outcome(case: str, stimuli: Sequence[Stimulus]) -> Recording:
    try:
        bundle = bundle_of_case(case)
    except LanguageError as error:
        return {"findings": _findings(error.diagnostics)}
    checked = check(bundle)
    recording: Recording = {"findings": _findings(checked.diagnostics)}
    if checked.model is None:
        return recording
    controller = make_supervisor(bundle, allow_livelock=True).supervisor
    recording["controller"] = _system(checked.model, controller, Deployment.CONTROLLER, is_whole=True)
    if _has_a_layer(checked.model):
        layer = make_supervisor(bundle, deployment=Deployment.LAYER, allow_livelock=True).supervisor
        recording["layer"] = _system(checked.model, layer, Deployment.LAYER, is_whole=False)
    if controller is not None:
        run = Run(controller)
        recording["run"] = [run.apply(stimulus) for stimulus in stimuli]
    return recording


def stimuli_of(recording: Recording) -> tuple[Stimulus, ...]:
    """The stimuli of a recorded run."""
    return tuple(step["do"] for step in recording.get("run", ()))


def bundle_of_case(case: str) -> Bundle:
    """The files of a case.

    Raises:
        LanguageError: A file is no text.
    """
    extra = CORPUS / f"{case}.libraries"
    return load_bundle(CORPUS / f"{case}.rscd", [extra] if extra.is_dir() else [])


def _findings(diagnostics: Iterable[Diagnostic]) -> list[str]:
    # The packages of this machine are no meaning of a model.
    return sorted(_finding(item) for item in diagnostics if item.code != "definition-not-found")


def _finding(item: Diagnostic) -> str:
    """A finding without its wording."""
    place = "nowhere" if item.location is None else f"{item.location}, length {item.location.length}"
    return f"{item.severity} {item.code} at {place}"


# Systems


def _has_a_layer(model: Model) -> bool:
    """Return True if a supervision layer can tell the model's incoming messages apart by their identifiers."""
    identifiers = [item.identifier for item in model.communications if item.kind is CommunicationKind.INCOMING_MESSAGE]
    return len(set(identifiers)) == len(identifiers)


def _system(model: Model, supervisor: Supervisor | None, deployment: Deployment, *, is_whole: bool) -> Recording:
    """The system without and with its supervisor; the graph in full if `is_whole` and it is small."""
    system = to_automata(model, deployment)
    states, transitions = _uncontrolled(system)
    found: Recording = {
        "supervisor": "exists" if supervisor else "none",
        "uncontrolled": {"states": states, "transitions": transitions},
    }
    if supervisor is None:
        return found
    graph = graph_json(explore(system, state_predicates(system, supervisor.added), supervisor.model))
    listed: Any = graph["states"]
    steps: Any = graph["transitions"]
    found["supervised"] = {"states": len(listed), "transitions": len(steps)}
    found["sha256"] = hashlib.sha256(json.dumps(graph, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
    found["initial"] = listed[graph["initial"]]
    if is_whole and len(listed) < SMALL:
        found["states"] = listed
        targets: dict[str, list[int]] = {}
        for source, event, target in steps:
            targets.setdefault(f"{source} {event}", []).append(target)
        found["transitions"] = [f"{step} -> {', '.join(map(str, ends))}" for step, ends in targets.items()]
    return found


def _uncontrolled(system: System) -> tuple[int, int]:
    """Reachable states and transitions of the plants alone."""
    semantics = Semantics(system)
    found, frontier, transitions = {semantics.initial}, [semantics.initial], 0
    while frontier:
        state = frontier.pop()
        for event in system.events:
            targets = semantics.targets(state, event.name)
            transitions += len(targets)
            frontier.extend(targets - found)
            found |= targets
    return len(found), transitions


# Runs


class Run:
    """One executor that obeys a script and reports what came of it.

    Attributes:
        open: Calls and goals that were sent and have not ended: communication to id.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self._system = InterpretedSystem(supervisor)
        self._middleware = RecordingMiddleware()
        self._log = MemoryLog()
        self._clock = ManualClock(epoch_s=1_000_000.0)
        self._executor = Executor(self._system, self._middleware, Settings(), self._clock, self._log)
        self._state: dict[str, Any] = {}
        self.open: dict[str, int] = {}

    def apply(self, stimulus: Stimulus) -> Recording:
        """Let something happen.

        Args:
            stimulus: `start`; `tick`, after seconds that pass; `receive`, identifier, data; `reply`, service, data;
                `fail`, service; `accept`, action; `feedback`, action, data; `end`, action, outcome, data.

        Returns:
            The stimulus, what was logged and sent, and the parts of the state that it changed.
        """
        logged, sent = len(self._log.entries), len(self._middleware.sent)
        with suppress(MissingData):
            self._do(*stimulus)
        for kind, name, *rest in self._middleware.sent[sent:]:
            if kind in ("call", "goal"):
                self.open[name] = rest[0]
        state = self._flat_state()
        changed = {place: value for place, value in state.items() if self._state.get(place) != value}
        self._state = state
        return {
            "do": stimulus,
            "log": [_entry(entry) for entry in self._log.entries[logged:]],
            "sent": [plain(list(item)) for item in self._middleware.sent[sent:]],
            "changed": changed,
        }

    def _do(self, kind: str, *arguments: Any) -> None:
        executor, given = self._executor, [_unpacked(item) for item in arguments]
        match kind:
            case "start":
                executor.start()
            case "tick":
                self._clock.advance(given[0])
                executor.tick()
            case "receive":
                executor.receive(*given)
            case "reply":
                executor.on_reply(self._ended(given[0]), given[1])
            case "fail":
                executor.on_call_failed(self._ended(given[0]), "")
            case "accept":
                executor.on_goal_accepted(self.open.get(given[0], 0))
            case "feedback":
                executor.on_feedback(self.open.get(given[0], 0), given[1])
            case "end":
                executor.on_goal_ended(self._ended(given[0]), given[1], given[2])
            case _:
                raise ValueError(f"there is no stimulus '{kind}'")

    def _ended(self, communication: str) -> int:
        """The id of what ends now; one that nothing has if nothing is open."""
        return self.open.pop(communication, 0)

    def _flat_state(self) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for component, inner in self._system.state().items():
            found[component] = inner["state"]
            found |= {f"{component}.{name}": plain(value) for name, value in inner["variables"].items()}
        return found


_WORDY = ("what", "unknown", "time", "state", "decision_us", "kind", "controllable")
"""Keys of an entry that are words, depend on nothing that a model means, or are recorded otherwise."""


def _entry(entry: Entry) -> str:
    """An entry of the log without its wording."""
    kept = {key: plain(value) for key, value in entry.items() if key not in _WORDY and value is not None}
    name = kept.pop("event", kept.pop("identifier", ""))
    kind = entry["kind"]
    if kind == "event":
        kind = "controllable" if entry["controllable"] else "uncontrollable"
    data = kept.pop("data", None)
    # Data of a request stand among the things sent; the reason of a failure is wording.
    shown = json.dumps(data, sort_keys=True) if isinstance(data, dict) and kind == "uncontrollable" else ""
    return " ".join(filter(None, (kind, name, shown)))


def _unpacked(value: Any) -> Any:
    """A recorded datum; JSON has no NaN and no infinities, so they are written as objects."""
    match value:
        case {"float": str(text)} if len(value) == 1:
            return float(text)
        case dict():
            return {key: _unpacked(item) for key, item in value.items()}
        case list():
            return [_unpacked(item) for item in value]
        case _:
            return value


# Comparison


_ABSENT = object()

_LONGEST = 160
"""Characters of a value in a line about a difference."""


def differences(was: Any, now: Any, where: str = "") -> list[str]:
    """Return the differences of two recordings, one readable line each, in the order of the file."""
    if _shown(was) == _shown(now):
        return []
    if isinstance(was, Mapping) and isinstance(now, Mapping):
        return [
            line
            for key in dict.fromkeys([*was, *now])
            for line in differences(was.get(key, _ABSENT), now.get(key, _ABSENT), f"{where} {key}".strip())
        ]
    if isinstance(was, list) and isinstance(now, list):
        if all(isinstance(item, str) for item in [*was, *now]):
            gone = [f"{where}: no longer {item}" for item in was if item not in now]
            new = [f"{where}: only now {item}" for item in now if item not in was]
            return gone + new or [f"{where}: another order or number: was {_cut(was)}, is {_cut(now)}"]
        return [
            line
            for number, (old, new_) in enumerate(zip_longest(was, now, fillvalue=_ABSENT))
            for line in differences(old, new_, f"{where} [{number}]")
        ]
    return [f"{where}: was {_cut(was)}, is {_cut(now)}"]


def _shown(value: Any) -> str:
    return "nothing" if value is _ABSENT else json.dumps(value, sort_keys=True, ensure_ascii=False)


def _cut(value: Any) -> str:
    text = _shown(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
