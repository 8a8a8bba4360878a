"""The .proto files as descriptors, and whether a later version of them still serves callers of an earlier one."""

from collections.abc import Iterator
from pathlib import Path

import grpc_tools  # type: ignore[import-untyped]
from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    EnumDescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from grpc_tools import protoc

PROTO = Path(__file__).parents[2] / "proto"
RELEASED = PROTO / "released" / "robosc_api_v1.binpb"
OURS = "robosc_api/"

WELL_KNOWN = Path(grpc_tools.__file__).with_name("_proto")
"""Files of protobuf itself."""


def compiled(folder: Path, target: Path) -> FileDescriptorSet:
    """The descriptors of all .proto files below a folder, with their comments; also written to `target`."""
    names = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*.proto"))
    options = [f"-I{folder}", f"-I{WELL_KNOWN}", "--include_imports", "--include_source_info"]
    status = protoc.main(["protoc", *options, f"--descriptor_set_out={target}", *names])
    assert status == 0, "protoc has said why on standard error"
    return FileDescriptorSet.FromString(target.read_bytes())


def our_files(found: FileDescriptorSet) -> list[FileDescriptorProto]:
    """The files that are ours, not protobuf's own."""
    return [file for file in found.file if file.name.startswith(OURS)]


def messages(file: FileDescriptorProto) -> Iterator[tuple[str, DescriptorProto]]:
    """Every message of a file by its full name, inner ones too; the entries of maps are such messages."""
    waiting = [(f"{file.package}.{message.name}", message) for message in file.message_type]
    while waiting:
        name, message = waiting.pop(0)
        yield name, message
        waiting += [(f"{name}.{inner.name}", inner) for inner in message.nested_type]


def enums(file: FileDescriptorProto) -> Iterator[tuple[str, EnumDescriptorProto]]:
    """Every enum of a file by its full name, inner ones too."""
    yield from ((f"{file.package}.{enum.name}", enum) for enum in file.enum_type)
    for name, message in messages(file):
        yield from ((f"{name}.{enum.name}", enum) for enum in message.enum_type)


def breaks(before: FileDescriptorSet, after: FileDescriptorSet) -> list[str]:
    """List changes that break callers of an earlier version in a later one, a line each; additions break nothing.

    Bytes on the wire, JSON and the names in generated code count, so that nothing may go, and nothing may be called
    or typed otherwise.
    """
    old, new = _facts(before), _facts(after)
    gone = [f"{what}: gone" for what in old if what not in new]
    changed = [f"{what}: {old[what]} became {new[what]}" for what in old if what in new and old[what] != new[what]]
    return gone + changed


def _facts(found: FileDescriptorSet) -> dict[str, str]:
    """All that callers depend on: what there is, and what is true of it."""
    facts: dict[str, str] = {}
    for file in our_files(found):
        facts[f"file {file.name}"] = file.package
        for name, message in messages(file):
            facts[f"message {name}"] = file.name
            facts |= {f"{name}, field {field.number}": _field(field, message) for field in message.field}
            kept = [*(f"{span.start} to {span.end - 1}" for span in message.reserved_range), *message.reserved_name]
            facts |= {f"{name}, reserved {item}": "" for item in kept}
        for name, enum in enums(file):
            facts[f"enum {name}"] = file.name
            facts |= {f"{name}, value {value.number}": value.name for value in enum.value}
        for service in file.service:
            name = f"{file.package}.{service.name}"
            facts[f"service {name}"] = file.name
            for method in service.method:
                given, answered = (
                    f"{'stream ' * is_stream}{type_.lstrip('.')}"
                    for type_, is_stream in (
                        (method.input_type, method.client_streaming),
                        (method.output_type, method.server_streaming),
                    )
                )
                facts[f"{name}, method {method.name}"] = f"{given} -> {answered}"
    return facts


def _field(field: FieldDescriptorProto, message: DescriptorProto) -> str:
    kind = FieldDescriptorProto.Type.Name(field.type).removeprefix("TYPE_").lower()
    label = FieldDescriptorProto.Label.Name(field.label).removeprefix("LABEL_").lower()
    group = f" in {message.oneof_decl[field.oneof_index].name}" if field.HasField("oneof_index") else ""
    type_ = field.type_name.lstrip(".") or kind
    return f"{label} {type_} {field.name}{group} (JSON: {field.json_name})"
