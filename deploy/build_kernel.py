"""Makes the kernel where there is a C compiler: a hook of hatchling for wheels and editable installations.

ROBOSC_KERNEL=0 makes a wheel for every system instead, without the kernel.
"""

import os
import shlex
import shutil
import subprocess
import sysconfig
import zlib
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FOLDER = Path("robosc/kernel")
MODULE = "_kernel.abi3.so"

_OPTIONS = ("-O2", "-std=c11", "-shared", "-fPIC")


class KernelHook(BuildHookInterface[Any]):
    """Hook that makes the kernel, and a wheel of this system with it."""

    PLUGIN_NAME = "custom"
    _temporary: TemporaryDirectory[str] | None = None

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Make the kernel before the files of a wheel are collected.

        Args:
            version: Kind of wheel: `standard` or `editable`.
            build_data: Description of the wheel, which changes where there is a kernel.
        """
        if os.environ.get("ROBOSC_KERNEL") == "0":
            return
        folder = Path(self.root, FOLDER)
        # A wheel leaves the folder as it is: an editable installation may work with the one that is there.
        module = folder / MODULE if version == "editable" else Path(self._made_in(), MODULE)
        problem = make_kernel(folder, module)
        if problem:
            self.app.display_warning(f"synthesis will do without its kernel, which is slower: {problem}")
        elif version == "standard":
            platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
            build_data["pure_python"] = False
            build_data["tag"] = f"cp312-abi3-{platform}"
            build_data["force_include"][str(module)] = str(FOLDER / MODULE)

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what was made for the wheel alone."""
        if self._temporary is not None:
            self._temporary.cleanup()

    def _made_in(self) -> str:
        self._temporary = TemporaryDirectory()
        return self._temporary.name


def make_kernel(folder: Path, module: Path) -> str:
    """Compile the kernel; return the problem if that cannot be done, else an empty text.

    Args:
        folder: Folder of its sources.
        module: Path of the module that is to come of it.
    """
    # The compiler that Python was made with may not be there, another one may.
    named = shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")
    compiler = next((found for name in (named[0], "cc", "gcc", "clang") if (found := shutil.which(name))), None)
    if compiler is None:
        return "there is no C compiler (Debian: apt install gcc libc6-dev)"
    include = include_folder()
    if not Path(include, "Python.h").exists():
        return f"{include} has no Python.h (Debian: apt install python3-dev)"
    checksum = 0
    for path in sorted(folder.glob("*.[ch]")):
        checksum = zlib.crc32(path.read_bytes(), checksum)
    sources = map(str, sorted(folder.glob("*.c")))
    # Named otherwise until it is whole: a process may be about to load it.
    unfinished = module.with_suffix(".unfinished")
    defined = f"-DSOURCE_CHECKSUM={checksum}u"
    command = [compiler, *_OPTIONS, defined, f"-I{include}", *sources, "-o", str(unfinished)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        said = done.stderr.strip().splitlines() or ["it gives no reason"]
        return f"{compiler} refuses it: {next((line for line in said if 'error' in line), said[0])}"
    unfinished.replace(module)
    return ""


def include_folder() -> str:
    """Return the folder of Python's headers."""
    return sysconfig.get_path("include")
