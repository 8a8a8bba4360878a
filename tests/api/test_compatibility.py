"""Today's interfaces against those that were released, and whether the comparison sees what would break callers."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet

from support.interfaces import PROTO, RELEASED, breaks, compiled
from support.node import buf

SYNTHESIS, JOBS = "synthesis.proto", "jobs.proto"

# File, what is replaced (the first occurrence), by what, and the finding.
BREAKING = {
    "a field removed": (SYNTHESIS, "  string mend = 5;", "", r"Diagnostic, field 5: gone"),
    "a field reserved": (SYNTHESIS, "string mend = 5;", "reserved 5;", r"Diagnostic, field 5: gone"),
    "a field renumbered": (SYNTHESIS, "string mend = 5;", "string mend = 9;", r"Diagnostic, field 5: gone"),
    "a field renamed": (SYNTHESIS, "string mend = 5;", "string cure = 5;", r"field 5: .* mend .* became .* cure"),
    "a field retyped": (SYNTHESIS, "string mend = 5;", "bytes mend = 5;", r"field 5: .* string mend .* bytes mend"),
    "another message in a field": (
        SYNTHESIS, "  Location location = 4;", "  RelatedPlace location = 4;", r"field 4: .*Location.*RelatedPlace",
    ),
    "a field repeated": (SYNTHESIS, "string mend = 5;", "repeated string mend = 5;", r"field 5: optional .* repeated"),
    "a field with presence": (SYNTHESIS, "string mend = 5;", "optional string mend = 5;", r"mend .* in _mend"),
    "a field out of its oneof": (
        SYNTHESIS, "    SynthesisResult result = 2;\n  }", "  }\n  SynthesisResult result = 2;", r"result in event",
    ),
    "another name in JSON": (
        SYNTHESIS, "string mend = 5;", 'string mend = 5 [json_name = "cure"];', r"JSON: mend.*JSON: cure",
    ),
    "a value removed": (SYNTHESIS, "  SEVERITY_NOTE = 3;", "", r"Severity, value 3: gone"),
    "a value renumbered": (SYNTHESIS, "SEVERITY_NOTE = 3;", "SEVERITY_NOTE = 4;", r"Severity, value 3: gone"),
    "a value renamed": (SYNTHESIS, "SEVERITY_NOTE = 3;", "SEVERITY_HINT = 3;", r"SEVERITY_NOTE became SEVERITY_HINT"),
    "a method removed": (
        SYNTHESIS, "  rpc Format(FormatRequest) returns (FormatResponse);", "", r"Service, method Format: gone",
    ),
    "a method renamed": (SYNTHESIS, "rpc Format(", "rpc Layout(", r"SynthesisService, method Format: gone"),
    "a method that streams": (
        JOBS, "returns (GetJobResponse)", "returns (stream GetJobResponse)", r"-> \S+GetJobResponse became .*-> stream",
    ),
    "a method that takes something else": (
        JOBS, "rpc GetJob(GetJobRequest)", "rpc GetJob(CancelJobRequest)", r"GetJobRequest .* became .*CancelJob",
    ),
    "a service removed": (JOBS, r"(?s)service JobService \{.*?\n\}\n", "", r"service robosc_api.v1.JobService: gone"),
    "another package": (
        "bridge.proto", "package robosc_api.v1;", "package robosc_api.v2;", r"bridge.proto: robosc_api.v1 became",
    ),
}  # fmt: skip
HARMLESS = {
    "a field added": (SYNTHESIS, "string mend = 5;", "string mend = 5;\n  string more = 99;"),
    "a value added": (SYNTHESIS, "SEVERITY_NOTE = 3;", "SEVERITY_NOTE = 3;\n  SEVERITY_HINT = 4;"),
    "a method added": (JOBS, "rpc GetJob(", "rpc More(MoreRequest) returns (MoreResponse);\n  rpc GetJob("),
    "a comment": (SYNTHESIS, "// Severity of a finding.", "// How bad a finding is."),
    "fields in another order": (JOBS, "  Job job = 1;", "  // More.\n  reserved 77;\n  Job job = 1;"),
}
TWICE_CHECKED = (
    "a field reserved", "a field with presence", "a field out of its oneof", "another name in JSON",
    "a value renumbered", "a method that streams", "a field added", "fields in another order",
)  # fmt: skip
"""Another checker takes its time."""

MORE = "\nmessage MoreRequest {}\nmessage MoreResponse {}\n"


def changed(folder: Path, name: str, old: str, new: str) -> Path:
    """A copy of the interfaces with one change."""
    copy = folder / "proto"
    shutil.copytree(PROTO / "robosc_api", copy / "robosc_api", ignore=shutil.ignore_patterns("*.py*", "__pycache__"))
    file = copy / "robosc_api" / "v1" / name
    text = file.read_text()
    pattern = old if old.startswith("(?s)") else re.escape(old)
    assert re.search(pattern, text), old
    file.write_text(re.sub(pattern, lambda _: new, text, count=1) + MORE)
    return copy


@pytest.fixture(scope="module")
def today(tmp_path_factory: pytest.TempPathFactory) -> FileDescriptorSet:
    return compiled(PROTO, tmp_path_factory.mktemp("today") / "set.binpb")


@pytest.fixture(scope="module")
def released() -> FileDescriptorSet:
    return FileDescriptorSet.FromString(RELEASED.read_bytes())


def test_who_calls_the_released_interfaces_is_still_served(
    today: FileDescriptorSet, released: FileDescriptorSet
) -> None:
    assert breaks(released, today) == [], "incompatible with what was released: see docs/api.md, 'Compatibility'"
    assert len(released.file) >= 5


def test_the_released_set_is_made_by_its_script(tmp_path: Path) -> None:
    target = tmp_path / "set.binpb"
    subprocess.run([PROTO / "release.sh", target], check=True, env={"PYTHON": sys.executable, "PATH": "/usr/bin:/bin"})
    assert breaks(FileDescriptorSet.FromString(target.read_bytes()), compiled(PROTO, tmp_path / "again.binpb")) == []


def test_what_was_reserved_stays_so(today: FileDescriptorSet, tmp_path: Path) -> None:
    copy = changed(tmp_path, SYNTHESIS, "string mend = 5;", "string mend = 5;\n  reserved 70 to 79, 90;")
    before = compiled(copy, tmp_path / "set.binpb")
    assert breaks(before, today)[:2] == [
        "robosc_api.v1.Diagnostic, reserved 70 to 79: gone",
        "robosc_api.v1.Diagnostic, reserved 90 to 90: gone",
    ]


def verdict_of_buf(folder: Path, against: FileDescriptorSet) -> tuple[bool, str]:
    """Return True if buf, another checker of interfaces, finds something that breaks callers, and its output."""
    before = folder / "before.binpb"
    before.write_bytes(against.SerializeToString())
    shutil.copy(PROTO / "buf.yaml", folder / "proto")
    ran = subprocess.run(
        [buf(), "breaking", "proto", "--against", before], cwd=folder, capture_output=True, text=True, timeout=120
    )
    assert ran.returncode in (0, 100), ran.stderr
    return ran.returncode == 100, ran.stdout


@pytest.mark.parametrize("case", BREAKING)
def test_what_breaks_callers_is_found(today: FileDescriptorSet, tmp_path: Path, case: str) -> None:
    name, old, new, finding = BREAKING[case]
    found = breaks(today, compiled(changed(tmp_path, name, old, new), tmp_path / "set.binpb"))
    assert any(re.search(finding, line) for line in found), found


@pytest.mark.parametrize("case", HARMLESS)
def test_what_is_new_breaks_nobody(today: FileDescriptorSet, tmp_path: Path, case: str) -> None:
    assert breaks(today, compiled(changed(tmp_path, *HARMLESS[case]), tmp_path / "set.binpb")) == []


@pytest.mark.parametrize("case", TWICE_CHECKED)
def test_another_checker_is_of_the_same_mind(today: FileDescriptorSet, tmp_path: Path, case: str) -> None:
    name, old, new, *_ = BREAKING[case] if case in BREAKING else HARMLESS[case]
    changed(tmp_path, name, old, new)
    is_broken, words = verdict_of_buf(tmp_path, today)
    assert is_broken == (case in BREAKING), words


def test_buf_finds_nothing_to_complain_of(released: FileDescriptorSet, tmp_path: Path) -> None:
    ran = subprocess.run([buf(), "lint", PROTO], capture_output=True, text=True, timeout=120)
    assert (ran.returncode, ran.stdout) == (0, "")
    ran = subprocess.run([buf(), "format", "--diff", "--exit-code", PROTO], capture_output=True, text=True, timeout=120)
    assert (ran.returncode, ran.stdout) == (0, "")
    shutil.copytree(PROTO / "robosc_api", tmp_path / "proto" / "robosc_api")
    assert verdict_of_buf(tmp_path, released) == (False, "")
