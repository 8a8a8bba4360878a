"""Executors in Python: the reference on the interpreted system, and a generated module on its own."""

from types import SimpleNamespace
from typing import Any

from robosc.automata.executable import ExecutableSystem
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime import clock, event_log, executor, layer, settings
from robosc.model.structure import Communication, CommunicationKind, Deployment, Model
from robosc.supervisor import Supervisor
from support.equivalence.observation import FULL, NO_LOG, Entry, Issued, Observation, entry, flat
from support.equivalence.scenario import PERIOD_S, Action, Scenario


class Ids:
    """Calls and goals under way, by the ids that an executor gave them."""

    def __init__(self) -> None:
        self._open: dict[str, list[int]] = {}

    def add(self, name: str, number: int) -> None:
        """It was called."""
        self._open.setdefault(name, []).append(number)

    def last(self, name: str) -> int:
        """The last one under way."""
        return self._open[name][-1]

    def end(self, name: str) -> int:
        """The last one, which is over."""
        return self._open[name].pop()

    def count(self, name: str) -> int:
        """Return the number of calls or goals under way."""
        return len(self._open.get(name, ()))


class Callers:
    """The numbers of the calls and goals of an existing controller: 1, 2 and so on."""

    def __init__(self) -> None:
        self._count = 0
        self._last: dict[str, int] = {}

    def next(self, name: str) -> int:
        """Return the number of one more call or goal."""
        self._count += 1
        self._last[name] = self._count
        return self._count

    def last(self, name: str) -> int:
        """Return the number of the last call or goal there."""
        return self._last[name]

    def count(self, name: str) -> int:
        """Return the number of calls and goals up to the last one there; 0: none."""
        return self._last.get(name, 0)


class _World:
    """A middleware that remembers what it is asked for."""

    def __init__(self, ids: Ids) -> None:
        self._ids = ids
        self.issued: list[Issued] = []

    def prepare(self, communication: str, data: Any) -> Any:
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        return not any(flat(message).values())

    def publish(self, communication: str, message: Any) -> None:
        self.issued.append(("publish", communication, flat(message)))

    def publish_default(self, identifier: str) -> None:
        self.issued.append(("default", identifier, {}))

    def call(self, communication: str, request_id: int, message: Any) -> None:
        self.issued.append(("call", communication, flat(message)))
        self._ids.add(communication, request_id)

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        self.issued.append(("goal", communication, flat(message)))
        self._ids.add(communication, goal_id)

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        self.issued.append(("cancel", communication, {}))


class PythonTarget:
    """System and executor in this process.

    Args:
        name: Name for messages.
        model: Model that it was made from.
        system: The controlled system.
        runtime: Object that holds `Executor`, `Settings`, `ManualClock`, `MemoryLog` and `NullLog`, as a generated
            module does.
        has_log: True if it writes a log: without one it takes shorter ways.
    """

    def __init__(self, name: str, model: Model, system: Any, runtime: Any, *, has_log: bool = True) -> None:
        self.name = name
        self.sight = FULL if has_log else NO_LOG
        self.ids = Ids()
        self._model = model
        self._system = system
        self._runtime = runtime
        self._events = ExecutableSystem(model, Deployment.CONTROLLER).issued
        self._servers = [item.name for item in model.communications if _is_server(item)]
        self._clock = runtime.ManualClock()
        self._log = runtime.MemoryLog() if has_log else runtime.NullLog()
        self._world = self._make_world()
        self._executor: Any = None

    @property
    def executor(self) -> Any:
        """The executor, once it has begun."""
        return self._executor

    def start(self, scenario: Scenario, awaited: Observation | None = None) -> Observation:
        """Begin."""
        settings = self._runtime.Settings(**scenario.all_settings()._asdict())
        self._executor = self._make_executor(settings)
        self._executor.start()
        return self._observation()

    def _make_world(self) -> _World:
        return _World(self.ids)

    def _make_executor(self, settings: Any) -> Any:
        return self._runtime.Executor(self._system, self._world, settings, self._clock, self._log)

    def do(self, action: Action, awaited: Observation | None = None) -> Observation:
        """Let one thing happen."""
        executor, ids, name = self._executor, self.ids, action.subject
        match action.do:
            case "tick":
                self._clock.advance(PERIOD_S)
                executor.tick()
            case "wait":
                self._clock.advance(action.seconds)
                executor.watch()
            case "message":
                executor.receive(name, action.data)
            case "reply":
                executor.on_reply(ids.end(name), action.data)
            case "fail":
                executor.on_call_failed(ids.end(name), "lost")
            case "accept":
                executor.on_goal_accepted(ids.last(name))
            case "feedback":
                executor.on_feedback(ids.last(name), action.data)
            case "end":
                executor.on_goal_ended(ids.end(name), action.how, action.data)
            case "stop":
                executor.stop("test")
            case "restart":
                executor.restart()
            case _:
                raise ValueError(action.do)
        return self._observation()

    def _observation(self) -> Observation:
        issued, self._world.issued = tuple(self._world.issued), []
        log: tuple[Entry, ...] = ()
        if self.sight.has_log:
            log = tuple(entry(item) for item in self._log.entries)
            self._log.entries.clear()
        counters = self._executor.counters
        return Observation(
            issued=issued,
            log=log,
            state=self._system.state(),
            enabled=frozenset(event for event in self._events if self._system.enabled(event)),
            locations={name: self._system.location(name) for name in self._servers},
            status=(self._executor.status.value, self._executor.is_faulty),
            counters=(counters.unknown, counters.unexpected, counters.faults),
        )

    def close(self) -> Observation:
        """Nothing to end."""
        return Observation()


class _BothSides(_World):
    """Remembers what both sides of a layer are told."""

    def pass_on(self, identifier: str, message: Any) -> None:
        self.issued.append(("pass", identifier, flat(message)))

    def blocked(self, identifier: str) -> None:
        self.issued.append(("blocked", identifier, {}))

    def answer(self, communication: str, call_id: Any, data: Any) -> None:
        self.issued.append(("answer", communication, {"caller": call_id, **flat(data)}))

    def answer_default(self, communication: str, call_id: Any) -> None:
        self.issued.append(("no answer", communication, {"caller": call_id}))

    def accept_goal(self, communication: str, goal_id: Any) -> None:
        self.issued.append(("accept", communication, {"caller": goal_id}))

    def reject_goal(self, communication: str, goal_id: Any) -> None:
        self.issued.append(("reject", communication, {"caller": goal_id}))

    def pass_feedback(self, communication: str, goal_id: Any, data: Any) -> None:
        self.issued.append(("told", communication, {"caller": goal_id, **flat(data)}))

    def end_goal(self, communication: str, goal_id: Any, outcome: str, data: Any) -> None:
        self.issued.append(("ended", communication, {"caller": goal_id, "how": outcome, **flat(data)}))


class PythonLayer(PythonTarget):
    """A system and a supervision layer in this process; `runtime` holds `Layer` in place of `Executor`."""

    def __init__(self, name: str, model: Model, system: Any, runtime: Any, *, has_log: bool = True) -> None:
        super().__init__(name, model, system, runtime, has_log=has_log)
        self.callers = Callers()

    @property
    def is_faulty(self) -> bool:
        """True if the layer rests until it is restarted."""
        return bool(self._executor.is_faulty)

    def do(self, action: Action, awaited: Observation | None = None) -> Observation:
        """Let one thing happen."""
        executor, name = self._executor, action.subject
        match action.do:
            case "ask":
                executor.on_request(name, action.data)
            case "ask_call":
                executor.on_call(name, self.callers.next(name), action.data)
            case "ask_goal":
                executor.on_goal(name, self.callers.next(name), action.data)
            case "ask_cancel":
                executor.on_cancel(name, self.callers.last(name))
            case _:
                return super().do(action, awaited)
        return self._observation()

    def _make_world(self) -> _World:
        return _BothSides(self.ids)

    def _make_executor(self, settings: Any) -> Any:
        return self._runtime.Layer(self._system, self._world, self._world, settings, self._clock, self._log)


def _is_server(item: Communication) -> bool:
    return item.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION)


def reference(supervisor: Supervisor, *, has_log: bool = True) -> PythonTarget:
    """The yardstick: the executor of RoboSC on the interpreted system, or its layer if the supervisor is for one."""
    runtime = SimpleNamespace(
        Executor=executor.Executor,
        Layer=layer.Layer,
        Settings=settings.Settings,
        ManualClock=clock.ManualClock,
        MemoryLog=event_log.MemoryLog,
        NullLog=event_log.NullLog,
    )
    kind = _kind(supervisor)
    return kind("reference", supervisor.model, InterpretedSystem(supervisor), runtime, has_log=has_log)


def _kind(supervisor: Supervisor) -> type[PythonTarget]:
    return PythonLayer if supervisor.deployment is Deployment.LAYER else PythonTarget


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
    return _kind(supervisor)("python", supervisor.model, system or module.Supervisor(), module, has_log=has_log)
