"""Names that `import robosc` offers: exactly these, and each is loaded on use alone."""

import importlib
import subprocess
import sys

import pytest

import robosc

FUNCTIONS = ["check", "explain", "explore", "generate", "load", "simulate", "synthesize", "verify"]
VALUES = [
    *(
        "Choice",
        "Condition",
        "Conditions",
        "CounterRun",
        "DetourProgress",
        "MissionProgress",
        "Deployment",
        "Diagnostic",
        "Explained",
        "Exploration",
        "Findings",
        "GenerateOptions",
    ),
    *("Generation", "LoadedAutomata", "LoadedModel", "NoSupervisor", "Progress", "Run", "Severity", "Step", "Summary"),
    *(
        "Supervisor",
        "Synthesis",
        "SynthesisOptions",
        "SynthesisStatus",
        "SystemRun",
        "SystemSupervisor",
        "SystemSynthesis",
    ),
    *(
        "GoalApproach",
        "GoalExplanation",
        "GoalSummary",
        "Goals",
        "Verification",
        "VerificationStatus",
        "WalkFinding",
        "WalkFindingKind",
    ),
]
ERRORS = [
    *(
        "ChoiceError",
        "DataError",
        "DrawingUnavailableError",
        "EventNotPossibleError",
        "FileAccessError",
        "InternalError",
        "InvalidSupervisorError",
    ),
    *(
        "InvalidSystemError",
        "LanguageError",
        "NoCounterStrategyError",
        "NoStrategyError",
        "NodeLimitError",
        "NothingGeneratedError",
        "OverwriteError",
    ),
    *("RequestError", "RoboscError", "SynthesisCancelled", "UnknownCodeError", "UnknownEngineError"),
    *("UnknownEventError", "UnknownNameError", "UnknownTargetError", "UnsupportedModelError"),
]


def loaded_after(program: str) -> set[str]:
    """Modules that a program of its own has loaded."""
    program += "\nimport sys\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def test_the_names_are_these() -> None:
    assert sorted(robosc.__all__) == sorted([*FUNCTIONS, *VALUES, *ERRORS, "__version__"])
    assert set(robosc.__all__) <= set(dir(robosc))


@pytest.mark.parametrize("name", robosc.__all__)
def test_every_name_is_there_and_documented(name: str) -> None:
    value = getattr(robosc, name)
    assert value.__doc__
    if name in ERRORS:
        assert issubclass(value, robosc.RoboscError)
    if name in FUNCTIONS:
        assert callable(value)


def test_no_module_stands_in_the_place_of_a_function() -> None:
    for name in FUNCTIONS:
        with pytest.raises(ModuleNotFoundError):
            importlib.import_module(f"robosc.{name}")


def test_another_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'robosc' has no attribute 'synthesise'"):
        robosc.synthesise  # type: ignore[attr-defined]  # noqa: B018


def test_the_import_is_cheap() -> None:
    # Modules that the interpreter loads by itself on this machine are not ours.
    found = {name for name in loaded_after("import robosc") - loaded_after("") if not name.startswith("_")}
    assert {name for name in found if name.partition(".")[0] == "robosc"} == {
        *("robosc", "robosc._version", "robosc.named_on_use"),
    }
    assert not {name.partition(".")[0] for name in found} & {"dd", "msgspec", "jinja2", "dataclasses", "json"}


def test_checking_does_not_load_the_synthesizer() -> None:
    found = loaded_after("import robosc\nrobosc.check(robosc.load(text='robot R { component C { } }'))")
    assert "robosc.model" in found
    assert not {name for name in found if name.partition(".")[0] == "dd" or name.startswith("robosc.synthesis")}
