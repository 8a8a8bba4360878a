"""Tests of the facts that a scan finds in a text that the grammar has not read."""

import pytest

from robosc.language.scan import declared_libraries, imported_libraries


@pytest.mark.parametrize(
    ("text", "libraries"),
    [
        ("library Lib { }", {"Lib"}),
        ("library ^state { }", {"state"}),
        ("library Lib", {"Lib"}),
        ("// library Not {\nlibrary /* x */ Lib { component }", {"Lib"}),
        ('robot R { component C { incoming message m with identifier: "library Not {" } }', set()),
        ("'it\\'s library Not' library Lib {", {"Lib"}),
        ("/* library Not */", set()),
        # Where something is never closed, more may have been meant.
        ("/* library /* Lib", {"Lib"}),
        ("'\nlibrary Lib { 'it' }", {"Lib"}),
        ("mylibrary Not { ^library Not", set()),
    ],
)
def test_declared_libraries(text: str, libraries: set[str]) -> None:
    assert declared_libraries(text) == libraries


def test_imported_libraries_come_in_the_order_of_the_text() -> None:
    text = "component A from Two import X component B from One import Y component C from Two import Z // from No import"
    assert imported_libraries(text) == ("Two", "One")
    assert imported_libraries("on response from m interface i use T from p") == ()


@pytest.mark.timeout(60)
@pytest.mark.parametrize("piece", ["/*", "'\\", '"\\', "library ", "from x "])
def test_hidden_text_is_looked_at_once(piece: str) -> None:
    assert imported_libraries(piece * 300_000) == ()
    assert len(declared_libraries(piece * 300_000)) <= 1
