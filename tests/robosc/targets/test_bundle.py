"""Several modules as one file."""

import ast
import importlib
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest

from robosc.targets.code.python.bundle import bundle, statements
from robosc.targets.code.python.generate import RUNTIME


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder that modules called `robosc.*` come from, beside the real ones."""
    import robosc

    folder = tmp_path / "robosc"
    folder.mkdir()
    monkeypatch.setattr(robosc, "__path__", [*robosc.__path__, str(folder)])
    part = folder / "trial"
    part.mkdir()
    (part / "__init__.py").write_text("")
    yield part
    for name in [name for name in sys.modules if name.startswith("robosc.trial")]:
        del sys.modules[name]
    importlib.invalidate_caches()


def write(folder: Path, **texts: str) -> None:
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(textwrap.dedent(text))


def test_what_is_needed_stands_first_and_once(package: Path) -> None:
    write(
        package,
        low='"""Low.\n\nMore of it.\n"""\nimport math\n\n# Why.\nPI = math.pi\n',
        middle='"""Middle."""\nfrom typing import Any\nfrom robosc.trial.low import PI\n'
        "def twice(x: Any): return 2 * PI\n",
        high='"""High."""\nfrom typing import Any, List\nfrom robosc.trial.middle import twice\n'
        "from robosc.trial.low import PI\nRESULT = twice(PI)\n",
    )
    found = bundle(("robosc.trial.high",))
    assert [name for name, _, _ in found.sections] == ["low", "middle", "high"]
    assert found.imports == ("import math", "from typing import Any, List")
    assert found.names == {"PI", "twice", "RESULT"}
    assert "# low: Low.\n#\n# More of it.\n# ---" in found.text()
    assert "# Why.\nPI" in found.text()
    names: dict[str, object] = {}
    exec("\n".join([*found.imports, found.text()]), names)
    assert names["RESULT"] == pytest.approx(6.283, abs=0.001)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("from robosc.trial.low import PI as P", "imports in a way"),
        ("from robosc.trial.low import *", "imports in a way"),
        ("from .low import PI", "imports in a way"),
        ("from robosc import trial", "imports in a way"),
        ("import robosc.trial.low", "imports in a way"),
        ("import math as m", "imports in a way"),
        ("from robosc.trial.low import PI\nPI: int = 3", "PI is defined by robosc.trial.low and by robosc.trial.wrong"),
        ("from robosc.trial.low import PI\ndef PI(): pass", "PI is defined by"),
        ("from robosc.trial.low import PI\nclass PI: pass", "PI is defined by"),
    ],
)
def test_what_cannot_be_put_together_is_refused(package: Path, text: str, problem: str) -> None:
    write(package, low="PI = 3", wrong=text)
    with pytest.raises(ValueError, match=problem):
        bundle.__wrapped__(("robosc.trial.wrong",))


def test_long_imports_are_broken() -> None:
    names = [f"name_{number:02}" for number in range(20)]
    (first, *middle, last) = statements(frozenset(("typing", name) for name in names))
    assert (first, last) == ("from typing import (", ")")
    assert middle == [f"    {name}," for name in names]


@pytest.mark.parametrize("deployment", RUNTIME, ids=str)
def test_generated_names_are_none_of_the_runtime_s(deployment: object) -> None:
    found = bundle(RUNTIME[deployment])  # type: ignore[index]
    assert not [name for name in found.names if name.startswith("convert_") or name in ("Supervisor", "NO_DATA")]
    ast.parse("\n".join(["from __future__ import annotations", *found.imports, found.text()]), feature_version=(3, 8))
