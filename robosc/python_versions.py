"""Versions of Python that RoboSC runs on, as `requires-python` of its metadata has them.

Older versions of Python read this module to report that they are too old: its syntax is that of Python 3.10.
"""

OLDEST = (3, 12)
NEWEST = (3, 13)

FIX = f"install Python 3.{OLDEST[1]}, with 'uv python install 3.{OLDEST[1]}' (docs/install.md)"
"""Instruction for a machine with another one alone."""


def unsupported(version: tuple[int, ...]) -> str:
    """Return what is wrong with a version, such as `(3, 11, 7)`; empty: RoboSC runs on it."""
    if OLDEST <= version[:2] <= NEWEST:
        return ""
    wrong = "too old" if version[:2] < OLDEST else "newer than what is tested"
    supported = " or ".join(f"3.{minor}" for minor in range(OLDEST[1], NEWEST[1] + 1))
    return f"{'.'.join(map(str, version[:3]))} is {wrong}; RoboSC needs {supported}"


__all__ = ["FIX", "NEWEST", "OLDEST", "unsupported"]
