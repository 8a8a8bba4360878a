"""The rules of the usual linter for protobuf interfaces: comments, names, and messages of each method's own."""

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from google.protobuf.descriptor_pb2 import DescriptorProto, FileDescriptorProto, FileDescriptorSet

from support.interfaces import PROTO, compiled, enums, messages, our_files

CAMEL = re.compile(r"([A-Z][a-z0-9]*)+")
SNAKE = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
METHODS = {
    "BridgeService": ["GetDefinition", "GetStatus", "Stop", "Command", "Watch", "Attach"],
    "JobService": ["SubmitJob", "GetJob", "WatchJob", "CancelJob", "ListJobs", "GetLoad", "GetJobResult"],
    "SynthesisService": [
        "Check", "Synthesize", "Generate", "Explore", "Verify", "Explain", "Format", "ListTargets",
        "GetVersion",
    ],
}  # fmt: skip

# Numbers of fields in protobuf's own descriptors, which lead from a file to what stands in it.
_MESSAGE, _ENUM, _SERVICE, _FIELD, _NESTED, _INNER_ENUM, _ONEOF, _VALUE, _METHOD = 4, 5, 6, 2, 3, 4, 8, 2, 2
_SYNTAX = 12


def named(file: FileDescriptorProto) -> Iterator[tuple[tuple[int, ...], str]]:
    """Yield the location in a file of everything that has a name, and the name."""
    for number, message in enumerate(file.message_type):
        yield from _named_in(message, (_MESSAGE, number), message.name)
    for number, enum in enumerate(file.enum_type):
        yield (_ENUM, number), enum.name
        yield from (((_ENUM, number, _VALUE, place), value.name) for place, value in enumerate(enum.value))
    for number, service in enumerate(file.service):
        yield (_SERVICE, number), service.name
        yield from (((_SERVICE, number, _METHOD, place), item.name) for place, item in enumerate(service.method))


def _named_in(message: DescriptorProto, path: tuple[int, ...], name: str) -> Iterator[tuple[tuple[int, ...], str]]:
    yield path, name
    for place, field in enumerate(message.field):
        yield (*path, _FIELD, place), f"{name}.{field.name}"
    for place, group in enumerate(written_oneofs(message)):
        yield (*path, _ONEOF, place), f"{name}.{group}"
    for place, enum in enumerate(message.enum_type):
        yield (*path, _INNER_ENUM, place), f"{name}.{enum.name}"
        for number, value in enumerate(enum.value):
            yield (*path, _INNER_ENUM, place, _VALUE, number), value.name
    for place, inner in enumerate(message.nested_type):
        if not inner.options.map_entry:
            yield from _named_in(inner, (*path, _NESTED, place), f"{name}.{inner.name}")


def written_oneofs(message: DescriptorProto) -> list[str]:
    """Names of the oneofs of the source: the compiler adds one for each optional field, behind them."""
    made = {field.oneof_index for field in message.field if field.proto3_optional}
    return [group.name for place, group in enumerate(message.oneof_decl) if place not in made]


def undocumented(file: FileDescriptorProto) -> list[str]:
    """Names before which no comment stands that says something."""
    comments = {tuple(place.path): place.leading_comments.strip() for place in file.source_code_info.location}
    return [name for path, name in named(file) if not comments.get(path)]


def broken_names(file: FileDescriptorProto) -> list[str]:
    """Names that are not of the usual form."""
    found = [name for name, _ in messages(file) if not CAMEL.fullmatch(name.rsplit(".", 1)[1])]
    for name, message in messages(file):
        parts = [*(field.name for field in message.field), *written_oneofs(message)]
        found += [f"{name}.{part}" for part in parts if not SNAKE.fullmatch(part)]
    for name, enum in enums(file):
        short = name.rsplit(".", 1)[1]
        prefix = re.sub(r"(?<!^)([A-Z])", r"_\1", short).upper() + "_"
        if not CAMEL.fullmatch(short) or (enum.value[0].name, enum.value[0].number) != (f"{prefix}UNSPECIFIED", 0):
            found.append(name)
        found += [value.name for value in enum.value if not re.fullmatch(f"{prefix}[A-Z0-9_]+", value.name)]
    for service in file.service:
        found += [] if re.fullmatch(r"([A-Z][a-z]+)+Service", service.name) else [service.name]
        for method in service.method:
            pair = tuple(type_.rsplit(".", 1)[1] for type_ in (method.input_type, method.output_type))
            is_right = CAMEL.fullmatch(method.name) and pair == (f"{method.name}Request", f"{method.name}Response")
            found += [] if is_right else [f"{service.name}.{method.name}"]
    return found


@pytest.fixture(scope="module")
def today(tmp_path_factory: pytest.TempPathFactory) -> FileDescriptorSet:
    return compiled(PROTO, tmp_path_factory.mktemp("interfaces") / "today.binpb")


def of_text(folder: Path, text: str) -> FileDescriptorProto:
    """The descriptor of a file with a text."""
    (folder / "robosc_api").mkdir()
    (folder / "robosc_api" / "x.proto").write_text(f'syntax = "proto3";\npackage robosc_api;\n{text}')
    return our_files(compiled(folder, folder / "set.binpb"))[0]


def test_everything_is_documented(today: FileDescriptorSet) -> None:
    files = our_files(today)
    assert sum(len(list(named(file))) for file in files) > 300
    assert [name for file in files for name in undocumented(file)] == []
    # The file itself says what it is for.
    for file in files:
        places = {tuple(place.path): place for place in file.source_code_info.location}
        assert places[(_SYNTAX,)].leading_comments.strip(), file.name


def test_names_follow_the_rules(today: FileDescriptorSet) -> None:
    assert [name for file in our_files(today) for name in broken_names(file)] == []


def test_packages_are_folders(today: FileDescriptorSet) -> None:
    for file in our_files(today):
        assert Path(file.name).parent.as_posix() == file.package.replace(".", "/")
        assert SNAKE.fullmatch(Path(file.name).stem)
        assert re.fullmatch(r"robosc_api\.v\d+", file.package)


def test_services_have_the_methods_that_the_docs_promise(today: FileDescriptorSet) -> None:
    services = {service.name: service for file in our_files(today) for service in file.service}
    assert {name: [method.name for method in item.method] for name, item in services.items()} == METHODS
    methods = [method for service in services.values() for method in service.method]
    used = Counter(type_ for method in methods for type_ in (method.input_type, method.output_type))
    assert set(used.values()) == {1}, "a message belongs to one method alone"


def test_the_test_sees_what_has_no_comment(tmp_path: Path) -> None:
    text = """
        // Documented.
        message A {
          string plain = 1;
          // Documented.
          oneof which { string left = 2; }
          enum Inner { INNER_UNSPECIFIED = 0; }
          message Deep { int32 x = 1; }
        }
        //
        enum E { E_UNSPECIFIED = 0; }
        service AService { rpc Get(A) returns (A); }
    """
    assert undocumented(of_text(tmp_path, text)) == [
        "A.plain", "A.left", "A.Inner", "INNER_UNSPECIFIED", "A.Deep", "A.Deep.x", "E", "E_UNSPECIFIED", "AService",
        "Get",
    ]  # fmt: skip


def test_the_test_sees_names_that_are_out_of_order(tmp_path: Path) -> None:
    text = """
        message small { string camelCase = 1; }
        enum Colour { RED = 0; }
        enum Shape { SHAPE_ROUND = 0; }
        service Things { rpc Get(small) returns (small); }
    """
    assert broken_names(of_text(tmp_path, text)) == [
        "robosc_api.small", "robosc_api.small.camelCase", "robosc_api.Colour", "RED", "robosc_api.Shape", "Things",
        "Things.Get",
    ]  # fmt: skip
