"""Engines are found by name and imported on use."""

import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint

import pytest

from robosc import kernel
from robosc.automata import System
from robosc.synthesis import (
    SynthesisStatus,
    UnknownEngineError,
    connection,
    engine_names,
    register,
    resolve_engine,
    synthesize,
)
from robosc.synthesis import engines as module
from robosc.synthesis.engines import installed_engines

EMPTY = System("Empty", (), ())


def test_nothing_is_imported_before_it_is_needed() -> None:
    code = "import sys, robosc.synthesis; print(sorted(name for name in sys.modules if name.partition('.')[0] == 'dd'))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


@pytest.fixture
def connected_anew() -> Iterator[None]:
    for found in (kernel._found, connection.connected):
        found.cache_clear()
    yield
    for found in (kernel._found, connection.connected):
        found.cache_clear()


@pytest.mark.usefixtures("connected_anew")
class TestAuto:
    def test_is_cudd_where_the_kernel_works_with_it(self) -> None:
        if connection.left_aside():
            pytest.skip("there is no kernel, or no CUDD")
        assert resolve_engine("auto") == "cudd"
        assert synthesize(EMPTY).statistics.engine == "cudd"
        assert installed_engines()[:3] == ("cudd", "oxidd", "autoref")

    def test_is_oxidd_without_the_kernel(self, monkeypatch: pytest.MonkeyPatch) -> None:
        pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
        monkeypatch.setenv("ROBOSC_KERNEL", "0")
        assert resolve_engine("auto") == "oxidd"
        assert synthesize(EMPTY).statistics.engine == "oxidd"
        assert installed_engines()[:3] == ("oxidd", "cudd", "autoref")

    def test_is_oxidd_without_cudd(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "dd.cudd", None)  # importing it now fails
        assert resolve_engine("auto") == "oxidd"
        assert synthesize(EMPTY).statistics.engine == "oxidd"
        assert installed_engines()[:2] == ("oxidd", "autoref")
        with pytest.raises(UnknownEngineError, match="which is not installed; use 'oxidd'"):
            synthesize(EMPTY, engine="cudd")


def test_an_engine_can_be_registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_FACTORIES", dict(module._FACTORIES))
    made: list[str] = []

    def factory() -> module.Manager:
        made.append("mine")
        return module.make_manager("autoref")

    register("mine", factory)
    assert engine_names() == ("autoref", "cudd", "mine", "oxidd")
    result = synthesize(EMPTY, engine="mine")
    assert (result.status, result.statistics.engine, made) == (SynthesisStatus.SUPERVISOR, "mine", ["mine"])


def offer(monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    """Let another package offer the engine `foreign`."""
    point = EntryPoint("foreign", value, module.ENTRY_POINTS)

    def found(*, group: str, name: str | None = None) -> list[EntryPoint]:
        return [point] if group == module.ENTRY_POINTS and name in (None, "foreign") else []

    monkeypatch.setattr("importlib.metadata.entry_points", found)


def test_an_engine_of_another_package_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    offer(monkeypatch, "dd.autoref:BDD")
    assert engine_names() == ("autoref", "cudd", "foreign", "oxidd")
    assert synthesize(EMPTY, engine="foreign").statistics.engine == "foreign"


@pytest.mark.parametrize("value", ["no_such_package:BDD", "dd.autoref:NoSuchName"])
def test_an_engine_of_another_package_that_cannot_be_loaded(monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    offer(monkeypatch, value)
    with pytest.raises(UnknownEngineError, match=f"'foreign' cannot be loaded from {value}"):
        synthesize(EMPTY, engine="foreign")


@pytest.mark.parametrize("name", ["cudd", "oxidd", "autoref"])
def test_a_manager_that_is_kept_ready_is_used_once(name: str) -> None:
    if name == "cudd":
        pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    module.keep_ready(name)
    module.keep_ready(name)
    ready = module.make_manager(name)
    assert module.make_manager(name) is not ready
    assert len(ready) <= 1
