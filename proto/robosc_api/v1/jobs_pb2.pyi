import datetime

from google.protobuf import duration_pb2 as _duration_pb2
from google.protobuf import timestamp_pb2 as _timestamp_pb2
from robosc_api.v1 import synthesis_pb2 as _synthesis_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class JobState(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    JOB_STATE_UNSPECIFIED: _ClassVar[JobState]
    JOB_STATE_QUEUED: _ClassVar[JobState]
    JOB_STATE_RUNNING: _ClassVar[JobState]
    JOB_STATE_SUCCEEDED: _ClassVar[JobState]
    JOB_STATE_FAILED: _ClassVar[JobState]
    JOB_STATE_CANCELLED: _ClassVar[JobState]

class TaskKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    TASK_KIND_UNSPECIFIED: _ClassVar[TaskKind]
    TASK_KIND_CHECK: _ClassVar[TaskKind]
    TASK_KIND_SYNTHESIZE: _ClassVar[TaskKind]
    TASK_KIND_GENERATE: _ClassVar[TaskKind]
    TASK_KIND_EXPLORE: _ClassVar[TaskKind]
    TASK_KIND_VERIFY: _ClassVar[TaskKind]
    TASK_KIND_FORMAT: _ClassVar[TaskKind]
    TASK_KIND_EXPLAIN: _ClassVar[TaskKind]
JOB_STATE_UNSPECIFIED: JobState
JOB_STATE_QUEUED: JobState
JOB_STATE_RUNNING: JobState
JOB_STATE_SUCCEEDED: JobState
JOB_STATE_FAILED: JobState
JOB_STATE_CANCELLED: JobState
TASK_KIND_UNSPECIFIED: TaskKind
TASK_KIND_CHECK: TaskKind
TASK_KIND_SYNTHESIZE: TaskKind
TASK_KIND_GENERATE: TaskKind
TASK_KIND_EXPLORE: TaskKind
TASK_KIND_VERIFY: TaskKind
TASK_KIND_FORMAT: TaskKind
TASK_KIND_EXPLAIN: TaskKind

class Task(_message.Message):
    __slots__ = ("check", "synthesize", "generate", "explore", "verify", "format", "explain")
    CHECK_FIELD_NUMBER: _ClassVar[int]
    SYNTHESIZE_FIELD_NUMBER: _ClassVar[int]
    GENERATE_FIELD_NUMBER: _ClassVar[int]
    EXPLORE_FIELD_NUMBER: _ClassVar[int]
    VERIFY_FIELD_NUMBER: _ClassVar[int]
    FORMAT_FIELD_NUMBER: _ClassVar[int]
    EXPLAIN_FIELD_NUMBER: _ClassVar[int]
    check: _synthesis_pb2.CheckRequest
    synthesize: _synthesis_pb2.SynthesizeRequest
    generate: _synthesis_pb2.GenerateRequest
    explore: _synthesis_pb2.ExploreRequest
    verify: _synthesis_pb2.VerifyRequest
    format: _synthesis_pb2.FormatRequest
    explain: _synthesis_pb2.ExplainRequest
    def __init__(self, check: _Optional[_Union[_synthesis_pb2.CheckRequest, _Mapping]] = ..., synthesize: _Optional[_Union[_synthesis_pb2.SynthesizeRequest, _Mapping]] = ..., generate: _Optional[_Union[_synthesis_pb2.GenerateRequest, _Mapping]] = ..., explore: _Optional[_Union[_synthesis_pb2.ExploreRequest, _Mapping]] = ..., verify: _Optional[_Union[_synthesis_pb2.VerifyRequest, _Mapping]] = ..., format: _Optional[_Union[_synthesis_pb2.FormatRequest, _Mapping]] = ..., explain: _Optional[_Union[_synthesis_pb2.ExplainRequest, _Mapping]] = ...) -> None: ...

class Failure(_message.Message):
    __slots__ = ("code", "reason", "message")
    CODE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    code: int
    reason: str
    message: str
    def __init__(self, code: _Optional[int] = ..., reason: _Optional[str] = ..., message: _Optional[str] = ...) -> None: ...

class Job(_message.Message):
    __slots__ = ("id", "owner", "kind", "state", "revision", "main_file", "label", "create_time", "start_time", "end_time", "expire_time", "attempts", "progress", "failure", "from_store", "waiting_before")
    ID_FIELD_NUMBER: _ClassVar[int]
    OWNER_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    REVISION_FIELD_NUMBER: _ClassVar[int]
    MAIN_FILE_FIELD_NUMBER: _ClassVar[int]
    LABEL_FIELD_NUMBER: _ClassVar[int]
    CREATE_TIME_FIELD_NUMBER: _ClassVar[int]
    START_TIME_FIELD_NUMBER: _ClassVar[int]
    END_TIME_FIELD_NUMBER: _ClassVar[int]
    EXPIRE_TIME_FIELD_NUMBER: _ClassVar[int]
    ATTEMPTS_FIELD_NUMBER: _ClassVar[int]
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    FAILURE_FIELD_NUMBER: _ClassVar[int]
    FROM_STORE_FIELD_NUMBER: _ClassVar[int]
    WAITING_BEFORE_FIELD_NUMBER: _ClassVar[int]
    id: str
    owner: str
    kind: TaskKind
    state: JobState
    revision: int
    main_file: str
    label: str
    create_time: _timestamp_pb2.Timestamp
    start_time: _timestamp_pb2.Timestamp
    end_time: _timestamp_pb2.Timestamp
    expire_time: _timestamp_pb2.Timestamp
    attempts: int
    progress: _synthesis_pb2.Progress
    failure: Failure
    from_store: bool
    waiting_before: int
    def __init__(self, id: _Optional[str] = ..., owner: _Optional[str] = ..., kind: _Optional[_Union[TaskKind, str]] = ..., state: _Optional[_Union[JobState, str]] = ..., revision: _Optional[int] = ..., main_file: _Optional[str] = ..., label: _Optional[str] = ..., create_time: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., start_time: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., end_time: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., expire_time: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., attempts: _Optional[int] = ..., progress: _Optional[_Union[_synthesis_pb2.Progress, _Mapping]] = ..., failure: _Optional[_Union[Failure, _Mapping]] = ..., from_store: _Optional[bool] = ..., waiting_before: _Optional[int] = ...) -> None: ...

class SubmitJobRequest(_message.Message):
    __slots__ = ("task", "idempotency_key", "label", "retention")
    TASK_FIELD_NUMBER: _ClassVar[int]
    IDEMPOTENCY_KEY_FIELD_NUMBER: _ClassVar[int]
    LABEL_FIELD_NUMBER: _ClassVar[int]
    RETENTION_FIELD_NUMBER: _ClassVar[int]
    task: Task
    idempotency_key: str
    label: str
    retention: _duration_pb2.Duration
    def __init__(self, task: _Optional[_Union[Task, _Mapping]] = ..., idempotency_key: _Optional[str] = ..., label: _Optional[str] = ..., retention: _Optional[_Union[datetime.timedelta, _duration_pb2.Duration, _Mapping]] = ...) -> None: ...

class SubmitJobResponse(_message.Message):
    __slots__ = ("job", "existed")
    JOB_FIELD_NUMBER: _ClassVar[int]
    EXISTED_FIELD_NUMBER: _ClassVar[int]
    job: Job
    existed: bool
    def __init__(self, job: _Optional[_Union[Job, _Mapping]] = ..., existed: _Optional[bool] = ...) -> None: ...

class GetJobRequest(_message.Message):
    __slots__ = ("id",)
    ID_FIELD_NUMBER: _ClassVar[int]
    id: str
    def __init__(self, id: _Optional[str] = ...) -> None: ...

class GetJobResponse(_message.Message):
    __slots__ = ("job",)
    JOB_FIELD_NUMBER: _ClassVar[int]
    job: Job
    def __init__(self, job: _Optional[_Union[Job, _Mapping]] = ...) -> None: ...

class WatchJobRequest(_message.Message):
    __slots__ = ("id", "after_revision")
    ID_FIELD_NUMBER: _ClassVar[int]
    AFTER_REVISION_FIELD_NUMBER: _ClassVar[int]
    id: str
    after_revision: int
    def __init__(self, id: _Optional[str] = ..., after_revision: _Optional[int] = ...) -> None: ...

class WatchJobResponse(_message.Message):
    __slots__ = ("job",)
    JOB_FIELD_NUMBER: _ClassVar[int]
    job: Job
    def __init__(self, job: _Optional[_Union[Job, _Mapping]] = ...) -> None: ...

class CancelJobRequest(_message.Message):
    __slots__ = ("id",)
    ID_FIELD_NUMBER: _ClassVar[int]
    id: str
    def __init__(self, id: _Optional[str] = ...) -> None: ...

class CancelJobResponse(_message.Message):
    __slots__ = ("job",)
    JOB_FIELD_NUMBER: _ClassVar[int]
    job: Job
    def __init__(self, job: _Optional[_Union[Job, _Mapping]] = ...) -> None: ...

class ListJobsRequest(_message.Message):
    __slots__ = ("page_size", "page_token", "states", "kind", "all_owners")
    PAGE_SIZE_FIELD_NUMBER: _ClassVar[int]
    PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    STATES_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    ALL_OWNERS_FIELD_NUMBER: _ClassVar[int]
    page_size: int
    page_token: str
    states: _containers.RepeatedScalarFieldContainer[JobState]
    kind: TaskKind
    all_owners: bool
    def __init__(self, page_size: _Optional[int] = ..., page_token: _Optional[str] = ..., states: _Optional[_Iterable[_Union[JobState, str]]] = ..., kind: _Optional[_Union[TaskKind, str]] = ..., all_owners: _Optional[bool] = ...) -> None: ...

class ListJobsResponse(_message.Message):
    __slots__ = ("jobs", "next_page_token")
    JOBS_FIELD_NUMBER: _ClassVar[int]
    NEXT_PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    jobs: _containers.RepeatedCompositeFieldContainer[Job]
    next_page_token: str
    def __init__(self, jobs: _Optional[_Iterable[_Union[Job, _Mapping]]] = ..., next_page_token: _Optional[str] = ...) -> None: ...

class GetLoadRequest(_message.Message):
    __slots__ = ("all_callers",)
    ALL_CALLERS_FIELD_NUMBER: _ClassVar[int]
    all_callers: bool
    def __init__(self, all_callers: _Optional[bool] = ...) -> None: ...

class CallerLoad(_message.Message):
    __slots__ = ("caller", "waiting_tasks", "running_tasks", "queued_jobs", "running_jobs", "ended_jobs", "first_queued_time")
    CALLER_FIELD_NUMBER: _ClassVar[int]
    WAITING_TASKS_FIELD_NUMBER: _ClassVar[int]
    RUNNING_TASKS_FIELD_NUMBER: _ClassVar[int]
    QUEUED_JOBS_FIELD_NUMBER: _ClassVar[int]
    RUNNING_JOBS_FIELD_NUMBER: _ClassVar[int]
    ENDED_JOBS_FIELD_NUMBER: _ClassVar[int]
    FIRST_QUEUED_TIME_FIELD_NUMBER: _ClassVar[int]
    caller: str
    waiting_tasks: int
    running_tasks: int
    queued_jobs: int
    running_jobs: int
    ended_jobs: int
    first_queued_time: _timestamp_pb2.Timestamp
    def __init__(self, caller: _Optional[str] = ..., waiting_tasks: _Optional[int] = ..., running_tasks: _Optional[int] = ..., queued_jobs: _Optional[int] = ..., running_jobs: _Optional[int] = ..., ended_jobs: _Optional[int] = ..., first_queued_time: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ...) -> None: ...

class GetLoadResponse(_message.Message):
    __slots__ = ("time", "callers", "workers", "running_tasks", "waiting_tasks", "servers")
    TIME_FIELD_NUMBER: _ClassVar[int]
    CALLERS_FIELD_NUMBER: _ClassVar[int]
    WORKERS_FIELD_NUMBER: _ClassVar[int]
    RUNNING_TASKS_FIELD_NUMBER: _ClassVar[int]
    WAITING_TASKS_FIELD_NUMBER: _ClassVar[int]
    SERVERS_FIELD_NUMBER: _ClassVar[int]
    time: _timestamp_pb2.Timestamp
    callers: _containers.RepeatedCompositeFieldContainer[CallerLoad]
    workers: int
    running_tasks: int
    waiting_tasks: int
    servers: int
    def __init__(self, time: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., callers: _Optional[_Iterable[_Union[CallerLoad, _Mapping]]] = ..., workers: _Optional[int] = ..., running_tasks: _Optional[int] = ..., waiting_tasks: _Optional[int] = ..., servers: _Optional[int] = ...) -> None: ...

class GetJobResultRequest(_message.Message):
    __slots__ = ("id",)
    ID_FIELD_NUMBER: _ClassVar[int]
    id: str
    def __init__(self, id: _Optional[str] = ...) -> None: ...

class GetJobResultResponse(_message.Message):
    __slots__ = ("check", "synthesize", "generate", "explore", "verify", "format", "explain")
    CHECK_FIELD_NUMBER: _ClassVar[int]
    SYNTHESIZE_FIELD_NUMBER: _ClassVar[int]
    GENERATE_FIELD_NUMBER: _ClassVar[int]
    EXPLORE_FIELD_NUMBER: _ClassVar[int]
    VERIFY_FIELD_NUMBER: _ClassVar[int]
    FORMAT_FIELD_NUMBER: _ClassVar[int]
    EXPLAIN_FIELD_NUMBER: _ClassVar[int]
    check: _synthesis_pb2.CheckResponse
    synthesize: _synthesis_pb2.SynthesizeResponse
    generate: _synthesis_pb2.GenerateResponse
    explore: _synthesis_pb2.ExploreResponse
    verify: _synthesis_pb2.VerifyResponse
    format: _synthesis_pb2.FormatResponse
    explain: _synthesis_pb2.ExplainResponse
    def __init__(self, check: _Optional[_Union[_synthesis_pb2.CheckResponse, _Mapping]] = ..., synthesize: _Optional[_Union[_synthesis_pb2.SynthesizeResponse, _Mapping]] = ..., generate: _Optional[_Union[_synthesis_pb2.GenerateResponse, _Mapping]] = ..., explore: _Optional[_Union[_synthesis_pb2.ExploreResponse, _Mapping]] = ..., verify: _Optional[_Union[_synthesis_pb2.VerifyResponse, _Mapping]] = ..., format: _Optional[_Union[_synthesis_pb2.FormatResponse, _Mapping]] = ..., explain: _Optional[_Union[_synthesis_pb2.ExplainResponse, _Mapping]] = ...) -> None: ...
