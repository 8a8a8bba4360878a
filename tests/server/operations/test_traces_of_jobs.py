"""A job, from its submission to the worker, as spans that are sent over gRPC to who takes them."""

import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import grpc
from opentelemetry.proto.collector.trace.v1 import trace_service_pb2, trace_service_pb2_grpc

from robosc_api.v1 import jobs_pb2, jobs_pb2_grpc
from support.job_workers import ScriptedWorkers, task_message
from support.service import served
from support.waiting import PATIENCE_S

MARKER = "a_word_of_the_model"


class Entered(ScriptedWorkers):
    async def __aenter__(self) -> "Entered":
        return self

    async def __aexit__(self, *_: object) -> None:
        pass


class Collector(trace_service_pb2_grpc.TraceServiceServicer):
    """Takes traces, as a collector would."""

    def __init__(self) -> None:
        self.spans: dict[str, Any] = {}
        self.text = ""
        self.changed = threading.Condition()

    def Export(self, request: Any, context: Any) -> Any:
        with self.changed:
            self.text += str(request)
            for part in request.resource_spans:
                for scope in part.scope_spans:
                    self.spans |= {span.name: span for span in scope.spans}
            self.changed.notify_all()
        return trace_service_pb2.ExportTraceServiceResponse()


def test_a_job_is_one_trace_from_its_submission_to_the_worker() -> None:
    collector = Collector()
    with ThreadPoolExecutor(2) as threads:
        takes = grpc.server(threads)
        trace_service_pb2_grpc.add_TraceServiceServicer_to_server(collector, takes)  # type: ignore[no-untyped-call]
        port = takes.add_insecure_port("127.0.0.1:0")
        takes.start()
        try:
            with (
                served(given_workers=Entered(), tracing_endpoint=f"http://127.0.0.1:{port}") as address,
                grpc.insecure_channel(address) as channel,
            ):
                jobs: Any = jobs_pb2_grpc.JobServiceStub(channel)  # type: ignore[no-untyped-call]
                request = jobs_pb2.SubmitJobRequest(task=task_message(MARKER), label=MARKER)
                job = jobs.SubmitJob(request, timeout=PATIENCE_S).job
                list(jobs.WatchJob(jobs_pb2.WatchJobRequest(id=job.id), timeout=PATIENCE_S))
            # A server that ends sends what is left.
            with collector.changed:
                assert collector.changed.wait_for(lambda: "job" in collector.spans, PATIENCE_S)
        finally:
            takes.stop(None).wait()
    submitted, carried, worked = (
        collector.spans[name] for name in ("robosc_api.v1.JobService/SubmitJob", "job", "worker run")
    )
    assert submitted.trace_id == carried.trace_id == worked.trace_id
    assert (carried.parent_span_id, worked.parent_span_id) == (submitted.span_id, carried.span_id)
    assert {item.key: item.value.string_value for item in carried.attributes}["job.id"] == job.id
    assert MARKER not in collector.text
