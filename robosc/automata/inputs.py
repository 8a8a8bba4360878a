"""All the data that one occurrence of an event can carry.

The environment chooses a value for each received datum, and a length for each array. An element is unknown if its
index, or the index of an enclosing array, is beyond the length.
"""

from collections.abc import Iterable, Iterator
from itertools import product

from robosc.automata.compile import NO_DATA, Data, Path
from robosc.automata.structure import InputVariable
from robosc.expressions import BooleanType, Value, domain


def connected_inputs(inputs: Iterable[InputVariable]) -> tuple[tuple[InputVariable, ...], ...]:
    """Inputs of one event in groups that the environment chooses independently: arrays stay together."""
    groups: dict[Path, list[InputVariable]] = {}
    for item in inputs:
        groups.setdefault(_array_root(item), []).append(item)
    return tuple(tuple(group) for group in groups.values())


def valuations(inputs: Iterable[InputVariable], given: Data = NO_DATA) -> Iterator[Data]:
    """Every choice of data for inputs of one event, unknown included where it is possible.

    Args:
        inputs: The inputs.
        given: Data that is not chosen, None where it is unknown. It counts also where none of the inputs is it: what is
            known of an array says something about its other elements.
    """
    inputs = dict.fromkeys(inputs)
    paths = {item.path for item in inputs}
    beside = [path for path in given if path not in paths and any(isinstance(step, int) for step in path)]
    inputs |= dict.fromkeys(InputVariable("", path, BooleanType(), may_be_unknown=True) for path in beside)
    groups = [tuple(_group_valuations(group, given)) for group in connected_inputs(inputs)]
    for choice in product(*groups):
        yield {path: value for part in choice for path, value in part.items()}


def _array_root(item: InputVariable) -> Path:
    """The path of the outermost array around an element that may be unknown, else the whole path."""
    return _arrays(item)[0][0] if item.may_be_unknown else item.path


def _arrays(item: InputVariable) -> tuple[tuple[Path, int], ...]:
    """The arrays that an input's path goes through, outermost first, with the index taken in each.

    What may be left out without being in an array counts as the only element of its own.
    """
    found = tuple((item.path[:place], step) for place, step in enumerate(item.path) if isinstance(step, int))
    return found or ((item.path, 0),)


def _group_valuations(group: tuple[InputVariable, ...], given: Data) -> Iterator[dict[Path, Value | None]]:
    fixed = {item.path: given[item.path] for item in group if item.path in given}
    for known in _known_sets(group):
        if any((value is None) == (path in known) for path, value in fixed.items()):
            continue
        domains = [
            (fixed[item.path],) if item.path in fixed else tuple(domain(item.type)) if item.path in known else (None,)
            for item in group
        ]
        for values in product(*domains):
            yield dict(zip((item.path for item in group), values, strict=True))


def _known_sets(group: tuple[InputVariable, ...]) -> Iterator[frozenset[Path]]:
    """The sets of paths that can be known together, one for each choice of array lengths that matters."""
    seen = set[frozenset[Path]]()
    elements = [item for item in group if item.may_be_unknown]
    indices: dict[Path, set[int]] = {}
    for item in elements:
        for array, index in _arrays(item):
            indices.setdefault(array, set()).add(index)
    # Lengths matter only where an index that is read begins to exist; the empty array is the other case.
    lengths = [(0, *(index + 1 for index in sorted(found))) for found in indices.values()]
    for choice in product(*lengths):
        length = dict(zip(indices, choice, strict=True))
        known = frozenset(
            item.path
            for item in group
            if not item.may_be_unknown or all(index < length[array] for array, index in _arrays(item))
        )
        if known not in seen:
            seen.add(known)
            yield known
