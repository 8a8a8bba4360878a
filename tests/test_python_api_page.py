"""The page about the Python API and the notebook: their code runs, prints what it says, and they name all there is."""

import ast
import contextlib
import io
import json
import re
from pathlib import Path
from typing import Any

import pytest

import robosc
import robosc_client
from support.service import served

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "python-api.md").read_text(encoding="utf-8")
NOTEBOOK = json.loads((ROOT / "examples" / "python_api.ipynb").read_text(encoding="utf-8"))
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
_ADDRESS = '"localhost:50051"'


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (model,) = (text for kind, text in BLOCKS if kind == "robosc")
    (tmp_path / "robot.rscd").write_text(model, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def executed(program: str, names: dict[str, Any]) -> str:
    """Return the output of a program."""
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        exec(compile(program, "<page>", "exec"), names)
    return output.getvalue()


def test_the_code_prints_what_the_page_says(folder: Path) -> None:
    names: dict[str, Any] = {}
    outputs = [text for kind, text in BLOCKS if kind == "text"]
    programs = [text for kind, text in BLOCKS if kind == "python"]
    assert len(programs) == len(outputs) > 4
    assert sum(program.count(_ADDRESS) for program in programs) == 1
    with served() as address:
        for program, expected in zip(programs, outputs, strict=True):
            assert executed(program.replace(_ADDRESS, repr(address)), names) == expected
    assert (folder / "out" / "package.xml").exists()
    assert {path.name for path in (folder / "controller").iterdir()} == {".robosc-manifest.json", "rover_supervisor.py"}


def test_the_model_has_no_findings() -> None:
    assert robosc.check("robot.rscd") == ()


def test_every_function_error_and_option_is_on_the_page() -> None:
    functions = [name for name in robosc.__all__ if name.islower() and not name.startswith("_")]
    errors = [name for name in robosc.__all__ if name.endswith("Error") or name == "SynthesisCancelled"]
    # Those that carry others, are ours, or become a status.
    errors = [name for name in errors if name not in ("UnknownNameError", "InternalError", "UnsupportedModelError")]
    options = list(robosc.SynthesisOptions.__dataclass_fields__)
    missing = [name for name in (*errors, *options) if f"`{name}`" not in PAGE]
    missing += [name for name in functions if not re.search(rf"^\| `{name}\(", PAGE, re.MULTILINE)]
    assert missing == []


def test_every_name_is_on_the_page_that_is_made_from_docstrings() -> None:
    page = (ROOT / "docs" / "python-reference.md").read_text(encoding="utf-8")
    own = set(robosc.__all__) - {"__version__"}
    shared = {name for name in robosc_client.__all__ if getattr(robosc, name, None) is getattr(robosc_client, name)}
    for module, names in (("robosc", own), ("robosc_client", set(robosc_client.__all__) - shared)):
        assert sorted(re.findall(rf"^::: {module}\.(\w+)$", page, re.MULTILINE)) == sorted(names)
    assert all(f"`{name}`" in page for name in shared)
    own = {"close", "simulate"}
    methods = re.findall(r"^::: robosc_client\.operations\.(\w+?)_?$", page, re.MULTILINE)
    assert sorted(methods) == sorted(name for name in vars(robosc_client.Client) if name[0] != "_" and name not in own)


def test_the_notebook_is_one_without_outputs() -> None:
    assert (NOTEBOOK["nbformat"], NOTEBOOK["nbformat_minor"]) == (4, 5)
    cells = NOTEBOOK["cells"]
    assert len({cell["id"] for cell in cells}) == len(cells)
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert {cell["cell_type"] for cell in cells} == {"code", "markdown"}
    assert [(cell["outputs"], cell["execution_count"]) for cell in code] == [([], None)] * len(code)


def test_the_notebook_runs(folder: Path) -> None:
    names: dict[str, Any] = {}
    printed = ""
    shown: list[str] = []
    for cell in NOTEBOOK["cells"]:
        if cell["cell_type"] != "code":
            continue
        tree = ast.parse("".join(cell["source"]))
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        printed += executed(ast.unparse(tree), names)
        if last is not None:
            value = eval(ast.unparse(last), names)  # as Jupyter does with what a cell ends in
            show = getattr(value, "_repr_html_", None) or getattr(value, "_repr_markdown_", None) or value.__repr__
            shown.append(show())
    assert len(shown) > 8
    assert "Base.charges &gt;= 2" in "".join(shown)
    assert (folder / "rover_controller" / "package.xml").exists()


def test_the_notebook_explains_why_there_is_no_supervisor() -> None:
    cells = ["".join(cell["source"]) for cell in NOTEBOOK["cells"] if cell["cell_type"] == "code"]
    names: dict[str, Any] = {}
    executed(cells[0], names)
    assert "'requirement never Base.ready'" in executed(cells[-1], names)
