"""Tasks of a server as values, for direct calls and for jobs."""

from dataclasses import dataclass

from robosc.model.structure import Deployment
from robosc.pipeline.options import DEFAULT_OPTIONS, SynthesisOptions
from robosc.source import Bundle, SourceFile
from robosc.targets import GenerateOptions

DEFAULT_GENERATION = GenerateOptions()


@dataclass(frozen=True, slots=True)
class Check:
    """Check a model or library: report every finding."""

    model: Bundle


@dataclass(frozen=True, slots=True)
class Synthesize:
    """Synthesize and certify a supervisor.

    Attributes:
        model: The model and its libraries, or automata.
        options: Options for making the supervisor; of automata, those about the engine.
        is_modular: True for a synthesis in modules.
    """

    model: Bundle
    options: SynthesisOptions = DEFAULT_OPTIONS
    is_modular: bool = False


@dataclass(frozen=True, slots=True)
class Generate:
    """Synthesize a supervisor, and generate the files of a target around it.

    Attributes:
        initial: Description of the state in which automata begin that may begin in several; None: as the model says.
        is_modular: True for a synthesis in modules.
    """

    model: Bundle
    target: str
    generation: GenerateOptions = DEFAULT_GENERATION
    options: SynthesisOptions = DEFAULT_OPTIONS
    initial: str | None = None
    is_modular: bool = False


@dataclass(frozen=True, slots=True)
class Explore:
    """Explore everything that the robot may do under its supervisor.

    Attributes:
        maximum_states: Number of states beyond which the exploration is given up; None: 100,000.
    """

    model: Bundle
    options: SynthesisOptions = DEFAULT_OPTIONS
    maximum_states: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Verify:
    """Check of a supervisor against its model, or verification of properties of the robot under its supervisor.

    Of automata the supervisor is made, and verified by other means; they have no properties and no supervisor's file.

    Attributes:
        model: The model and its libraries.
        supervisor: A supervisor's file (`.rsup`), which is not trusted; empty: the supervisor is made from the model.
        deployment: Deployment of the supervisor; None: that of its file, or a controller if there is no file.
        properties: Properties in the property language.
        property_files: Texts with a property on each line.
        engine: As in SynthesisOptions.
        allow_reordering: As in SynthesisOptions.
        maximum_nodes: As in SynthesisOptions.
        maximum_states: States up to which a given supervisor is searched one by one; None: 1,000,000.
        is_strict: True if a given supervisor passes only if permissiveness was checked, too.
        controller: True if automata are also checked for bounded and finite response, confluence and nonblocking under
            control.
        as_is: True if nothing is synthesized: automata are verified as they stand.
    """

    model: Bundle
    supervisor: bytes = b""
    deployment: Deployment | None = None
    properties: tuple[str, ...] = ()
    property_files: tuple[SourceFile, ...] = ()
    engine: str = "auto"
    allow_reordering: bool = False
    maximum_nodes: int | None = None
    maximum_states: int | None = None
    is_strict: bool = False
    controller: bool = False
    as_is: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Explain:
    """Explain what synthesis does to a model; without `event`, `state` and `after`, to all of it.

    Attributes:
        model: The model and its libraries, or automata.
        options: Options for making the supervisor.
        event: The event to explain; None: none in particular.
        state: Description of a state in which to explain what can happen, such as `Door.closed, Lift.n = 2`.
        after: Run after which to explain what can happen, such as `open, jam.response`.
        is_modular: True if the events of a robot are explained module by module.
    """

    model: Bundle
    options: SynthesisOptions = DEFAULT_OPTIONS
    event: str | None = None
    state: str | None = None
    after: str | None = None
    is_modular: bool = False


@dataclass(frozen=True, slots=True)
class Format:
    """Put a text into its canonical layout."""

    file: SourceFile


type Task = Check | Synthesize | Generate | Explore | Verify | Explain | Format

__all__ = [
    "DEFAULT_GENERATION",
    "DEFAULT_OPTIONS",
    "Check",
    "Explain",
    "Explore",
    "Format",
    "Generate",
    "SynthesisOptions",
    "Synthesize",
    "Task",
    "Verify",
]
