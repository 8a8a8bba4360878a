"""Generated C for small robots and for large ones: tests of the one model look at both."""

import pytest

from robosc.targets.code.c import alike, header


@pytest.fixture(params=["small", "large"])
def size(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Size of the robots that the code is for, whatever their size is."""
    if request.param == "large":
        monkeypatch.setattr(alike, "MANY", 2)
        monkeypatch.setattr(header, "SMALL", 0)
    return str(request.param)
