from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Language(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    LANGUAGE_UNSPECIFIED: _ClassVar[Language]
    LANGUAGE_ROBOSC: _ClassVar[Language]
    LANGUAGE_CIF: _ClassVar[Language]
    LANGUAGE_FAUDES: _ClassVar[Language]
    LANGUAGE_SUPREMICA: _ClassVar[Language]

class Severity(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    SEVERITY_UNSPECIFIED: _ClassVar[Severity]
    SEVERITY_ERROR: _ClassVar[Severity]
    SEVERITY_WARNING: _ClassVar[Severity]
    SEVERITY_NOTE: _ClassVar[Severity]

class Deployment(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    DEPLOYMENT_UNSPECIFIED: _ClassVar[Deployment]
    DEPLOYMENT_CONTROLLER: _ClassVar[Deployment]
    DEPLOYMENT_LAYER: _ClassVar[Deployment]

class SynthesisStatus(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    SYNTHESIS_STATUS_UNSPECIFIED: _ClassVar[SynthesisStatus]
    SYNTHESIS_STATUS_SUPERVISOR: _ClassVar[SynthesisStatus]
    SYNTHESIS_STATUS_EMPTY: _ClassVar[SynthesisStatus]
    SYNTHESIS_STATUS_MODEL_ERRORS: _ClassVar[SynthesisStatus]
    SYNTHESIS_STATUS_UNSUPPORTED_MODEL: _ClassVar[SynthesisStatus]

class VerificationStatus(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    VERIFICATION_STATUS_UNSPECIFIED: _ClassVar[VerificationStatus]
    VERIFICATION_STATUS_PASSED: _ClassVar[VerificationStatus]
    VERIFICATION_STATUS_FAILED: _ClassVar[VerificationStatus]
    VERIFICATION_STATUS_NOT_CHECKED: _ClassVar[VerificationStatus]
    VERIFICATION_STATUS_PROPERTY_ERRORS: _ClassVar[VerificationStatus]
    VERIFICATION_STATUS_NO_SUPERVISOR: _ClassVar[VerificationStatus]
    VERIFICATION_STATUS_UNSUPPORTED_MODEL: _ClassVar[VerificationStatus]

class ExplanationStatus(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    EXPLANATION_STATUS_UNSPECIFIED: _ClassVar[ExplanationStatus]
    EXPLANATION_STATUS_SUPERVISOR: _ClassVar[ExplanationStatus]
    EXPLANATION_STATUS_EMPTY: _ClassVar[ExplanationStatus]
    EXPLANATION_STATUS_MODEL_ERRORS: _ClassVar[ExplanationStatus]
    EXPLANATION_STATUS_UNSUPPORTED_MODEL: _ClassVar[ExplanationStatus]
    EXPLANATION_STATUS_NOT_THERE: _ClassVar[ExplanationStatus]
LANGUAGE_UNSPECIFIED: Language
LANGUAGE_ROBOSC: Language
LANGUAGE_CIF: Language
LANGUAGE_FAUDES: Language
LANGUAGE_SUPREMICA: Language
SEVERITY_UNSPECIFIED: Severity
SEVERITY_ERROR: Severity
SEVERITY_WARNING: Severity
SEVERITY_NOTE: Severity
DEPLOYMENT_UNSPECIFIED: Deployment
DEPLOYMENT_CONTROLLER: Deployment
DEPLOYMENT_LAYER: Deployment
SYNTHESIS_STATUS_UNSPECIFIED: SynthesisStatus
SYNTHESIS_STATUS_SUPERVISOR: SynthesisStatus
SYNTHESIS_STATUS_EMPTY: SynthesisStatus
SYNTHESIS_STATUS_MODEL_ERRORS: SynthesisStatus
SYNTHESIS_STATUS_UNSUPPORTED_MODEL: SynthesisStatus
VERIFICATION_STATUS_UNSPECIFIED: VerificationStatus
VERIFICATION_STATUS_PASSED: VerificationStatus
VERIFICATION_STATUS_FAILED: VerificationStatus
VERIFICATION_STATUS_NOT_CHECKED: VerificationStatus
VERIFICATION_STATUS_PROPERTY_ERRORS: VerificationStatus
VERIFICATION_STATUS_NO_SUPERVISOR: VerificationStatus
VERIFICATION_STATUS_UNSUPPORTED_MODEL: VerificationStatus
EXPLANATION_STATUS_UNSPECIFIED: ExplanationStatus
EXPLANATION_STATUS_SUPERVISOR: ExplanationStatus
EXPLANATION_STATUS_EMPTY: ExplanationStatus
EXPLANATION_STATUS_MODEL_ERRORS: ExplanationStatus
EXPLANATION_STATUS_UNSUPPORTED_MODEL: ExplanationStatus
EXPLANATION_STATUS_NOT_THERE: ExplanationStatus

class SourceFile(_message.Message):
    __slots__ = ("name", "text")
    NAME_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    name: str
    text: str
    def __init__(self, name: _Optional[str] = ..., text: _Optional[str] = ...) -> None: ...

class Bundle(_message.Message):
    __slots__ = ("main", "libraries", "searched", "interfaces", "language", "distribution")
    MAIN_FIELD_NUMBER: _ClassVar[int]
    LIBRARIES_FIELD_NUMBER: _ClassVar[int]
    SEARCHED_FIELD_NUMBER: _ClassVar[int]
    INTERFACES_FIELD_NUMBER: _ClassVar[int]
    LANGUAGE_FIELD_NUMBER: _ClassVar[int]
    DISTRIBUTION_FIELD_NUMBER: _ClassVar[int]
    main: SourceFile
    libraries: _containers.RepeatedCompositeFieldContainer[SourceFile]
    searched: _containers.RepeatedScalarFieldContainer[str]
    interfaces: _containers.RepeatedCompositeFieldContainer[SourceFile]
    language: Language
    distribution: str
    def __init__(self, main: _Optional[_Union[SourceFile, _Mapping]] = ..., libraries: _Optional[_Iterable[_Union[SourceFile, _Mapping]]] = ..., searched: _Optional[_Iterable[str]] = ..., interfaces: _Optional[_Iterable[_Union[SourceFile, _Mapping]]] = ..., language: _Optional[_Union[Language, str]] = ..., distribution: _Optional[str] = ...) -> None: ...

class Location(_message.Message):
    __slots__ = ("file", "line", "column", "length")
    FILE_FIELD_NUMBER: _ClassVar[int]
    LINE_FIELD_NUMBER: _ClassVar[int]
    COLUMN_FIELD_NUMBER: _ClassVar[int]
    LENGTH_FIELD_NUMBER: _ClassVar[int]
    file: str
    line: int
    column: int
    length: int
    def __init__(self, file: _Optional[str] = ..., line: _Optional[int] = ..., column: _Optional[int] = ..., length: _Optional[int] = ...) -> None: ...

class RelatedPlace(_message.Message):
    __slots__ = ("message", "location")
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    LOCATION_FIELD_NUMBER: _ClassVar[int]
    message: str
    location: Location
    def __init__(self, message: _Optional[str] = ..., location: _Optional[_Union[Location, _Mapping]] = ...) -> None: ...

class Diagnostic(_message.Message):
    __slots__ = ("severity", "code", "message", "location", "mend", "related", "accepted")
    SEVERITY_FIELD_NUMBER: _ClassVar[int]
    CODE_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    LOCATION_FIELD_NUMBER: _ClassVar[int]
    MEND_FIELD_NUMBER: _ClassVar[int]
    RELATED_FIELD_NUMBER: _ClassVar[int]
    ACCEPTED_FIELD_NUMBER: _ClassVar[int]
    severity: Severity
    code: str
    message: str
    location: Location
    mend: str
    related: _containers.RepeatedCompositeFieldContainer[RelatedPlace]
    accepted: str
    def __init__(self, severity: _Optional[_Union[Severity, str]] = ..., code: _Optional[str] = ..., message: _Optional[str] = ..., location: _Optional[_Union[Location, _Mapping]] = ..., mend: _Optional[str] = ..., related: _Optional[_Iterable[_Union[RelatedPlace, _Mapping]]] = ..., accepted: _Optional[str] = ...) -> None: ...

class SynthesisOptions(_message.Message):
    __slots__ = ("deployment", "engine", "allow_livelock", "allow_reordering", "maximum_nodes", "verified_states")
    DEPLOYMENT_FIELD_NUMBER: _ClassVar[int]
    ENGINE_FIELD_NUMBER: _ClassVar[int]
    ALLOW_LIVELOCK_FIELD_NUMBER: _ClassVar[int]
    ALLOW_REORDERING_FIELD_NUMBER: _ClassVar[int]
    MAXIMUM_NODES_FIELD_NUMBER: _ClassVar[int]
    VERIFIED_STATES_FIELD_NUMBER: _ClassVar[int]
    deployment: Deployment
    engine: str
    allow_livelock: bool
    allow_reordering: bool
    maximum_nodes: int
    verified_states: int
    def __init__(self, deployment: _Optional[_Union[Deployment, str]] = ..., engine: _Optional[str] = ..., allow_livelock: _Optional[bool] = ..., allow_reordering: _Optional[bool] = ..., maximum_nodes: _Optional[int] = ..., verified_states: _Optional[int] = ...) -> None: ...

class CheckRequest(_message.Message):
    __slots__ = ("bundle",)
    BUNDLE_FIELD_NUMBER: _ClassVar[int]
    bundle: Bundle
    def __init__(self, bundle: _Optional[_Union[Bundle, _Mapping]] = ...) -> None: ...

class CheckResponse(_message.Message):
    __slots__ = ("diagnostics", "accepted")
    DIAGNOSTICS_FIELD_NUMBER: _ClassVar[int]
    ACCEPTED_FIELD_NUMBER: _ClassVar[int]
    diagnostics: _containers.RepeatedCompositeFieldContainer[Diagnostic]
    accepted: _containers.RepeatedCompositeFieldContainer[Diagnostic]
    def __init__(self, diagnostics: _Optional[_Iterable[_Union[Diagnostic, _Mapping]]] = ..., accepted: _Optional[_Iterable[_Union[Diagnostic, _Mapping]]] = ...) -> None: ...

class SynthesizeRequest(_message.Message):
    __slots__ = ("bundle", "options", "modular")
    BUNDLE_FIELD_NUMBER: _ClassVar[int]
    OPTIONS_FIELD_NUMBER: _ClassVar[int]
    MODULAR_FIELD_NUMBER: _ClassVar[int]
    bundle: Bundle
    options: SynthesisOptions
    modular: bool
    def __init__(self, bundle: _Optional[_Union[Bundle, _Mapping]] = ..., options: _Optional[_Union[SynthesisOptions, _Mapping]] = ..., modular: _Optional[bool] = ...) -> None: ...

class SynthesizeResponse(_message.Message):
    __slots__ = ("progress", "result")
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    RESULT_FIELD_NUMBER: _ClassVar[int]
    progress: Progress
    result: SynthesisResult
    def __init__(self, progress: _Optional[_Union[Progress, _Mapping]] = ..., result: _Optional[_Union[SynthesisResult, _Mapping]] = ...) -> None: ...

class Progress(_message.Message):
    __slots__ = ("stage", "message")
    STAGE_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    stage: str
    message: str
    def __init__(self, stage: _Optional[str] = ..., message: _Optional[str] = ...) -> None: ...

class SynthesisResult(_message.Message):
    __slots__ = ("status", "diagnostics", "supervisor", "reason", "summary", "statistics", "explanation", "supervisor_digest", "signature", "goals", "accepted")
    STATUS_FIELD_NUMBER: _ClassVar[int]
    DIAGNOSTICS_FIELD_NUMBER: _ClassVar[int]
    SUPERVISOR_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    SUMMARY_FIELD_NUMBER: _ClassVar[int]
    STATISTICS_FIELD_NUMBER: _ClassVar[int]
    EXPLANATION_FIELD_NUMBER: _ClassVar[int]
    SUPERVISOR_DIGEST_FIELD_NUMBER: _ClassVar[int]
    SIGNATURE_FIELD_NUMBER: _ClassVar[int]
    GOALS_FIELD_NUMBER: _ClassVar[int]
    ACCEPTED_FIELD_NUMBER: _ClassVar[int]
    status: SynthesisStatus
    diagnostics: _containers.RepeatedCompositeFieldContainer[Diagnostic]
    supervisor: bytes
    reason: str
    summary: Summary
    statistics: Statistics
    explanation: str
    supervisor_digest: bytes
    signature: bytes
    goals: GoalExplanation
    accepted: _containers.RepeatedCompositeFieldContainer[Diagnostic]
    def __init__(self, status: _Optional[_Union[SynthesisStatus, str]] = ..., diagnostics: _Optional[_Iterable[_Union[Diagnostic, _Mapping]]] = ..., supervisor: _Optional[bytes] = ..., reason: _Optional[str] = ..., summary: _Optional[_Union[Summary, _Mapping]] = ..., statistics: _Optional[_Union[Statistics, _Mapping]] = ..., explanation: _Optional[str] = ..., supervisor_digest: _Optional[bytes] = ..., signature: _Optional[bytes] = ..., goals: _Optional[_Union[GoalExplanation, _Mapping]] = ..., accepted: _Optional[_Iterable[_Union[Diagnostic, _Mapping]]] = ...) -> None: ...

class GoalExplanation(_message.Message):
    __slots__ = ("goals", "is_hopeless", "blamed", "is_minimal", "helpful", "nearest", "has_counter_strategy")
    GOALS_FIELD_NUMBER: _ClassVar[int]
    IS_HOPELESS_FIELD_NUMBER: _ClassVar[int]
    BLAMED_FIELD_NUMBER: _ClassVar[int]
    IS_MINIMAL_FIELD_NUMBER: _ClassVar[int]
    HELPFUL_FIELD_NUMBER: _ClassVar[int]
    NEAREST_FIELD_NUMBER: _ClassVar[int]
    HAS_COUNTER_STRATEGY_FIELD_NUMBER: _ClassVar[int]
    goals: _containers.RepeatedCompositeFieldContainer[ModelPart]
    is_hopeless: bool
    blamed: _containers.RepeatedCompositeFieldContainer[ModelPart]
    is_minimal: bool
    helpful: _containers.RepeatedScalarFieldContainer[str]
    nearest: NearestState
    has_counter_strategy: bool
    def __init__(self, goals: _Optional[_Iterable[_Union[ModelPart, _Mapping]]] = ..., is_hopeless: _Optional[bool] = ..., blamed: _Optional[_Iterable[_Union[ModelPart, _Mapping]]] = ..., is_minimal: _Optional[bool] = ..., helpful: _Optional[_Iterable[str]] = ..., nearest: _Optional[_Union[NearestState, _Mapping]] = ..., has_counter_strategy: _Optional[bool] = ...) -> None: ...

class ModelPart(_message.Message):
    __slots__ = ("kind", "text", "location")
    KIND_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    LOCATION_FIELD_NUMBER: _ClassVar[int]
    kind: str
    text: str
    location: Location
    def __init__(self, kind: _Optional[str] = ..., text: _Optional[str] = ..., location: _Optional[_Union[Location, _Mapping]] = ...) -> None: ...

class NearestState(_message.Message):
    __slots__ = ("goal", "is_reached", "has_others", "events", "state", "missing")
    GOAL_FIELD_NUMBER: _ClassVar[int]
    IS_REACHED_FIELD_NUMBER: _ClassVar[int]
    HAS_OTHERS_FIELD_NUMBER: _ClassVar[int]
    EVENTS_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    MISSING_FIELD_NUMBER: _ClassVar[int]
    goal: str
    is_reached: bool
    has_others: bool
    events: _containers.RepeatedScalarFieldContainer[str]
    state: _containers.RepeatedCompositeFieldContainer[PartValue]
    missing: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, goal: _Optional[str] = ..., is_reached: _Optional[bool] = ..., has_others: _Optional[bool] = ..., events: _Optional[_Iterable[str]] = ..., state: _Optional[_Iterable[_Union[PartValue, _Mapping]]] = ..., missing: _Optional[_Iterable[str]] = ...) -> None: ...

class PartValue(_message.Message):
    __slots__ = ("name", "truth", "integer", "number", "text")
    NAME_FIELD_NUMBER: _ClassVar[int]
    TRUTH_FIELD_NUMBER: _ClassVar[int]
    INTEGER_FIELD_NUMBER: _ClassVar[int]
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    name: str
    truth: bool
    integer: int
    number: float
    text: str
    def __init__(self, name: _Optional[str] = ..., truth: _Optional[bool] = ..., integer: _Optional[int] = ..., number: _Optional[float] = ..., text: _Optional[str] = ...) -> None: ...

class Statistics(_message.Message):
    __slots__ = ("engine", "state_bits", "iterations", "peak_nodes", "race")
    ENGINE_FIELD_NUMBER: _ClassVar[int]
    STATE_BITS_FIELD_NUMBER: _ClassVar[int]
    ITERATIONS_FIELD_NUMBER: _ClassVar[int]
    PEAK_NODES_FIELD_NUMBER: _ClassVar[int]
    RACE_FIELD_NUMBER: _ClassVar[int]
    engine: str
    state_bits: int
    iterations: int
    peak_nodes: int
    race: _containers.RepeatedCompositeFieldContainer[Strategy]
    def __init__(self, engine: _Optional[str] = ..., state_bits: _Optional[int] = ..., iterations: _Optional[int] = ..., peak_nodes: _Optional[int] = ..., race: _Optional[_Iterable[_Union[Strategy, _Mapping]]] = ...) -> None: ...

class Strategy(_message.Message):
    __slots__ = ("order", "search", "nodes", "won", "given_up")
    ORDER_FIELD_NUMBER: _ClassVar[int]
    SEARCH_FIELD_NUMBER: _ClassVar[int]
    NODES_FIELD_NUMBER: _ClassVar[int]
    WON_FIELD_NUMBER: _ClassVar[int]
    GIVEN_UP_FIELD_NUMBER: _ClassVar[int]
    order: str
    search: str
    nodes: int
    won: int
    given_up: int
    def __init__(self, order: _Optional[str] = ..., search: _Optional[str] = ..., nodes: _Optional[int] = ..., won: _Optional[int] = ..., given_up: _Optional[int] = ...) -> None: ...

class Summary(_message.Message):
    __slots__ = ("controllable_events", "uncontrollable_events", "states", "transitions", "added", "text", "goals")
    CONTROLLABLE_EVENTS_FIELD_NUMBER: _ClassVar[int]
    UNCONTROLLABLE_EVENTS_FIELD_NUMBER: _ClassVar[int]
    STATES_FIELD_NUMBER: _ClassVar[int]
    TRANSITIONS_FIELD_NUMBER: _ClassVar[int]
    ADDED_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    GOALS_FIELD_NUMBER: _ClassVar[int]
    controllable_events: int
    uncontrollable_events: int
    states: str
    transitions: str
    added: _containers.RepeatedCompositeFieldContainer[AddedCondition]
    text: str
    goals: Goals
    def __init__(self, controllable_events: _Optional[int] = ..., uncontrollable_events: _Optional[int] = ..., states: _Optional[str] = ..., transitions: _Optional[str] = ..., added: _Optional[_Iterable[_Union[AddedCondition, _Mapping]]] = ..., text: _Optional[str] = ..., goals: _Optional[_Union[Goals, _Mapping]] = ...) -> None: ...

class Goals(_message.Message):
    __slots__ = ("aims", "assumptions", "has_strategy", "modes")
    AIMS_FIELD_NUMBER: _ClassVar[int]
    ASSUMPTIONS_FIELD_NUMBER: _ClassVar[int]
    HAS_STRATEGY_FIELD_NUMBER: _ClassVar[int]
    MODES_FIELD_NUMBER: _ClassVar[int]
    aims: _containers.RepeatedScalarFieldContainer[str]
    assumptions: _containers.RepeatedScalarFieldContainer[str]
    has_strategy: bool
    modes: int
    def __init__(self, aims: _Optional[_Iterable[str]] = ..., assumptions: _Optional[_Iterable[str]] = ..., has_strategy: _Optional[bool] = ..., modes: _Optional[int] = ...) -> None: ...

class AddedCondition(_message.Message):
    __slots__ = ("event", "condition")
    EVENT_FIELD_NUMBER: _ClassVar[int]
    CONDITION_FIELD_NUMBER: _ClassVar[int]
    event: str
    condition: str
    def __init__(self, event: _Optional[str] = ..., condition: _Optional[str] = ...) -> None: ...

class GenerateRequest(_message.Message):
    __slots__ = ("bundle", "options", "target", "generation", "initial", "modular")
    BUNDLE_FIELD_NUMBER: _ClassVar[int]
    OPTIONS_FIELD_NUMBER: _ClassVar[int]
    TARGET_FIELD_NUMBER: _ClassVar[int]
    GENERATION_FIELD_NUMBER: _ClassVar[int]
    INITIAL_FIELD_NUMBER: _ClassVar[int]
    MODULAR_FIELD_NUMBER: _ClassVar[int]
    bundle: Bundle
    options: SynthesisOptions
    target: str
    generation: GenerateOptions
    initial: str
    modular: bool
    def __init__(self, bundle: _Optional[_Union[Bundle, _Mapping]] = ..., options: _Optional[_Union[SynthesisOptions, _Mapping]] = ..., target: _Optional[str] = ..., generation: _Optional[_Union[GenerateOptions, _Mapping]] = ..., initial: _Optional[str] = ..., modular: _Optional[bool] = ...) -> None: ...

class GenerateOptions(_message.Message):
    __slots__ = ("package", "publish_state", "log_events", "supervised", "metadata", "state_message")
    PACKAGE_FIELD_NUMBER: _ClassVar[int]
    PUBLISH_STATE_FIELD_NUMBER: _ClassVar[int]
    LOG_EVENTS_FIELD_NUMBER: _ClassVar[int]
    SUPERVISED_FIELD_NUMBER: _ClassVar[int]
    METADATA_FIELD_NUMBER: _ClassVar[int]
    STATE_MESSAGE_FIELD_NUMBER: _ClassVar[int]
    package: str
    publish_state: bool
    log_events: bool
    supervised: SupervisedController
    metadata: PackageMetadata
    state_message: str
    def __init__(self, package: _Optional[str] = ..., publish_state: _Optional[bool] = ..., log_events: _Optional[bool] = ..., supervised: _Optional[_Union[SupervisedController, _Mapping]] = ..., metadata: _Optional[_Union[PackageMetadata, _Mapping]] = ..., state_message: _Optional[str] = ...) -> None: ...

class PackageMetadata(_message.Message):
    __slots__ = ("maintainer", "email", "license", "version", "copyright")
    MAINTAINER_FIELD_NUMBER: _ClassVar[int]
    EMAIL_FIELD_NUMBER: _ClassVar[int]
    LICENSE_FIELD_NUMBER: _ClassVar[int]
    VERSION_FIELD_NUMBER: _ClassVar[int]
    COPYRIGHT_FIELD_NUMBER: _ClassVar[int]
    maintainer: str
    email: str
    license: str
    version: str
    copyright: str
    def __init__(self, maintainer: _Optional[str] = ..., email: _Optional[str] = ..., license: _Optional[str] = ..., version: _Optional[str] = ..., copyright: _Optional[str] = ...) -> None: ...

class SupervisedController(_message.Message):
    __slots__ = ("package", "executable", "launch_file")
    PACKAGE_FIELD_NUMBER: _ClassVar[int]
    EXECUTABLE_FIELD_NUMBER: _ClassVar[int]
    LAUNCH_FILE_FIELD_NUMBER: _ClassVar[int]
    package: str
    executable: str
    launch_file: str
    def __init__(self, package: _Optional[str] = ..., executable: _Optional[str] = ..., launch_file: _Optional[str] = ...) -> None: ...

class GenerateResponse(_message.Message):
    __slots__ = ("progress", "result", "chunk")
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    RESULT_FIELD_NUMBER: _ClassVar[int]
    CHUNK_FIELD_NUMBER: _ClassVar[int]
    progress: Progress
    result: GenerationResult
    chunk: FileChunk
    def __init__(self, progress: _Optional[_Union[Progress, _Mapping]] = ..., result: _Optional[_Union[GenerationResult, _Mapping]] = ..., chunk: _Optional[_Union[FileChunk, _Mapping]] = ...) -> None: ...

class GenerationResult(_message.Message):
    __slots__ = ("status", "diagnostics", "reason", "files", "explanation", "digest", "goals")
    STATUS_FIELD_NUMBER: _ClassVar[int]
    DIAGNOSTICS_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    FILES_FIELD_NUMBER: _ClassVar[int]
    EXPLANATION_FIELD_NUMBER: _ClassVar[int]
    DIGEST_FIELD_NUMBER: _ClassVar[int]
    GOALS_FIELD_NUMBER: _ClassVar[int]
    status: SynthesisStatus
    diagnostics: _containers.RepeatedCompositeFieldContainer[Diagnostic]
    reason: str
    files: _containers.RepeatedCompositeFieldContainer[GeneratedFile]
    explanation: str
    digest: bytes
    goals: GoalExplanation
    def __init__(self, status: _Optional[_Union[SynthesisStatus, str]] = ..., diagnostics: _Optional[_Iterable[_Union[Diagnostic, _Mapping]]] = ..., reason: _Optional[str] = ..., files: _Optional[_Iterable[_Union[GeneratedFile, _Mapping]]] = ..., explanation: _Optional[str] = ..., digest: _Optional[bytes] = ..., goals: _Optional[_Union[GoalExplanation, _Mapping]] = ...) -> None: ...

class GeneratedFile(_message.Message):
    __slots__ = ("path", "size", "digest", "executable")
    PATH_FIELD_NUMBER: _ClassVar[int]
    SIZE_FIELD_NUMBER: _ClassVar[int]
    DIGEST_FIELD_NUMBER: _ClassVar[int]
    EXECUTABLE_FIELD_NUMBER: _ClassVar[int]
    path: str
    size: int
    digest: bytes
    executable: bool
    def __init__(self, path: _Optional[str] = ..., size: _Optional[int] = ..., digest: _Optional[bytes] = ..., executable: _Optional[bool] = ...) -> None: ...

class FileChunk(_message.Message):
    __slots__ = ("file", "offset", "data")
    FILE_FIELD_NUMBER: _ClassVar[int]
    OFFSET_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    file: int
    offset: int
    data: bytes
    def __init__(self, file: _Optional[int] = ..., offset: _Optional[int] = ..., data: _Optional[bytes] = ...) -> None: ...

class ExploreRequest(_message.Message):
    __slots__ = ("bundle", "options", "maximum_states")
    BUNDLE_FIELD_NUMBER: _ClassVar[int]
    OPTIONS_FIELD_NUMBER: _ClassVar[int]
    MAXIMUM_STATES_FIELD_NUMBER: _ClassVar[int]
    bundle: Bundle
    options: SynthesisOptions
    maximum_states: int
    def __init__(self, bundle: _Optional[_Union[Bundle, _Mapping]] = ..., options: _Optional[_Union[SynthesisOptions, _Mapping]] = ..., maximum_states: _Optional[int] = ...) -> None: ...

class ExploreResponse(_message.Message):
    __slots__ = ("progress", "result", "chunk")
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    RESULT_FIELD_NUMBER: _ClassVar[int]
    CHUNK_FIELD_NUMBER: _ClassVar[int]
    progress: Progress
    result: ExplorationResult
    chunk: bytes
    def __init__(self, progress: _Optional[_Union[Progress, _Mapping]] = ..., result: _Optional[_Union[ExplorationResult, _Mapping]] = ..., chunk: _Optional[bytes] = ...) -> None: ...

class ExplorationResult(_message.Message):
    __slots__ = ("status", "diagnostics", "reason", "explanation", "states", "transitions", "size", "digest", "goals")
    STATUS_FIELD_NUMBER: _ClassVar[int]
    DIAGNOSTICS_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    EXPLANATION_FIELD_NUMBER: _ClassVar[int]
    STATES_FIELD_NUMBER: _ClassVar[int]
    TRANSITIONS_FIELD_NUMBER: _ClassVar[int]
    SIZE_FIELD_NUMBER: _ClassVar[int]
    DIGEST_FIELD_NUMBER: _ClassVar[int]
    GOALS_FIELD_NUMBER: _ClassVar[int]
    status: SynthesisStatus
    diagnostics: _containers.RepeatedCompositeFieldContainer[Diagnostic]
    reason: str
    explanation: str
    states: int
    transitions: int
    size: int
    digest: bytes
    goals: GoalExplanation
    def __init__(self, status: _Optional[_Union[SynthesisStatus, str]] = ..., diagnostics: _Optional[_Iterable[_Union[Diagnostic, _Mapping]]] = ..., reason: _Optional[str] = ..., explanation: _Optional[str] = ..., states: _Optional[int] = ..., transitions: _Optional[int] = ..., size: _Optional[int] = ..., digest: _Optional[bytes] = ..., goals: _Optional[_Union[GoalExplanation, _Mapping]] = ...) -> None: ...

class VerifyRequest(_message.Message):
    __slots__ = ("bundle", "options", "supervisor", "properties", "property_files", "maximum_states", "strict", "controller", "as_is")
    BUNDLE_FIELD_NUMBER: _ClassVar[int]
    OPTIONS_FIELD_NUMBER: _ClassVar[int]
    SUPERVISOR_FIELD_NUMBER: _ClassVar[int]
    PROPERTIES_FIELD_NUMBER: _ClassVar[int]
    PROPERTY_FILES_FIELD_NUMBER: _ClassVar[int]
    MAXIMUM_STATES_FIELD_NUMBER: _ClassVar[int]
    STRICT_FIELD_NUMBER: _ClassVar[int]
    CONTROLLER_FIELD_NUMBER: _ClassVar[int]
    AS_IS_FIELD_NUMBER: _ClassVar[int]
    bundle: Bundle
    options: SynthesisOptions
    supervisor: bytes
    properties: _containers.RepeatedScalarFieldContainer[str]
    property_files: _containers.RepeatedCompositeFieldContainer[SourceFile]
    maximum_states: int
    strict: bool
    controller: bool
    as_is: bool
    def __init__(self, bundle: _Optional[_Union[Bundle, _Mapping]] = ..., options: _Optional[_Union[SynthesisOptions, _Mapping]] = ..., supervisor: _Optional[bytes] = ..., properties: _Optional[_Iterable[str]] = ..., property_files: _Optional[_Iterable[_Union[SourceFile, _Mapping]]] = ..., maximum_states: _Optional[int] = ..., strict: _Optional[bool] = ..., controller: _Optional[bool] = ..., as_is: _Optional[bool] = ...) -> None: ...

class VerifyResponse(_message.Message):
    __slots__ = ("progress", "result")
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    RESULT_FIELD_NUMBER: _ClassVar[int]
    progress: Progress
    result: VerificationResult
    def __init__(self, progress: _Optional[_Union[Progress, _Mapping]] = ..., result: _Optional[_Union[VerificationResult, _Mapping]] = ...) -> None: ...

class VerificationResult(_message.Message):
    __slots__ = ("status", "diagnostics", "reason", "report")
    STATUS_FIELD_NUMBER: _ClassVar[int]
    DIAGNOSTICS_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    REPORT_FIELD_NUMBER: _ClassVar[int]
    status: VerificationStatus
    diagnostics: _containers.RepeatedCompositeFieldContainer[Diagnostic]
    reason: str
    report: str
    def __init__(self, status: _Optional[_Union[VerificationStatus, str]] = ..., diagnostics: _Optional[_Iterable[_Union[Diagnostic, _Mapping]]] = ..., reason: _Optional[str] = ..., report: _Optional[str] = ...) -> None: ...

class ExplainRequest(_message.Message):
    __slots__ = ("bundle", "options", "event", "state", "after", "modular")
    BUNDLE_FIELD_NUMBER: _ClassVar[int]
    OPTIONS_FIELD_NUMBER: _ClassVar[int]
    EVENT_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    AFTER_FIELD_NUMBER: _ClassVar[int]
    MODULAR_FIELD_NUMBER: _ClassVar[int]
    bundle: Bundle
    options: SynthesisOptions
    event: str
    state: str
    after: str
    modular: bool
    def __init__(self, bundle: _Optional[_Union[Bundle, _Mapping]] = ..., options: _Optional[_Union[SynthesisOptions, _Mapping]] = ..., event: _Optional[str] = ..., state: _Optional[str] = ..., after: _Optional[str] = ..., modular: _Optional[bool] = ...) -> None: ...

class ExplainResponse(_message.Message):
    __slots__ = ("progress", "result")
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    RESULT_FIELD_NUMBER: _ClassVar[int]
    progress: Progress
    result: ExplanationResult
    def __init__(self, progress: _Optional[_Union[Progress, _Mapping]] = ..., result: _Optional[_Union[ExplanationResult, _Mapping]] = ...) -> None: ...

class ExplanationResult(_message.Message):
    __slots__ = ("status", "diagnostics", "reason", "explanation", "goals")
    STATUS_FIELD_NUMBER: _ClassVar[int]
    DIAGNOSTICS_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    EXPLANATION_FIELD_NUMBER: _ClassVar[int]
    GOALS_FIELD_NUMBER: _ClassVar[int]
    status: ExplanationStatus
    diagnostics: _containers.RepeatedCompositeFieldContainer[Diagnostic]
    reason: str
    explanation: str
    goals: GoalExplanation
    def __init__(self, status: _Optional[_Union[ExplanationStatus, str]] = ..., diagnostics: _Optional[_Iterable[_Union[Diagnostic, _Mapping]]] = ..., reason: _Optional[str] = ..., explanation: _Optional[str] = ..., goals: _Optional[_Union[GoalExplanation, _Mapping]] = ...) -> None: ...

class FormatRequest(_message.Message):
    __slots__ = ("file",)
    FILE_FIELD_NUMBER: _ClassVar[int]
    file: SourceFile
    def __init__(self, file: _Optional[_Union[SourceFile, _Mapping]] = ...) -> None: ...

class FormatResponse(_message.Message):
    __slots__ = ("text", "diagnostics")
    TEXT_FIELD_NUMBER: _ClassVar[int]
    DIAGNOSTICS_FIELD_NUMBER: _ClassVar[int]
    text: str
    diagnostics: _containers.RepeatedCompositeFieldContainer[Diagnostic]
    def __init__(self, text: _Optional[str] = ..., diagnostics: _Optional[_Iterable[_Union[Diagnostic, _Mapping]]] = ...) -> None: ...

class ListTargetsRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class ListTargetsResponse(_message.Message):
    __slots__ = ("targets",)
    TARGETS_FIELD_NUMBER: _ClassVar[int]
    targets: _containers.RepeatedCompositeFieldContainer[Target]
    def __init__(self, targets: _Optional[_Iterable[_Union[Target, _Mapping]]] = ...) -> None: ...

class Target(_message.Message):
    __slots__ = ("name", "description")
    NAME_FIELD_NUMBER: _ClassVar[int]
    DESCRIPTION_FIELD_NUMBER: _ClassVar[int]
    name: str
    description: str
    def __init__(self, name: _Optional[str] = ..., description: _Optional[str] = ...) -> None: ...

class GetVersionRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class GetVersionResponse(_message.Message):
    __slots__ = ("version", "engines", "limits")
    VERSION_FIELD_NUMBER: _ClassVar[int]
    ENGINES_FIELD_NUMBER: _ClassVar[int]
    LIMITS_FIELD_NUMBER: _ClassVar[int]
    version: str
    engines: _containers.RepeatedScalarFieldContainer[str]
    limits: ServerLimits
    def __init__(self, version: _Optional[str] = ..., engines: _Optional[_Iterable[str]] = ..., limits: _Optional[_Union[ServerLimits, _Mapping]] = ...) -> None: ...

class ServerLimits(_message.Message):
    __slots__ = ("bundle_bytes", "bundle_files", "task_seconds", "task_cpu_seconds", "task_memory_bytes", "task_nodes", "result_bytes", "waiting_tasks", "waiting_tasks_per_caller", "retention_seconds")
    BUNDLE_BYTES_FIELD_NUMBER: _ClassVar[int]
    BUNDLE_FILES_FIELD_NUMBER: _ClassVar[int]
    TASK_SECONDS_FIELD_NUMBER: _ClassVar[int]
    TASK_CPU_SECONDS_FIELD_NUMBER: _ClassVar[int]
    TASK_MEMORY_BYTES_FIELD_NUMBER: _ClassVar[int]
    TASK_NODES_FIELD_NUMBER: _ClassVar[int]
    RESULT_BYTES_FIELD_NUMBER: _ClassVar[int]
    WAITING_TASKS_FIELD_NUMBER: _ClassVar[int]
    WAITING_TASKS_PER_CALLER_FIELD_NUMBER: _ClassVar[int]
    RETENTION_SECONDS_FIELD_NUMBER: _ClassVar[int]
    bundle_bytes: int
    bundle_files: int
    task_seconds: float
    task_cpu_seconds: float
    task_memory_bytes: int
    task_nodes: int
    result_bytes: int
    waiting_tasks: int
    waiting_tasks_per_caller: int
    retention_seconds: float
    def __init__(self, bundle_bytes: _Optional[int] = ..., bundle_files: _Optional[int] = ..., task_seconds: _Optional[float] = ..., task_cpu_seconds: _Optional[float] = ..., task_memory_bytes: _Optional[int] = ..., task_nodes: _Optional[int] = ..., result_bytes: _Optional[int] = ..., waiting_tasks: _Optional[int] = ..., waiting_tasks_per_caller: _Optional[int] = ..., retention_seconds: _Optional[float] = ...) -> None: ...
