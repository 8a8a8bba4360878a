"""The table of races with generated nodes, in Python and C++, on a real rosmaster: servers act while a node is stopped.

A node that the system has stopped reads nothing: all that was sent to it is there at once when it goes on, in whatever
order it takes that.
"""

import signal
import time
import xmlrpc.client
from collections.abc import Callable
from pathlib import Path

import pytest

from support.driver_ros1 import LANGUAGES, Driver, start_of
from support.goal_races import RACES, SETTINGS, Race, World, events_of_servers, run, told_by
from support.ros1 import Peer, missing
from support.waiting import wait_until

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
]

QUIET_S = 0.3
"""Time for what must not come, and for what does not show."""

PERIOD_S = 0.02
START_S = 1000.0


class NodeWorld(World):
    """A node among servers that are processes, too.

    Args:
        driver: The node's surroundings.
        race: The race that is to happen.
    """

    def __init__(self, driver: Driver, race: Race) -> None:
        self._driver = driver
        self._race = race
        self._is_held = False
        # Only a clock of the test's own can go back; the times of calls are none of it.
        self._is_simulated = race.name == "the clock jumps back"
        self._now_s = START_S
        self._again: Callable[[], object] = lambda: None
        self._servers = [driver.server(accepts="later", ends_on_cancel=False)]
        self._servers += [self._another(f"server_{number}") for number in range(1, race.servers)]
        if self._is_simulated:
            driver.master.set_parameter("/use_sim_time", True)
            driver.peer.advertise("/clock", "rosgraph_msgs/Clock")
        service_timeout_s = 60.0 if self._is_simulated else SETTINGS.service_timeout_s
        timeouts = (f"service_timeout:={service_timeout_s}", f"action_timeout:={SETTINGS.action_timeout_s}")
        driver.start(*timeouts, waits_s=60.0)
        self._until(lambda: self._links("/go/goal") == race.servers and self.status == "running", "the node to run")

    def _another(self, name: str) -> Peer:
        made = self._driver.ends.enter_context(Peer(self._driver.master, self._driver.folder / "servers", name))
        made.act("/go", "actionlib/Test", accepts="later", ends_on_cancel=False)
        return made

    def _links(self, topic: str) -> int:
        """Return the number of connections on which the node sends on a topic, as it reports itself."""
        with xmlrpc.client.ServerProxy(self._driver.master.variables["ROS_MASTER_URI"]) as master:
            uri: str = master.lookupNode("/test", "/driver_controller")[2]  # type: ignore[index,assignment]
        with xmlrpc.client.ServerProxy(uri) as node:
            links: list[list[object]] = node.getBusInfo("/test")[2]  # type: ignore[index,assignment]
        return sum(link[2] == "o" and link[4] == topic for link in links)

    def _until(self, condition: Callable[[], bool], what: str) -> None:
        def repeat() -> None:
            self._again()
            if self._is_simulated:
                self._let_pass(PERIOD_S)

        self._driver.until(condition, what, repeat=repeat)

    def _let_pass(self, seconds: float) -> None:
        self._now_s += seconds
        whole = int(self._now_s)
        clock = {"secs": whole, "nsecs": round((self._now_s - whole) * 1e9)}
        self._driver.peer.publish("/clock", "rosgraph_msgs/Clock", clock=clock)

    def _hold(self) -> None:
        """Let the node read nothing until `read`."""
        if not self._is_held:
            self._driver.node.signal(signal.SIGSTOP)
            self._is_held = True

    def _is_told_all(self) -> bool:
        return len(told_by(self)) >= len(self._race.told) and self.unexpected >= self._race.unexpected

    # The node's side.

    def press(self, button: str, is_down: bool = True) -> None:
        """Say that a button is down or up; a node that reads learns it, and decides."""
        event = f"{button}.response"
        before = len(self._driver.events(event))
        self._driver.peer.publish(f"/{button}", "std_msgs/Bool", data=is_down)
        self._driver.peer.settle()
        if self._is_held:
            return
        self._until(lambda: len(self._driver.events(event)) > before, f"{button} to be read")
        if is_down:
            request = "go.request" if button == "pressed" else "reach.request"
            self._until(lambda: bool(self._driver.events(request)), "the request")

    def pass_time(self, seconds: float) -> None:
        """Let simulated time pass, or go back; or wait until the time of a call is over."""
        if self._is_simulated:
            self._let_pass(seconds)
            time.sleep(QUIET_S)
        else:
            self._until(lambda: bool(self._driver.events("reach.error")), "the time to be over")

    @property
    def happened(self) -> list[str]:
        """The events of the action and the service up to the end; the button may be down after it: a new goal."""
        found = events_of_servers(self._driver.entries)
        requests = [number for number, event in enumerate(found) if event == "go.request"]
        return found[: requests[1]] if len(requests) > 1 else found

    @property
    def unexpected(self) -> int:
        """Number of replies and the like that nothing in the model is for."""
        return sum(entry["kind"] == "unexpected" for entry in self._driver.entries)

    @property
    def status(self) -> str:
        """Status of the executor, as the node's diagnostics have it."""
        reports = self._driver.peer.values("/diagnostics")
        values = {item["key"]: item["value"] for item in reports[-1]["status"][0]["values"]} if reports else {}
        return str(values.get("status", ""))

    # The servers' side.

    def accept(self) -> None:
        """Have every server accept the goal."""
        self._until(lambda: all(server.goals["/go"] for server in self._servers), "the goal")
        self._hold()
        self._do("accept")

    def _do(self, what: str, **arguments: object) -> None:
        for server in self._servers:
            server.do(what, name="/go", **arguments)
            server.settle()

    def feedback(self) -> None:
        """Give feedback."""
        self._hold()
        self._servers[0].do("feedback", name="/go", message={"feedback": 1})
        self._servers[0].settle()

    def end(self, how: str) -> None:
        """Every server ends the goal."""
        if how == "cancelled":
            self._until(lambda: all(server.cancels["/go"] for server in self._servers), "the cancel")
            self._again = lambda: None
        self._hold()
        self._do("end", how={"cancelled": "canceled"}.get(how, how))

    def cancel_by_another(self) -> None:
        """The peer with the buttons has it cancelled: again and again, for at first it is not connected."""
        self._hold()
        self._again = lambda: self._driver.peer.do("cancel", name="/go")

    def reply(self) -> None:
        """The service replies."""
        self._until(lambda: bool(self._servers[0].requests["/reach"]), "the call")
        self._hold()
        self._servers[0].do("answer", name="/reach", message={"success": True})
        self._servers[0].settle()

    def read(self) -> None:
        """Let the node go on, and read until it was told all, or nothing more can be seen to come."""
        self._driver.node.signal(signal.SIGCONT)
        self._is_held = False
        end_s = time.monotonic() + QUIET_S
        wait_until(lambda: self._is_told_all() or time.monotonic() > end_s, "what is read")
        self._driver.peer.settle()

    def finish(self) -> None:
        """Wait until the node was told all, and then whether more comes."""
        self._until(self._is_told_all, f"{self._race.told}, but there was only {self.happened}")
        time.sleep(QUIET_S)


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("race", RACES, ids=lambda race: race.name.replace(" ", "-"))
def test_races_on_ros_1(race: Race, language: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    if language == "cpp":
        # The log of a node in C++ has no reasons of errors.
        race = race._replace(told=tuple(event.partition(":")[0] for event in race.told))
    driver = Driver(start_of(language, tmp_path, tmp_path_factory), tmp_path)
    with driver.ends:
        world = NodeWorld(driver, race)

        def happens(world_: World) -> None:
            race.happens(world_)
            world.finish()

        run(race._replace(happens=happens), world)
