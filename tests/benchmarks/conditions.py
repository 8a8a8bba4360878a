"""Time of readable conditions: to simplify them in synthesis and to put them into words, beside the whole synthesis."""

import time

from figures import text_table

SIZES: dict[str, tuple[int, ...]] = {
    "dining philosophers": (5, 20, 50),
    "transfer line": (1, 4, 8),
    "cat and mouse, 1 pair": (1, 3, 5),
    "cat and mouse, 2 pairs": (1, 2, 3),
    "counter": (10_000,),
}

HEADER = (
    "family, size",
    "adds to",
    "formulas",
    "longest",
    "diagram nodes",
    "synthesis, s",
    "of it conditions, s",
    "words, s",
)


def _row(family: str, size: int) -> list[str]:
    from robosc.conditions.literals import operands
    from robosc.conditions.rendering import Formulas, diagram_lines, in_words
    from robosc.supervisor.diagram import diagram_domains
    from robosc.synthesis import synthesize
    from robosc.synthesis.simplify import Simplifier
    from support.families import FAMILIES

    spent = 0.0
    plain = Simplifier.condition

    def timed(self: Simplifier, wanted: object, care: object) -> object:
        nonlocal spent
        begin = time.perf_counter()
        found = plain(self, wanted, care)
        spent += time.perf_counter() - begin
        return found

    system = FAMILIES[family](size)
    Simplifier.condition = timed  # type: ignore[assignment,method-assign]
    try:
        begin = time.perf_counter()
        added = synthesize(system).added
        synthesis = time.perf_counter() - begin
    finally:
        Simplifier.condition = plain  # type: ignore[method-assign]
    begin = time.perf_counter()
    domains = diagram_domains(system)
    formulas = Formulas(domains)
    found = [formulas.formula(item.condition) for item in added]
    for item, formula in zip(added, found, strict=True):
        if formula is None:
            "".join(map(str, diagram_lines(item.condition, formulas.vocabulary)))
        else:
            in_words(formula, ())
    words = time.perf_counter() - begin
    longest = max((operands(formula) for formula in found if formula is not None), default=0)
    nodes = max(
        (len(item.condition.nodes) for item, formula in zip(added, found, strict=True) if formula is None), default=0
    )
    figures = (f"{len(added)}", f"{sum(formula is not None for formula in found)}", f"{longest}", f"{nodes}")
    return [f"{family}, {size}", *figures, f"{synthesis:.3f}", f"{spent:.3f}", f"{words:.3f}"]


def table() -> str:
    """One line a size."""
    from robosc.synthesis import synthesize
    from support.families import FAMILIES

    synthesize(FAMILIES["token ring"](2))  # The first use imports modules, outside the measurement.
    rows = [_row(family, size) for family, sizes in SIZES.items() for size in sizes]
    return text_table(
        "conditions in words: operands of the longest formula, nodes of the largest diagram", HEADER, rows
    )
