"""Event logs after the fact: read, checked against the supervisor, drawn over time, converted for other tools.

An executor writes its log in one format whatever it runs on (`robosc.execution.runtime.event_log`): the nodes of every
target, the bridge and the simulations. Drawing needs the extra `robosc[plot]`, converting
`robosc[mcap]`; reading and checking need nothing more.
"""

from robosc.event_logs.bands import PlotError
from robosc.event_logs.checking import LogCheck, Violation, WrongDeploymentError, check_log
from robosc.event_logs.conversion import ConversionError, ConversionUnavailableError, Converted, convert_log
from robosc.event_logs.drawing import Drawn, PlottingUnavailableError, draw_sequence
from robosc.event_logs.entries import LogEntry, LoggedRun
from robosc.event_logs.motions import MotionOfLogError
from robosc.event_logs.reading import LogError, LogReader, read_log

__all__ = [
    "ConversionError",
    "ConversionUnavailableError",
    "Converted",
    "Drawn",
    "LogCheck",
    "LogEntry",
    "LogError",
    "LogReader",
    "LoggedRun",
    "MotionOfLogError",
    "PlotError",
    "PlottingUnavailableError",
    "Violation",
    "WrongDeploymentError",
    "check_log",
    "convert_log",
    "draw_sequence",
    "read_log",
]
