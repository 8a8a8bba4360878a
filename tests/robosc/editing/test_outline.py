"""The outline: each part stands in the smallest one around it, in sound texts and in damaged ones."""

from random import Random

from hypothesis import given
from hypothesis import strategies as st

from robosc.editing.outline import Part, outline, parts
from robosc.language import parse
from robosc.source import SourceFile
from support.random_models import random_bundle


def pairs(part: Part) -> list[tuple[Part, Part]]:
    return [(part, inner) for inner in part.parts] + [pair for inner in part.parts for pair in pairs(inner)]


def slowly(whole: Part) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Each part but the whole, and the smallest one that it stands in, by looking at all of them."""
    places = [(part.begin, part.end) for part in parts(whole)][1:]
    found = []
    for begin, end in places:
        around = [other for other in places if other != (begin, end) and other[0] <= begin and end <= other[1]]
        found.append(
            (min(around, key=lambda other: other[1] - other[0], default=(whole.begin, whole.end)), (begin, end))
        )
    return sorted(found)


def damaged(text: str, dice: Random) -> str:
    """A text of which some characters are gone."""
    for _ in range(dice.randrange(3)):
        place = dice.randrange(len(text))
        text = text[:place] + text[place + dice.randrange(1, 4) :]
    return text


@given(st.integers(0, 2**32 - 1))
def test_each_part_stands_in_the_smallest_around_it(seed: int) -> None:
    dice = Random(seed)
    for file in random_bundle(seed).files:
        text = damaged(file.text, dice)
        whole = outline(parse(SourceFile(file.name, text)), text)
        if whole is not None:
            found = [((outer.begin, outer.end), (inner.begin, inner.end)) for outer, inner in pairs(whole)]
            assert sorted(found) == slowly(whole)
            for part in parts(whole):
                assert list(part.parts) == sorted(part.parts, key=lambda inner: inner.begin)
