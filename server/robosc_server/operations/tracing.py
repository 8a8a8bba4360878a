"""Traces of calls, jobs and the runs of workers, with the extra `tracing` (OpenTelemetry).

Callers' traces are continued (W3C Trace Context). Nothing of a model stands in a span, nor do exceptions' messages.
"""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any

type Attributes = dict[str, str | int | float | bool]

_HEADERS = ("traceparent", "tracestate")


class TracingError(Exception):
    """Traces are configured, but cannot be made; one sentence for the operator."""


class Tracing:
    """Tracing that makes no spans.

    Attributes:
        is_on: True if it makes spans.
    """

    is_on = False

    def span(self, name: str, attributes: Attributes | None = None) -> AbstractContextManager[Any]:
        """Make a span of what happens inside the context, a child of the one around it.

        Args:
            name: Name of the span; few different ones.
            attributes: Attributes that are known at its beginning; nothing of a model.

        Returns:
            A context; what it yields takes `set_attribute(name, value)`.
        """
        return nullcontext(_NO_SPAN)

    def call_span(self, method: str, metadata: Any) -> AbstractContextManager[Any]:
        """Make a span of a call, a child of its caller's span.

        Args:
            method: `/package.Service/Method`.
            metadata: Metadata that the caller sent with it.
        """
        return nullcontext(_NO_SPAN)

    def close(self) -> None:
        """Send the remaining spans; waits for that, at most some seconds."""


class _NoSpan:
    def set_attribute(self, name: str, value: str | float) -> None:
        """Ignore the attribute."""


_NO_SPAN = _NoSpan()
NO_TRACING = Tracing()


def open_tracing(endpoint: str | None, version: str) -> Tracing:
    """Return a tracing that sends its spans. Start the workers first: its threads would be lost in a fork.

    Args:
        endpoint: `http://HOST:PORT` or `https://HOST:PORT` of an OTLP receiver over gRPC; None: no spans are made.
        version: Version of RoboSC.

    Raises:
        TracingError: OpenTelemetry is not installed.
    """
    if endpoint is None:
        return NO_TRACING
    try:
        from opentelemetry.exporter.otlp.proto.grpc.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ImportError as error:
        raise TracingError("traces need the extra `tracing`: pip install 'robosc[tracing]'") from error
    provider = TracerProvider(resource=Resource.create({"service.name": "robosc-server", "service.version": version}))
    exporter = OTLPSpanExporter(endpoint=endpoint, insecure=endpoint.startswith("http://"))
    provider.add_span_processor(BatchSpanProcessor(exporter))
    return OtlpTracing(provider)


class OtlpTracing(Tracing):
    """Tracing that sends spans by OTLP.

    Args:
        provider: An `opentelemetry.sdk.trace.TracerProvider`.
    """

    is_on = True

    def __init__(self, provider: Any) -> None:
        from opentelemetry.trace import SpanKind
        from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

        self._provider = provider
        self._tracer = provider.get_tracer("robosc_server")
        self._propagator = TraceContextTextMapPropagator()
        self._kinds = SpanKind

    def span(self, name: str, attributes: Attributes | None = None) -> AbstractContextManager[Any]:
        """Make a span of what happens inside the context."""
        return self._span(name, attributes, self._kinds.INTERNAL, None)

    def call_span(self, method: str, metadata: Any) -> AbstractContextManager[Any]:
        """Make a span of a call, a child of its caller's span."""
        carrier = {key: value for key, value in metadata or () if key in _HEADERS}
        service, _, name = method.strip("/").rpartition("/")
        attributes: Attributes = {"rpc.system": "grpc", "rpc.service": service, "rpc.method": name}
        return self._span(method.strip("/"), attributes, self._kinds.SERVER, self._propagator.extract(carrier))

    @contextmanager
    def _span(self, name: str, attributes: Attributes | None, kind: Any, parent: Any) -> Iterator[Any]:
        from opentelemetry.trace import Status, StatusCode

        # The exception itself is not recorded, as is usual: its message may quote a model.
        with self._tracer.start_as_current_span(
            name,
            context=parent,
            kind=kind,
            attributes=attributes,
            record_exception=False,
            set_status_on_exception=False,
        ) as span:
            try:
                yield span
            except BaseException as error:
                span.set_status(Status(StatusCode.ERROR))
                span.set_attribute("error.type", type(error).__qualname__)
                raise

    def close(self) -> None:
        """Send the remaining spans."""
        self._provider.shutdown()
