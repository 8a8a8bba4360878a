"""A client that knows nothing of a server but its address: what there is to call, and how, it learns by reflection."""

import json
from collections.abc import Iterator
from typing import Any

import grpc
from google.protobuf import json_format
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from grpc_reflection.v1alpha.proto_reflection_descriptor_database import ProtoReflectionDescriptorDatabase

PATIENCE_S = 60.0
"""Maximum duration of a call, in seconds."""


class ReflectionClient:
    """Calls methods by their names, with JSON for messages.

    Args:
        channel: To the server.
    """

    def __init__(self, channel: grpc.Channel) -> None:
        self._channel = channel
        self._database = ProtoReflectionDescriptorDatabase(channel)
        # A pool of its own: what this program has imported must not help.
        self._pool = DescriptorPool(self._database)

    def services(self) -> dict[str, list[str]]:
        """The methods of each service."""
        found = {}
        for name in self._database.get_services():
            found[name] = [method.name for method in self._pool.FindServiceByName(name).methods]
        return found

    def call(self, service: str, method: str, request: str) -> Iterator[dict[str, Any]]:
        """The answers of a method, with the names of the .proto file.

        Args:
            service: Full name of the service.
            method: Name of the method.
            request: The request as JSON.
        """
        described = self._pool.FindServiceByName(service).methods_by_name[method]
        request_type, response_type = GetMessageClass(described.input_type), GetMessageClass(described.output_type)
        multi_call: Any = self._channel.unary_stream if described.server_streaming else self._channel.unary_unary
        call = multi_call(
            f"/{service}/{method}",
            request_serializer=request_type.SerializeToString,
            response_deserializer=response_type.FromString,
        )
        message = json_format.Parse(request, request_type(), descriptor_pool=self._pool)
        answers = call(message, timeout=PATIENCE_S)
        for answer in answers if described.server_streaming else [answers]:
            yield json.loads(
                json_format.MessageToJson(answer, preserving_proto_field_name=True, descriptor_pool=self._pool)
            )
