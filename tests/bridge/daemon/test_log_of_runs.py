"""One event log for all runs of a bridge: it says where the model begins again, so that it can be checked."""

from pathlib import Path

from robosc.event_logs import check_log
from robosc_bridge.daemon.states import OperatorCommand, Order
from support.daemons import MODEL, Scene, supervisor_of
from support.random_logs import read


def test_a_log_of_several_runs_is_one_that_the_supervisor_accounts_for(tmp_path: Path) -> None:
    scene = Scene(starts_itself=False, stays=True)
    scene.up()
    for command in (OperatorCommand.START, OperatorCommand.STANDBY, OperatorCommand.START):
        scene.daemon.post(Order(command, "", lambda why: None))
        scene.live(1.0, 2.0)
    kinds = [entry["kind"] for entry in scene.log.entries]
    # A fresh bridge begins in the initial state anyway.
    assert kinds.count("restart") == 1
    assert kinds.index("stop") < kinds.index("restart")
    found = check_log(read(tmp_path, scene.log.entries), supervisor_of(MODEL))
    assert found.violations == ()
    assert (found.restarts, found.requests > 1) == (1, True)
