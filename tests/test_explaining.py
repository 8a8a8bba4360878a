"""The page about explanations, played as a reader plays it; and every key that it should name."""

from pathlib import Path

import pytest

from robosc.explanation import explanations, parts
from support.tutorial import play_page

DOCS = Path(__file__).parents[1] / "docs"
PAGE = (DOCS / "explaining.md").read_text(encoding="utf-8")


def test_the_page_is_true(tmp_path: Path) -> None:
    pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    assert play_page(PAGE, tmp_path) > 5


def vars_of(item: object) -> tuple[str, ...]:
    """Return the fields of a class of values; none of anything else."""
    return getattr(item, "__struct_fields__", ()) or tuple(getattr(item, "__dataclass_fields__", ()))


def test_every_key_is_explained() -> None:
    homes = (explanations, parts)
    items = [item for home in homes for item in vars(home).values() if getattr(item, "__module__", "") == home.__name__]
    names = {name for item in items for name in vars_of(item)}
    assert len(names) > 25
    assert [name for name in sorted(names) if f"`{name}`" not in PAGE] == []
