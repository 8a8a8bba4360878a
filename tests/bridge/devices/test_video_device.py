from pathlib import Path

import cv2
import numpy as np
import pytest

from robosc_bridge.devices.video_device import VideoDevice
from robosc_bridge.errors import LineDeniedError, LineError, LineLostError, LineMissingError
from robosc_bridge.skills import LineSettings
from robosc_bridge.skills.line import line_offset


def film(path: Path, middles: tuple[int, ...]) -> Path:
    """A film of a line that moves."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (64, 48))
    assert writer.isOpened()
    for middle in middles:
        picture = np.full((48, 64, 3), 220, np.uint8)
        picture[:, middle - 4 : middle + 4] = 10
        writer.write(picture)
    writer.release()
    return path


def test_pictures_of_a_film_show_its_line_until_it_ends(tmp_path: Path) -> None:
    source = VideoDevice(str(film(tmp_path / "line.avi", (12, 32, 52))))
    seen = [line_offset(source.read(), LineSettings()) for _ in range(3)]
    assert seen == pytest.approx([0.5 - middle / 64 for middle in (12, 32, 52)], abs=0.02)
    with pytest.raises(LineLostError, match="no more pictures"):
        source.read()
    source.close()
    source.close()
    with pytest.raises(LineLostError):
        source.read()


def test_a_missing_camera_is_reported(tmp_path: Path) -> None:
    with pytest.raises(LineMissingError, match="video7: there is no such camera"):
        VideoDevice(str(tmp_path / "video7"))


def test_what_is_no_camera_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "text"
    path.write_text("no film")
    with pytest.raises(LineError, match="it is not a camera"):
        VideoDevice(str(path))


@pytest.mark.parametrize("device", ["/dev/null", "/dev/zero"])
def test_a_device_of_another_kind_is_reported(device: str) -> None:
    with pytest.raises(LineError, match=f"{device}: no pictures can be read"):
        VideoDevice(device)


def test_a_camera_that_one_may_not_open_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("robosc_bridge.devices.video_device.os.open", refuse)
    with pytest.raises(LineDeniedError, match="in the group video"):
        VideoDevice(str(tmp_path))
