"""No request goes out that a requirement forbids while the robot really moves, whatever a cancel brings about.

The same with a real action server over DDS: acceptance/end_to_end/test_ros2_braking_servers.py.
"""

import pytest

from robosc.certification import make_supervisor
from robosc.execution.interpreter import InterpretedSystem
from robosc.language import load_bundle
from robosc.supervisor import Supervisor
from support.execution import Bench, Sent
from support.generated import load_system
from support.loaders import BRAKING_S, EXPECTED, MODEL, SERVERS, WATCHDOG_S, Moment, check, of_node, side_by_side

PERIOD_S = 0.05


@pytest.fixture(scope="module")
def supervisor() -> Supervisor:
    made = make_supervisor(load_bundle(MODEL))
    assert made.supervisor is not None, made.reason
    return made.supervisor


class Robot:
    """The loader's drive and arm on the clock of a bench."""

    def __init__(self, bench: Bench, server: str) -> None:
        self._bench = bench
        self._server = server
        self._due: list[tuple[float, str]] = []
        self.moments: list[Moment] = []
        bench.middleware.on_sent = self._sent

    def _log(self, what: str) -> None:
        self.moments.append(Moment(self._bench.clock.wall(), what, True))

    def _after(self, seconds: float, what: str) -> None:
        self._due.append((self._bench.clock.monotonic() + seconds, what))

    def _sent(self, sent: Sent) -> None:
        match sent[0]:
            case "goal":
                self._after(0.1, "accept")
            case "call":
                self._log("arm moves")
                self._after(0.3, "reached")
            case "cancel":
                self._log("cancel received")
                for seconds, what in {
                    "brakes": [(BRAKING_S, "stand"), (BRAKING_S, "cancelled")],
                    "succeeds": [(1.0, "stand"), (1.0, "succeeded")],
                    "refuses": [(0.1, "refused"), (3.0, "stand"), (3.0, "succeeded")],
                    "never": [],
                    "dies": [(WATCHDOG_S, "stand"), (2.0, "lost")],
                }[self._server]:
                    self._after(seconds, what)

    def live(self) -> None:
        """Do what is due now."""
        now_s = self._bench.clock.monotonic()
        due = [what for when_s, what in self._due if when_s <= now_s]
        self._due = [item for item in self._due if item[0] > now_s]
        executor = self._bench.executor
        for what in due:
            match what:
                case "accept":
                    self._log("wheels turn")
                    executor.on_goal_accepted(1)
                case "stand":
                    self._log("wheels stand")
                case "refused":
                    executor.on_cancel_refused(1, False)
                case "reached":
                    executor.on_reply(self._bench.middleware.sent[-1][2], None)
                case _:
                    executor.on_goal_ended(1, what)


@pytest.mark.parametrize("generates", [False, True], ids=["interpreter", "python"])
@pytest.mark.parametrize("server", SERVERS)
def test_the_arm_moves_only_while_the_wheels_stand(server: str, generates: bool, supervisor: Supervisor) -> None:
    system = load_system(supervisor) if generates else InterpretedSystem(supervisor)
    bench = Bench(system, period_s=PERIOD_S, cancel_timeout_s=2.5)
    robot = Robot(bench, server)
    begin_s = bench.clock.wall()
    for period in range(160):
        if period == 20:
            bench.receive("/stop", True)
        robot.live()
        bench.tick()
    moments = [*of_node(bench.log.entries), *robot.moments]
    print(f"{server}:\n{side_by_side(moments, begin_s)}")
    check(moments, server, EXPECTED[server])
