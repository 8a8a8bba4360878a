"""The table of promises: what stands on the page is what happens, on the virtual clock, at any time of the fault."""

import random
import re
from dataclasses import replace

import pytest

from support.promises import GOES_ON_S, HEAD, PAGE, PROMISES, Promise, PromiseBrokenError, measured_s

# Time that a busy machine may add in real time, where the page was measured, in seconds.
BUSY_S = 0.06


@pytest.mark.parametrize("promise", PROMISES, ids=lambda promise: f"{promise.base}-{promise.fault}")
def test_a_promise_is_kept(promise: Promise) -> None:
    took_s = measured_s(promise, random.Random(f"{promise.base} {promise.fault}"))
    assert 0.0 <= took_s <= (promise.promised_s or GOES_ON_S)


def test_a_promise_that_is_not_kept_is_reported() -> None:
    (held,) = (each for each in PROMISES if each.base == "opencr" and each.fault.startswith("a motor is dead"))
    with pytest.raises(AssertionError, match=r"instead of 0\.300 s"):
        measured_s(replace(held, promised_s=0.3), random.Random(0))
    (stops,) = (each for each in PROMISES if each.base == "opencr" and each.fault == "the supervisor fails")
    with pytest.raises(PromiseBrokenError, match="it did not go on"):
        measured_s(replace(stops, promised_s=None), random.Random(0))


def test_the_page_lists_every_promise_and_nothing_else() -> None:
    rows = re.findall(r"^\| (.+) \|$", PAGE.read_text(encoding="utf-8").partition(HEAD)[2], re.MULTILINE)
    found = [tuple(row.split(" | ")) for row in rows]
    assert all(len(cells) == 6 and all(cells) for cells in found)
    promised = [
        (
            promise.fault,
            f"`{promise.base}`",
            promise.by,
            "continues" if promise.promised_s is None else f"{promise.promised_s:g} s",
        )
        for promise in PROMISES
    ]
    assert [cells[:4] for cells in found] == promised
    for cells in found:
        if cells[3] == "continues":
            assert cells[4:] == ("continues", "continues")
            continue
        promised_s, virtual_s, real_s = (float(cell.removesuffix(" s")) for cell in cells[3:])
        assert virtual_s <= promised_s, cells
        assert real_s <= promised_s + BUSY_S, cells


def test_the_page_says_how_often_it_was_measured() -> None:
    words = r"worst of (\d+) runs on the virtual clock and of (\d+) in\s+real time"
    (counts,) = re.findall(words, PAGE.read_text(encoding="utf-8"))
    assert all(int(count) > 0 for count in counts)
