"""The picture of the courier's way is that of the robot that there is."""

import runpy
from pathlib import Path

import pytest

pytest.importorskip("cv2", reason="OpenCV (the extra examples) is not installed")

TOP = Path(__file__).parents[2]


def test_the_picture_is_up_to_date_and_shown() -> None:
    drawing = runpy.run_path(str(TOP / "deploy" / "draw_courier.py"))
    assert drawing["PICTURE"].read_text(encoding="utf-8") == drawing["drawn"]()
    page = (TOP / "docs" / "courier.md").read_text(encoding="utf-8")
    assert "](pictures/courier.svg)" in page
