"""Loading the engines of dd: what draws graphs stays away, unless the program has it already."""

import subprocess
import sys

import pytest

from robosc.dd_modules import has_cudd, load_dd

pytest.importorskip("networkx", reason="networkx is not installed: there is nothing to stay away")

_ALONE = """
import sys
from robosc.dd_modules import load_dd
manager = load_dd("autoref").BDD()
manager.declare("a")
assert manager.to_expr(manager.var("a")) == "a"
assert "networkx" not in sys.modules
import networkx
assert networkx.MultiDiGraph().nodes is not None
"""

_AFTER = """
import networkx
from robosc.dd_modules import load_dd
manager = load_dd("bdd").BDD({"a": 0})
load_dd("bdd").to_nx(manager, [manager.var("a")])
"""


@pytest.mark.parametrize("program", [_ALONE, _AFTER], ids=["alone", "after networkx"])
def test_networkx_comes_only_with_the_program(program: str) -> None:
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def test_what_is_not_there_is_reported() -> None:
    before = sys.modules.get("networkx")
    with pytest.raises(ImportError):
        load_dd("no_such_engine")
    assert sys.modules.get("networkx") is before


def test_whether_there_is_cudd_is_known_without_loading_it() -> None:
    program = "import sys; from robosc.dd_modules import has_cudd; print(has_cudd(), 'dd' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    try:
        load_dd("cudd")
    except ImportError:
        expected = False
    else:
        expected = True
    assert has_cudd() is expected
    assert done.stdout == f"{expected} False\n"
