import os
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from robosc_api.v1 import bridge_pb2, synthesis_pb2

PROTO = Path(__file__).parents[2] / "proto"
FOLDER = PROTO / "robosc_api" / "v1"
INTERFACES = {"bridge": bridge_pb2.DESCRIPTOR, "synthesis": synthesis_pb2.DESCRIPTOR}
METHODS = {
    "BridgeService": ["GetDefinition", "GetStatus", "Stop", "Command", "Watch", "Attach"],
    "SynthesisService": ["Check", "Synthesize", "Generate"],
}
SERVICES = [service for interface in INTERFACES.values() for service in interface.services_by_name.values()]


def test_committed_bindings_are_what_the_generator_makes(tmp_path: Path) -> None:
    subprocess.run([PROTO / "generate.sh", tmp_path], check=True, env={**os.environ, "PYTHON": sys.executable})
    made = sorted((tmp_path / "robosc_api" / "v1").iterdir())
    ends = ("_pb2.py", "_pb2.pyi", "_pb2_grpc.py")
    assert [file.name for file in made] == [f"{name}{end}" for name in INTERFACES for end in ends]
    for file in made:
        assert file.read_text() == (FOLDER / file.name).read_text(), file.name


@pytest.mark.parametrize("name", INTERFACES)
def test_everything_in_the_interface_is_documented(name: str) -> None:
    lines = (FOLDER / f"{name}.proto").read_text().splitlines()
    defined = re.compile(r"\s*(message|enum|service|rpc|oneof|(repeated |optional )?[\w.]+ \w+ =|map<.*=|[A-Z_]+ =)")
    undocumented = [
        line.strip()
        for before, line in pairwise(lines)
        if defined.match(line) and not line.startswith(("syntax", "//")) and not before.strip().startswith("//")
    ]
    assert sum(bool(defined.match(line)) for line in lines) > 80
    assert undocumented == []


@pytest.mark.parametrize("name", INTERFACES)
def test_names_follow_the_rules(name: str) -> None:
    """The basic rules of the usual linter for protobuf interfaces."""
    for message in INTERFACES[name].message_types_by_name.values():
        assert re.fullmatch(r"([A-Z][a-z]+)+", message.name)
        for field in message.fields:
            assert re.fullmatch(r"[a-z]+(_[a-z]+)*", field.name)
    for enum in INTERFACES[name].enum_types_by_name.values():
        prefix = re.sub(r"(?<!^)([A-Z])", r"_\1", enum.name).upper() + "_"
        assert enum.values[0].name == prefix + "UNSPECIFIED"
        assert enum.values[0].number == 0
        assert all(value.name.startswith(prefix) for value in enum.values)


@pytest.mark.parametrize("service", SERVICES, ids=lambda service: service.name)
def test_each_rpc_has_messages_of_its_own(service: Any) -> None:
    assert service.name.endswith("Service")
    assert [method.name for method in service.methods] == METHODS[service.name]
    for method in service.methods:
        assert method.input_type.name == f"{method.name}Request"
        assert method.output_type.name == f"{method.name}Response"
