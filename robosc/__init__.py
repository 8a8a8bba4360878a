"""RoboSC: supervisory controllers for robots, correct by construction.

Pipeline, one way: text -> syntax tree (`robosc.language`) -> checked model (`robosc.model`) ->
automata (`robosc.automata`) -> certified supervisor (`robosc.synthesis`, `robosc.certification`) ->
execution and targets (`robosc.execution`, `robosc.targets`).

As a Python API, it is these functions, one for each command (`robosc.pipeline`, docs/python-api.md):

    model = robosc.load("robot.rscd")
    result = robosc.synthesize(model)
    run = robosc.simulate(result.supervisor)
    robosc.generate(result.supervisor, "ros2").write("out")

The names are imported on use: a program that only reads a supervisor's file does not load the synthesizer.
"""

from typing import TYPE_CHECKING

from robosc._version import __version__
from robosc.named_on_use import named_on_use

if TYPE_CHECKING:
    from robosc.certification import Progress
    from robosc.certification.goals import GoalExplanation
    from robosc.diagnostics import UnknownCodeError
    from robosc.errors import (
        Diagnostic,
        InternalError,
        InvalidSupervisorError,
        InvalidSystemError,
        LanguageError,
        NodeLimitError,
        RoboscError,
        Severity,
        SynthesisCancelled,
        UnknownNameError,
        UnsupportedModelError,
    )
    from robosc.explanation import RequestError
    from robosc.graphviz import DrawingUnavailableError
    from robosc.model.structure import Deployment
    from robosc.pipeline.checking import check
    from robosc.pipeline.conditions import Condition, Conditions
    from robosc.pipeline.counter_run import CounterRun, NoCounterStrategyError
    from robosc.pipeline.explaining import explain
    from robosc.pipeline.exploring import Exploration, explore
    from robosc.pipeline.files import FileAccessError
    from robosc.pipeline.findings import Findings
    from robosc.pipeline.generating import generate
    from robosc.pipeline.goals import Choice, GoalApproach, Goals
    from robosc.pipeline.loading import LoadedAutomata, LoadedModel, load
    from robosc.pipeline.manual_run import EventNotPossibleError, NoStrategyError, UnknownEventError
    from robosc.pipeline.missions import DetourProgress, MissionProgress
    from robosc.pipeline.options import SynthesisOptions
    from robosc.pipeline.received_data import DataError
    from robosc.pipeline.results import (
        Explained,
        Generation,
        GoalSummary,
        NoSupervisor,
        NothingGeneratedError,
        Summary,
        SynthesisStatus,
        Verification,
        VerificationStatus,
    )
    from robosc.pipeline.simulation import Run, simulate
    from robosc.pipeline.steps import Step
    from robosc.pipeline.supervisors import Supervisor
    from robosc.pipeline.synthesis import Synthesis, synthesize
    from robosc.pipeline.system_runs import ChoiceError, SystemRun
    from robosc.pipeline.systems import SystemSupervisor, SystemSynthesis
    from robosc.pipeline.verifying import verify
    from robosc.pipeline.walking import WalkFinding, WalkFindingKind
    from robosc.synthesis import UnknownEngineError
    from robosc.targets import GenerateOptions, OverwriteError, UnknownTargetError

_HOMES = {
    "Choice": "pipeline.goals",
    "ChoiceError": "pipeline.system_runs",
    "Condition": "pipeline.conditions",
    "Conditions": "pipeline.conditions",
    "CounterRun": "pipeline.counter_run",
    "DataError": "pipeline.received_data",
    "Deployment": "model.structure",
    "DetourProgress": "pipeline.missions",
    "Diagnostic": "errors",
    "DrawingUnavailableError": "graphviz",
    "EventNotPossibleError": "pipeline.manual_run",
    "Explained": "pipeline.results",
    "Exploration": "pipeline.exploring",
    "FileAccessError": "pipeline.files",
    "Findings": "pipeline.findings",
    "GenerateOptions": "targets",
    "Generation": "pipeline.results",
    "GoalApproach": "pipeline.goals",
    "GoalExplanation": "certification.goals",
    "GoalSummary": "pipeline.results",
    "Goals": "pipeline.goals",
    "InternalError": "errors",
    "InvalidSupervisorError": "errors",
    "InvalidSystemError": "errors",
    "LanguageError": "errors",
    "LoadedAutomata": "pipeline.loading",
    "LoadedModel": "pipeline.loading",
    "MissionProgress": "pipeline.missions",
    "NoCounterStrategyError": "pipeline.counter_run",
    "NoStrategyError": "pipeline.manual_run",
    "NoSupervisor": "pipeline.results",
    "NodeLimitError": "errors",
    "NothingGeneratedError": "pipeline.results",
    "OverwriteError": "targets",
    "Progress": "certification",
    "RequestError": "explanation",
    "RoboscError": "errors",
    "Run": "pipeline.simulation",
    "Severity": "errors",
    "Step": "pipeline.steps",
    "Summary": "pipeline.results",
    "Supervisor": "pipeline.supervisors",
    "Synthesis": "pipeline.synthesis",
    "SynthesisCancelled": "errors",
    "SynthesisOptions": "pipeline.options",
    "SynthesisStatus": "pipeline.results",
    "SystemRun": "pipeline.system_runs",
    "SystemSupervisor": "pipeline.systems",
    "SystemSynthesis": "pipeline.systems",
    "UnknownCodeError": "diagnostics",
    "UnknownEngineError": "synthesis",
    "UnknownEventError": "pipeline.manual_run",
    "UnknownNameError": "errors",
    "UnknownTargetError": "targets",
    "UnsupportedModelError": "errors",
    "Verification": "pipeline.results",
    "VerificationStatus": "pipeline.results",
    "WalkFinding": "pipeline.walking",
    "WalkFindingKind": "pipeline.walking",
    "check": "pipeline.checking",
    "explain": "pipeline.explaining",
    "explore": "pipeline.exploring",
    "generate": "pipeline.generating",
    "load": "pipeline.loading",
    "simulate": "pipeline.simulation",
    "synthesize": "pipeline.synthesis",
    "verify": "pipeline.verifying",
}

__all__ = [
    "Choice",
    "ChoiceError",
    "Condition",
    "Conditions",
    "CounterRun",
    "DataError",
    "Deployment",
    "DetourProgress",
    "Diagnostic",
    "DrawingUnavailableError",
    "EventNotPossibleError",
    "Explained",
    "Exploration",
    "FileAccessError",
    "Findings",
    "GenerateOptions",
    "Generation",
    "GoalApproach",
    "GoalExplanation",
    "GoalSummary",
    "Goals",
    "InternalError",
    "InvalidSupervisorError",
    "InvalidSystemError",
    "LanguageError",
    "LoadedAutomata",
    "LoadedModel",
    "MissionProgress",
    "NoCounterStrategyError",
    "NoStrategyError",
    "NoSupervisor",
    "NodeLimitError",
    "NothingGeneratedError",
    "OverwriteError",
    "Progress",
    "RequestError",
    "RoboscError",
    "Run",
    "Severity",
    "Step",
    "Summary",
    "Supervisor",
    "Synthesis",
    "SynthesisCancelled",
    "SynthesisOptions",
    "SynthesisStatus",
    "SystemRun",
    "SystemSupervisor",
    "SystemSynthesis",
    "UnknownCodeError",
    "UnknownEngineError",
    "UnknownEventError",
    "UnknownNameError",
    "UnknownTargetError",
    "UnsupportedModelError",
    "Verification",
    "VerificationStatus",
    "WalkFinding",
    "WalkFindingKind",
    "__version__",
    "check",
    "explain",
    "explore",
    "generate",
    "load",
    "simulate",
    "synthesize",
    "verify",
]


if not TYPE_CHECKING:
    # A type checker knows the names from above, and is to find every other one wrong.
    __getattr__ = named_on_use(__name__, _HOMES)


def __dir__() -> list[str]:
    """Return the public names, loaded or not, beside what modules have."""
    return sorted({*globals(), *__all__})
