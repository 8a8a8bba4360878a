"""The page about the courier: what is typed prints what it says."""

from pathlib import Path

from support.tutorial import play_page

PAGE = Path(__file__).parents[1] / "docs" / "courier.md"


def test_what_is_typed_prints_what_the_page_says(tmp_path: Path) -> None:
    assert play_page(PAGE.read_text(encoding="utf-8"), tmp_path) > 0
