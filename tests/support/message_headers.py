"""The C++ headers of a package of messages, made from its definitions by the generator that a build of ROS 2 runs."""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from robosc.targets import GeneratedFiles

_TEMPLATES = Path(sys.prefix) / "share" / "rosidl_generator_cpp" / "resource"
_GENERATOR = Path(sys.prefix) / "lib" / "rosidl_generator_cpp" / "rosidl_generator_cpp"
_VISIBILITY = "rosidl_generator_cpp__visibility_control.hpp"


def missing_generator() -> str | None:
    """Name the parts missing to make such headers, as a reason to skip."""
    lacking = [name for name in ("rosidl_adapter", "rosidl_generator_cpp") if find_spec(name) is None]
    return f"not installed: {', '.join(lacking)}" if lacking else None


def write_headers(package: str, files: GeneratedFiles, folder: Path) -> None:
    """Write the headers of a package's messages below a folder, which is then one to include from.

    Args:
        package: Name of the package.
        files: Its files: definitions are those whose path is `msg/NAME.msg`.
        folder: Folder of the headers.
    """
    source, output = folder / "definitions", folder / package
    definitions = sorted(path for path in files if path.endswith(".msg"))
    for path in definitions:
        (source / path).parent.mkdir(parents=True, exist_ok=True)
        (source / path).write_text(files[path], encoding="utf-8")
    adapted, arguments = folder / "adapted.txt", folder / "arguments.json"
    arguments.write_text(json.dumps({"non_idl_tuples": [f"{source}:{path}" for path in definitions]}), encoding="utf-8")
    named = ("--package-name", package, "--arguments-file", str(arguments))
    _run("-m", "rosidl_adapter", *named, "--output-dir", str(source), "--output-file", str(adapted))
    described = {
        "package_name": package,
        "output_dir": str(output),
        "template_dir": str(_TEMPLATES),
        "idl_tuples": adapted.read_text(encoding="utf-8").splitlines(),
        "target_dependencies": [],
        "type_description_tuples": [],
    }
    arguments.write_text(json.dumps(described), encoding="utf-8")
    _run(str(_GENERATOR), "--generator-arguments-file", str(arguments))
    # CMake writes this one.
    control = (_TEMPLATES / f"{_VISIBILITY}.in").read_text(encoding="utf-8")
    control = control.replace("@PROJECT_NAME@", package).replace("@PROJECT_NAME_UPPER@", package.upper())
    (output / "msg" / _VISIBILITY).write_text(control, encoding="utf-8")


def _run(*words: str) -> None:
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
