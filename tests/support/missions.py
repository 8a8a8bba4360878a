"""Robot with missions for tests, and supervisors with the strategies of such robots."""

import msgspec

from robosc.automata import ExecutableSystem, to_automata
from robosc.model.structure import Deployment, Model
from robosc.strategies import StrategyResult, synthesize_strategy
from robosc.supervisor import Supervisor
from robosc.synthesis import SynthesisStatus, synthesize
from support.execution import supervisor_of

_COURIER = """robot Courier {
    component Base {
        incoming message to_kitchen with identifier: "/to_kitchen", type: none
        incoming message to_office with identifier: "/to_office", type: none
        incoming message charge with identifier: "/charge", type: none
        behaviour {
            initial marked state dock { on request to to_kitchen goto kitchen on request to to_office goto office }
            marked state kitchen { on request to to_office goto office on request to charge goto dock }
            marked state office { on request to to_kitchen goto kitchen on request to charge goto dock }
        }
    }
    component Caller {
        outgoing message call with identifier: "/call", type: none
        behaviour {
            initial marked state quiet { on response from call goto waiting on request to to_office }
            marked state waiting { on request to to_office goto quiet }
        }
    }
    component Operator {
        outgoing message begin with identifier: "/begin", type: none
        outgoing message rest with identifier: "/rest", type: none
        behaviour {
            initial marked state resting { on response from begin goto working }
            marked state working { on response from rest goto resting }
        }
    }
    §
}"""


def courier(*statements: str) -> str:
    """Return the text of a courier that goes to three places, with statements behind its components."""
    return _COURIER.replace("§", "\n    ".join(statements))


def strategy_result(model: Model) -> StrategyResult:
    """Return the result of synthesizing a strategy for a model that has a supervisor."""
    result = synthesize(to_automata(model, Deployment.CONTROLLER))
    assert result.status is not SynthesisStatus.EMPTY
    return synthesize_strategy(ExecutableSystem(model, Deployment.CONTROLLER), result.added)


def strategic(model: Model) -> Supervisor:
    """Return the supervisor of a model whose goals and missions can be reached."""
    added = synthesize(to_automata(model, Deployment.CONTROLLER)).added
    strategy = strategy_result(model).strategy
    assert strategy is not None
    supervisor = supervisor_of(model, added=added)
    certificate = msgspec.structs.replace(supervisor.certificate, goals="not checked")
    return msgspec.structs.replace(supervisor, strategy=strategy, certificate=certificate)
