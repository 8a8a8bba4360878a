"""The bridge executes a courier with missions as the reference does: its log, and what it sends to programs."""

from collections import Counter

from robosc_bridge.daemon.programs.items import Attached, MessageReceived, MessageSent, Program, ToProgram
from support.daemons import Scene
from support.equivalence.observation import Entry, entry
from support.equivalence.python_targets import reference
from support.equivalence.scenario import Action, Scenario
from support.page_courier import PAGE_COURIER, TOPICS, messages, page_courier_supervisor

REQUESTED = ("/door/open", "/door/close", "/go/kitchen", "/go/lab", "/go/dock")
CONFIGURATION = "\n".join(
    [
        "robot: burger",
        "drive: {driver: opencr, port: /dev/base}",
        "execution: {period_s: 0.02}",
        "channels:",
        *(f"  {topic}: {{channel: grpc}}" for topic in (*TOPICS, *REQUESTED)),
    ]
)
PERIODS = 8
"""Periods after a message, enough for all that follows from it."""


def test_the_bridge_makes_rounds_and_detours_as_the_reference_does() -> None:
    supervisor = page_courier_supervisor()
    target = reference(supervisor)
    scene = Scene(text=CONFIGURATION, model=PAGE_COURIER, needs_scanner=False)
    sent: list[ToProgram] = []
    program = Program("house", sent.append)
    scene.daemon.post(Attached(program))
    scene.up()
    awaited = [target.start(Scenario(())), *(target.do(Action("tick")) for _ in range(PERIODS))]
    logged: Counter[str] = Counter()
    for number, action in enumerate((None, *messages(1, 250))):
        if action is not None:
            awaited = [target.do(action), *(target.do(Action("tick")) for _ in range(PERIODS))]
            scene.daemon.post(MessageReceived(program, action.subject, None))
            scene.live(PERIODS * 0.02)
        expected = [line for item in awaited for line in item.log]
        assert followed(scene) == expected, (number, action)
        issued = [name for item in awaited for kind, name, _ in item.issued if kind == "publish"]
        assert [item.name for item in sent if isinstance(item, MessageSent)] == issued, (number, action)
        logged.update(f"{line['kind']} {line.get('aim', '')}".strip() for line in expected)
        scene.log.entries.clear()
        sent.clear()
    for aim in ("visit 1 of mission rounds", "visit 3 of mission rounds", "visit 1 of detour 1 of mission rounds"):
        assert logged[f"reached {aim}"] > 3 and logged[f"approach {aim}"] > 3, logged
    assert logged["reached goal 1"] > 3, logged


def followed(scene: Scene) -> list[Entry]:
    """Return what the bridge's log has of its executor."""
    kinds = ("event", "reached", "approach", "owed", "met")
    return [entry(line) for line in scene.log.entries if line["kind"] in kinds]
