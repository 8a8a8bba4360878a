import os
import subprocess
import sys
from pathlib import Path

from support.interfaces import PROTO

FOLDER = PROTO / "robosc_api" / "v1"


def test_committed_bindings_are_what_the_generator_makes(tmp_path: Path) -> None:
    subprocess.run([PROTO / "generate.sh", tmp_path], check=True, env={**os.environ, "PYTHON": sys.executable})
    made = sorted((tmp_path / "robosc_api" / "v1").iterdir())
    ends = ("_pb2.py", "_pb2.pyi", "_pb2_grpc.py")
    names = sorted(path.stem for path in FOLDER.glob("*.proto"))
    assert [file.name for file in made] == [f"{name}{end}" for name in names for end in ends]
    for file in made:
        assert file.read_text() == (FOLDER / file.name).read_text(), file.name
