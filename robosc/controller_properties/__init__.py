"""Controller properties that synthesis does not guarantee.

They are finite response, confluence, nonblocking under control, and that cancels are possible.

Source: Reijnen, Erens, van de Mortel-Fronczak and Rooda, "Supervisory controller synthesis and implementation for
safety PLCs", Discrete Event Dynamic Systems 32, 2022, pp. 115-141. The definitions are applied to the automaton of our
executor (`robosc.controller_properties.controller`), with one difference: a marked state also counts as reached if
silent steps only pass through it, because the robot has then completed its task, if only for a moment.
"""

from robosc.controller_properties.check import DEFAULT_LIMIT, check_controller
from robosc.controller_properties.controller import Controller
from robosc.controller_properties.findings import controller_findings
from robosc.controller_properties.goals import MissedGoal, StrategyCheck, StrategyRun, check_strategy
from robosc.controller_properties.of_automata import AutomataProperties, check_automata
from robosc.controller_properties.outcome import Blocking, Conflict, ForbiddenCancel, Livelock, Order, Properties

__all__ = [
    "DEFAULT_LIMIT",
    "AutomataProperties",
    "Blocking",
    "Conflict",
    "Controller",
    "ForbiddenCancel",
    "Livelock",
    "MissedGoal",
    "Order",
    "Properties",
    "StrategyCheck",
    "StrategyRun",
    "check_automata",
    "check_controller",
    "check_strategy",
    "controller_findings",
]
