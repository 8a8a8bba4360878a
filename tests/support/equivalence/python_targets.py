"""Executors in Python: the reference on the interpreted system, and a generated module on its own."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

from robosc.automata.executable import ExecutableSystem
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime import clock, event_log, executor, layer, protocol, settings
from robosc.model.structure import Communication, CommunicationKind, Deployment, Model
from robosc.supervisor import Supervisor
from support.equivalence.observation import FULL, NO_LOG, Observation, entry
from support.equivalence.portable import Driver
from support.equivalence.scenario import PERIOD_S, Action, Scenario


class PythonTarget:
    """System and executor in this process.

    Args:
        name: Name for messages.
        model: Model that it was made from.
        system: The controlled system.
        runtime: Object that holds `Executor` or `Layer`, `Settings`, `ManualClock`, `MemoryLog` and `NullLog`, as a
            generated module does.
        is_layer: True for a layer.
        has_log: True if it writes a log: without one it takes shorter ways.
    """

    def __init__(
        self, name: str, model: Model, system: Any, runtime: Any, *, is_layer: bool, has_log: bool = True
    ) -> None:
        self.name = name
        self.sight = FULL if has_log else NO_LOG
        self._driver = Driver(system, runtime, is_layer=is_layer, has_log=has_log)
        self.ids, self.callers = self._driver.ids, self._driver.callers
        self._shown = shown(model)

    @property
    def is_faulty(self) -> bool:
        """True if it rests until it is restarted."""
        return bool(self._driver.executor.is_faulty)

    @property
    def executor(self) -> Any:
        """The executor, once it has begun."""
        return self._driver.executor

    def start(self, scenario: Scenario, awaited: Observation | None = None) -> Observation:
        """Begin."""
        self._driver.start(scenario.all_settings()._asdict())
        return observation(self._driver.seen(*self._shown))

    def do(self, action: Action, awaited: Observation | None = None) -> Observation:
        """Let one thing happen."""
        self._driver.do(*arguments_of(action))
        return observation(self._driver.seen(*self._shown))

    def close(self) -> Observation:
        """Do nothing."""
        return Observation()


def shown(model: Model) -> tuple[Sequence[str], Sequence[str]]:
    """Return the events that a controller may issue, and the names of its services and actions."""
    servers = [item.name for item in model.communications if _is_server(item)]
    return ExecutableSystem(model, Deployment.CONTROLLER).issued, servers


def arguments_of(action: Action) -> tuple[str, str, Any, str, float]:
    """Return what a driver takes to let an action happen: a period passes before a decision."""
    seconds = PERIOD_S if action.do == "tick" else action.seconds
    return action.do, action.subject, action.data, action.how, seconds


def observation(seen: Mapping[str, Any]) -> Observation:
    """Return what a driver has seen as an observation."""
    return Observation(
        issued=tuple((kind, name, data) for kind, name, data in seen["issued"]),
        log=tuple(entry(item) for item in seen["log"]),
        state=seen["state"],
        enabled=frozenset(seen["enabled"]),
        locations=seen["locations"],
        status=tuple(seen["status"]),
        counters=tuple(seen["counters"]),
        cancelling=(tuple(seen["cancelling"][0]), tuple(seen["cancelling"][1])),
        progress=seen["progress"],
    )


def _is_server(item: Communication) -> bool:
    return item.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION)


def reference(supervisor: Supervisor, system: Any = None, *, has_log: bool = True) -> PythonTarget:
    """The yardstick: the executor of RoboSC on the interpreted system, or its layer if the supervisor is for one.

    Args:
        supervisor: The supervisor.
        system: The controlled system, if it is not simply the interpreted one.
        has_log: True if its executor writes a log.
    """
    runtime = SimpleNamespace(
        Executor=executor.Executor,
        Layer=layer.Layer,
        Settings=settings.Settings,
        ManualClock=clock.ManualClock,
        MemoryLog=event_log.MemoryLog,
        NullLog=event_log.NullLog,
        MissingData=protocol.MissingData,
    )
    chosen = InterpretedSystem(supervisor) if system is None else system
    return PythonTarget("reference", supervisor.model, chosen, runtime, is_layer=_is_layer(supervisor), has_log=has_log)


def _is_layer(supervisor: Supervisor) -> bool:
    return supervisor.deployment is Deployment.LAYER


def observe(supervisor: Supervisor, scenario: Scenario) -> list[Observation]:
    """Return the observations of the reference: at the start, and after each action."""
    target = reference(supervisor)
    return [target.start(scenario), *(target.do(action) for action in scenario.actions)]


def generated_python(supervisor: Supervisor, module: Any, system: Any = None, *, has_log: bool = True) -> PythonTarget:
    """Return a generated module as a target.

    Args:
        supervisor: Supervisor that it was generated from.
        module: The module.
        system: The controlled system, if it is not simply the module's.
        has_log: True if its executor writes a log.
    """
    chosen = module.Supervisor() if system is None else system
    is_layer = _is_layer(supervisor)
    return PythonTarget("python", supervisor.model, chosen, module, is_layer=is_layer, has_log=has_log)
