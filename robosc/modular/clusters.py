"""Modules of a system, from clusters of its dependency structure matrix: a tree with requirements at its nodes.

Sources: T. Wilschut, L. Etman, J. Rooda and I. Adan, "Multilevel flow-based Markov clustering for design structure
matrices", Journal of Mechanical Design 139(12), 2017; S. van Dongen, "Graph clustering by flow simulation", 2000.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from itertools import combinations
from math import log2

from robosc.automata.state import subject_domain, subjects
from robosc.modular.partition import Module, Partition

INFLATION = 2.0
"""Exponent by which strong flows become stronger: the larger, the smaller the clusters."""

SMALLEST_FLOW = 1e-3
"""Smallest flow that counts."""

MAXIMUM_ROUNDS = 20
"""Maximum number of rounds until flows are stable; in symmetric graphs they may never be."""

MAXIMUM_NODES = 30
"""Maximum number of nodes that a demand connects: a demand on more says little about which ones belong together."""

MAXIMUM_BITS = 14.0
"""Logarithm of the combinations of values up to which requirements of one cluster share a module."""

_Column = dict[int, float]


def modules_of(partition: Partition, maximum_bits: float = MAXIMUM_BITS) -> tuple[Module, ...]:
    """The modules of a system: each demand is in one module, and each part in at least one.

    Args:
        partition: The system in parts.
        maximum_bits: Logarithm of the combinations of values up to which the requirements of a cluster share a module.
    """
    bits = _bits(partition)
    # Parts with one state, such as that of a message, connect nothing.
    solid = frozenset(place for place, number in enumerate(bits) if number)
    found: list[Module] = []
    for demands in _by_cluster(partition, solid):
        for module in _connected(partition, demands, solid):
            if sum(bits[place] for place in module.parts) <= maximum_bits:
                found.append(module)
            else:
                found += [Module(partition.demands[place].parts, frozenset({place})) for place in module.demands]
    covered = {place for module in found for place in module.parts}
    found += [Module(needed, frozenset()) for place, needed in enumerate(partition.needs) if place not in covered]
    return _without_smaller(found) or (Module(frozenset(), frozenset()),)


def _bits(partition: Partition) -> list[float]:
    """For each part the logarithm of the combinations of values that its automata have."""
    system = partition.system
    found = defaultdict[str, float](float)
    for subject in subjects(system):
        found[subject.automaton] += log2(len(subject_domain(system, subject)))
    return [sum(found[name] for name in part) for part in partition.parts]


def _by_cluster(partition: Partition, solid: frozenset[int]) -> list[list[int]]:
    """The demands of each node of the tree: a demand stands at the lowest node that has all of its solid parts."""
    left = [place for place, demand in enumerate(partition.demands) if demand.parts]
    found = [[place] for place, demand in enumerate(partition.demands) if not demand.parts]
    nodes = [frozenset({place}) for place in range(len(partition.parts))]
    while left:
        node_of = {part: number for number, node in enumerate(nodes) for part in node}
        here = defaultdict[int, list[int]](list)
        weights = defaultdict[tuple[int, int], float](float)
        waiting: list[int] = []
        for place in left:
            parts = partition.demands[place].parts
            touched = sorted({node_of[part] for part in parts & solid or parts})
            if len(touched) == 1:
                here[touched[0]].append(place)
                continue
            waiting.append(place)
            if len(touched) > MAXIMUM_NODES:
                continue
            for pair in combinations(touched, 2):
                weights[pair] += 1.0 / (len(touched) - 1)
        found += here.values()
        left = waiting
        grouped = clusters(len(nodes), weights)
        if len(grouped) == len(nodes):
            grouped = [list(range(len(nodes)))]
        nodes = [frozenset[int]().union(*(nodes[number] for number in group)) for group in grouped]
    return found


def clusters(count: int, weights: Mapping[tuple[int, int], float]) -> list[list[int]]:
    """The clusters of a graph: nodes between which a random walk stays.

    Args:
        count: Number of nodes.
        weights: Weights above zero of the edges, each with the smaller node first.
    """
    columns: list[_Column] = [{node: 1.0} for node in range(count)]
    for (one, other), weight in weights.items():
        columns[one][other] = columns[other][one] = weight
    columns = list(map(_normalized, columns))
    for _ in range(MAXIMUM_ROUNDS):
        following = [_inflated(_expanded(columns, column)) for column in columns]
        is_steady = all(
            column.keys() == before.keys()
            and all(abs(flow - before[node]) < SMALLEST_FLOW for node, flow in column.items())
            for column, before in zip(following, columns, strict=True)
        )
        columns = following
        if is_steady:
            break
    # Nodes whose flows end at one place are a cluster.
    found: dict[int, list[int]] = {}
    for node, column in enumerate(columns):
        found.setdefault(max(column, key=lambda end: (round(column[end], 3), -end)), []).append(node)
    return list(found.values())


def _expanded(columns: list[_Column], column: _Column) -> _Column:
    found: _Column = {}
    for node, flow in column.items():
        for end, part in columns[node].items():
            found[end] = found.get(end, 0.0) + flow * part
    return found


def _inflated(column: _Column) -> _Column:
    whole = _normalized({node: flow**INFLATION for node, flow in column.items()})
    # The largest stay: where very many are equal, each is small.
    smallest = min(SMALLEST_FLOW, max(whole.values()))
    kept = {node: flow for node, flow in whole.items() if flow >= smallest}
    return _normalized(kept)


def _normalized(column: _Column) -> _Column:
    total = sum(column.values())
    return {node: flow / total for node, flow in column.items()}


def _connected(partition: Partition, demands: Iterable[int], solid: frozenset[int]) -> list[Module]:
    """The demands as modules, of which no two share a solid part."""
    found: list[Module] = []
    for place in demands:
        module = Module(partition.demands[place].parts, frozenset({place}))
        apart = []
        for other in found:
            if other.parts & module.parts & solid:
                module |= other
            else:
                apart.append(other)
        found = [*apart, module]
    return found


def _without_smaller(modules: list[Module]) -> tuple[Module, ...]:
    """The modules, after each module whose parts another one contains was merged into that one."""
    found: list[Module] = []
    by_part = defaultdict[int, list[int]](list)
    for module in sorted(modules, key=lambda item: (-len(item.parts), sorted(item.parts))):
        around = [number for part in module.parts for number in by_part[part] if module.parts <= found[number].parts]
        if around and module.parts:
            found[around[0]] |= module
            continue
        for part in module.parts:
            by_part[part].append(len(found))
        found.append(module)
    return tuple(sorted(found, key=lambda item: (sorted(item.parts), sorted(item.demands))))
