"""libFAUDES as an opponent, in a process of its own: it prints for each folder whether it agrees.

A folder has `plant.gen`, `other.gen` and `requirement.gen`, and `supervisor.gen` where there is a supervisor.
"""

import sys
from pathlib import Path
from typing import Any

import faudes


def read(kind: Any, file: Path) -> Any:
    made = kind()
    made.Read(str(file))
    return made


def verdict(folder: Path) -> str:
    plant, other = (read(faudes.System, folder / name) for name in ("plant.gen", "other.gen"))
    requirement = read(faudes.Generator, folder / "requirement.gen")
    both, wanted, found = faudes.System(), faudes.Generator(), faudes.System()
    faudes.Parallel(plant, other, both)
    faudes.Parallel(both, requirement, wanted)
    faudes.SupCon(both, wanted, found)
    own = folder / "supervisor.gen"
    if found.Empty() or found.InitStatesEmpty():
        return "neither" if not own.exists() else "only ours"
    if not own.exists():
        return "only theirs"
    return "same" if faudes.LanguageEquality(found, read(faudes.System, own)) else "other"


for line in sys.stdin:
    sys.stdout.write(f"{verdict(Path(line.strip()))}\n")
    sys.stdout.flush()
