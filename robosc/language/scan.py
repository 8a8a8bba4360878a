"""Facts about a text that need no parser and so work for broken texts, too: the libraries that it imports."""

from collections.abc import Iterator

from robosc.language.tokens import Kind, is_open_comment, tokenize_broken


def declared_libraries(text: str) -> frozenset[str]:
    """The libraries that a text declares, be it sound or broken."""
    return frozenset(name for word, name, _ in _triples(text, "library") if word)


def imported_libraries(text: str) -> tuple[str, ...]:
    """The libraries that a text imports from, in the order of the text."""
    return tuple(dict.fromkeys(name for word, name, following in _triples(text, "from") if following == "import"))


def _triples(text: str, word: str) -> Iterator[tuple[str, str, str]]:
    """Every use of `word` with a name behind it, and what follows."""
    if word not in text:
        return
    texts, kinds, _ = tokenize_broken(text)
    for index, token in enumerate(texts):
        if token == word and kinds[index + 1] in (Kind.NAME, Kind.WORD):
            yield token, texts[index + 1].removeprefix("^"), texts[index + 2]
        elif kinds[index] == Kind.OTHER and is_open_comment(token):
            # There is no end of a comment in it: without their begins, there are none.
            yield from _triples(token.replace("/*", "  "), word)
