"""Keeps what random makers made for a test, and writes it down if the test fails: as files that can become tests.

Every maker of random models calls `made`. Where a test goes through many, the one that fails is the last; Hypothesis,
too, ends with the smallest that it found.
"""

import re
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

from robosc.model.structure import Model
from robosc.source import Bundle
from support.model_text import model_text

Files = Mapping[str, str]
"""Texts by the names of their files."""

_LINES = 60
"""Lines of a text that are printed; all of them are in its file."""

_last: dict[tuple[str, int | None], Callable[[], Files]] = {}


def made(maker: str, seed: int | None, files: Callable[[], Files]) -> None:
    """Keep what a maker made; the last of each maker is kept.

    Args:
        maker: Its name.
        seed: From what it was made.
        files: Makes the texts, asked only if the test fails.
    """
    for key in [key for key in _last if key[0] == maker]:
        del _last[key]
    _last[maker, seed] = files


def forget() -> None:
    """Begin a test: nothing was made."""
    _last.clear()


def bundle_files(bundle: Bundle) -> Files:
    """The files of a bundle."""
    return {item.name: item.text for item in (bundle.main, *bundle.libraries)}


def model_files(model: Model) -> Files:
    """A model that was made without a text."""
    return {"robot.rscd": model_text(model)}


def written(test: str, folder: Path) -> str:
    """Write what was made for a test that failed.

    Args:
        test: The test's name.
        folder: Folder of all of them; files there of the same test and seed are replaced.

    Returns:
        Text to report: each text, where it is, and how to make a test of it; empty if nothing was made.
    """
    return "\n".join(_written(test, maker, seed, files, folder) for (maker, seed), files in _last.items())


def _written(test: str, maker: str, seed: int | None, files: Callable[[], Files], folder: Path) -> str:
    try:
        texts = files()
    except Exception as error:
        # The failure of the test is what matters.
        return f"{maker}({seed}) has no text: {error!r}"
    place = folder / re.sub(r"\W+", "_", f"{test} {maker} {'' if seed is None else seed}").strip("_")
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    report = [f"What {maker}({'' if seed is None else seed}) made is in {place}:"]
    for name, text in texts.items():
        # The text is written as it is, with its line ends; hostile texts may hold what is no character.
        (place / name).write_bytes(text.encode("utf-8", "backslashreplace"))
        lines = text.splitlines()
        report += [f"--- {name}", *lines[:_LINES], *(["..."] if len(lines) > _LINES else [])]
    is_model = any(name.endswith(".rscd") for name in texts)
    report.append(_kept(place, tuple(texts)) if is_model else f"--- To keep it as a test, name {maker}({seed}) in one.")
    return "\n".join(report)


def _kept(place: Path, names: tuple[str, ...]) -> str:
    """Explain how to make a test of a model."""
    main, *libraries = names
    copy = [f"cp {place / main} tests/corpus/found/NAME.rscd"]
    if libraries:
        copy.append("mkdir tests/corpus/found/NAME.libraries")
        copy += [f"cp {place / name} tests/corpus/found/NAME.libraries/" for name in libraries]
    record = "python tests/corpus/record.py found/NAME"
    steps = " && ".join(["mkdir -p tests/corpus/found", *copy, record])
    return f"--- To keep it as a test, once it means what it should: {steps}"
