"""Relations between integers: the bounds of differences and sums that hold wherever a predicate is true.

Enumerations of one type are integers of which only the equality counts.

A predicate implies the conjunction of the relations that hold in it, so only states inside that conjunction need
further tests. Relations that these tests make unnecessary are dropped. A class of values may lie on both sides of a
relation: the relation is then possible for the class, and possible relations are enough for an exact result.

Source: A. Mine, "The octagon abstract domain", Higher-Order and Symbolic Computation 19(1), 2006, pp. 31-100 (bounds
of differences and sums of two); sums of more places are bounded in the same way.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations, product
from typing import Literal

import msgspec
from msgspec.structs import replace

from robosc.conditions.cover import Words, cover
from robosc.conditions.literals import Size, size
from robosc.conditions.multivalued import EffortExceededError, Node, Space
from robosc.expressions import MAXIMUM_INTEGER, Binary, Constant, EnumType, Expression, IntegerType, VariableRead
from robosc.supervisor.diagram import Domains, Subject

MAXIMUM_PLACES = 6
"""Integers, or enumerations of one type, up to which relations between them are looked for."""

_MAXIMUM_MIXED = 4
"""Integers up to which sums of some, and differences of sums, are bounded as well."""

_DEPTH = 2
"""Number of times that relations are looked for in what other relations leave open."""

Operator = Literal["<=", ">=", "=", "!="]

_OPPOSITE: dict[Operator, Operator] = {"=": "!=", "!=": "="}

Form = tuple[tuple[int, int], ...]
"""A sum of places: each with 1, or with -1 where it is subtracted; the first one, in the model's text, with 1."""


class Relation(msgspec.Struct, frozen=True):
    """A comparison of a sum of places with a number.

    Attributes:
        form: The sum.
        operator: Operator of the comparison.
        bound: The number.
    """

    form: Form
    operator: Operator
    bound: int

    @property
    def opposite(self) -> "Relation":
        """The relation that is true where this one is not."""
        match self.operator:
            case "<=":
                return Relation(self.form, ">=", self.bound + 1)
            case ">=":
                return Relation(self.form, "<=", self.bound - 1)
        return replace(self, operator=_OPPOSITE[self.operator])


class Description(msgspec.Struct, frozen=True):
    """Condition that is true where some relations are, tests of single places are, and something else is not.

    Attributes:
        relations: The relations.
        single: Node of the tests of single places.
        inner: Description that must be false, if there is one.
    """

    relations: tuple[Relation, ...]
    single: Node
    inner: "Description | None"


class Relations:
    """Relations between the integers, and the enumerations, of one store.

    Args:
        space: The store.
        words: Tests of one place, for what relations leave open.
        domains: Values that the places can hold.
    """

    def __init__(self, space: Space, words: Words, domains: Domains) -> None:
        self._space = space
        self._words = words
        self._domains = domains
        self._values: dict[int, list[tuple[int, int]]] = {}
        self._enums: dict[int, EnumType] = {}
        for variable, subject in enumerate(space.subjects):
            values = domains[subject]
            if isinstance(values.type, EnumType):
                self._enums[variable] = values.type
            if isinstance(values.type, IntegerType | EnumType):
                offset = int(values[0]) if isinstance(values.type, IntegerType) else 0
                self._values[variable] = [
                    (offset + runs[0].start, offset + runs[-1].stop - 1) for runs in space.classes[variable]
                ]
        self._nodes: dict[Relation, Node] = {}
        self._known: dict[tuple[Node, tuple[int, ...]], tuple[Relation, ...]] = {}

    def comparable(self, variables: Iterable[int]) -> tuple[int, ...]:
        """Those of some places that can be compared with others of them, in the order of the model's text."""
        numbers = {self._space.subjects[variable]: variable for variable in variables}
        found = (numbers[subject] for subject in comparable(numbers, self._domains))
        return tuple(sorted(found, key=lambda variable: self._words.ranks[variable]))

    def descriptions(
        self, wanted: Node, forbidden: Node, compared: tuple[int, ...], *, depth: int = _DEPTH
    ) -> Iterator[Description]:
        """Yield descriptions with relations that are true where `wanted` is and false where `forbidden` is.

        Args:
            wanted: Node of the states where they must be true; not false.
            forbidden: Node of the states where they must be false; disjoint from `wanted`.
            compared: The places that relations may name.
            depth: Number of times that relations may be looked for inside what relations leave open.

        Raises:
            EffortExceededError: It takes too many steps.
        """
        relations = self._holding(wanted, compared)
        tried: set[tuple[Relation, ...]] = set()
        todo = [relations]
        while todo:
            chosen = todo.pop(0)
            if not chosen or chosen in tried:
                continue
            tried.add(chosen)
            inside = self._space.both(self._possible(chosen), forbidden)
            for rest in self._rests(wanted, inside, compared, depth):
                found = self._needed(replace(rest, relations=chosen), forbidden)
                if found.relations:
                    yield self._relaxed(found, forbidden)
                if chosen == relations:
                    # The dropped relations may have spoilt the tests of single places.
                    todo += [found.relations, *((relation,) for relation in found.relations)]

    def _rests(self, wanted: Node, inside: Node, compared: tuple[int, ...], depth: int) -> Iterator[Description]:
        """Yield descriptions that are true where `wanted` is and exclude what is inside relations but forbidden."""
        near = self._space.both(inside, self._space.of_cube(self._space.enclosing_cube(wanted)))
        if depth and near != 0:
            for inner in self.descriptions(near, wanted, compared, depth=depth - 1):
                for single in self._sum(wanted, self._space.without(inside, near)):
                    yield Description((), single, inner)
        for single in self._sum(wanted, inside):
            yield Description((), single, None)

    def _sum(self, wanted: Node, forbidden: Node) -> Iterator[Node]:
        """A sum of products of tests of single places that is true and false where it must be, if there is one."""
        try:
            with self._space.within(self._space.effort.part(self._space.effort.left // 2)):
                found = self._space.sum_of(cover(self._space, self._words, wanted, forbidden))
        except EffortExceededError:
            return
        yield found

    def are_enough(self, wanted: Node, forbidden: Node, compared: tuple[int, ...]) -> bool:
        """Return True if relations and the values that each place takes by itself exclude all that is forbidden."""
        relations = self._holding(wanted, compared)
        inside = self._space.both(self._possible(relations), self._space.of_cube(self._space.enclosing_cube(wanted)))
        return bool(relations) and self._space.both(inside, forbidden) == 0

    def expression(self, relation: Relation) -> Expression:
        """A relation in the model's words: nothing is subtracted but a number."""
        added = [variable for variable, sign in relation.form if sign > 0]
        taken = [variable for variable, sign in relation.form if sign < 0]
        left = self._added(added)
        if not taken:
            return Binary(relation.operator, left, Constant(relation.bound))
        right = self._added(taken)
        match relation.operator, relation.bound:
            case "<=", -1:
                return Binary("<", left, right)
            case ">=", 1:
                return Binary(">", left, right)
        if relation.bound > 0:
            right = Binary("+", right, Constant(relation.bound))
        elif relation.bound < 0:
            right = Binary("-", right, Constant(-relation.bound))
        return Binary(relation.operator, left, right)

    def states(self, description: Description) -> Node:
        """Return the node that is true where a description may be true.

        It is exact if each value of the description's integers is a class of its own.
        """
        found = self._space.both(self._possible(description.relations), description.single)
        return found if description.inner is None else self._space.without(found, self._certain(description.inner))

    def _certain(self, description: Description) -> Node:
        """Return the node that is true where a description is true whatever values of a class its integers have."""
        found = description.single
        for relation in description.relations:
            for half in _halves(relation):
                found = self._space.without(found, self._built(half.opposite))
        return found if description.inner is None else self._space.without(found, self.states(description.inner))

    def _possible(self, relations: Iterable[Relation]) -> Node:
        """Return the node that is true where each of some relations may be true."""
        return self._space.all_of(self._built(relation) for relation in relations)

    # Relations that hold

    def _holding(self, node: Node, compared: tuple[int, ...]) -> tuple[Relation, ...]:
        """Relations that hold wherever a predicate is true and that the ranges of its single places do not imply."""
        if (node, compared) not in self._known:
            self._known[node, compared] = tuple(self._bounding(node, compared))
        return self._known[node, compared]

    def _bounding(self, node: Node, compared: tuple[int, ...]) -> Iterator[Relation]:
        box = {variable: self._bounds(node, ((variable, 1),)) for variable in compared}
        numbers = [variable for variable in compared if variable not in self._enums]
        for form in (*_forms(numbers), *self._pairs(compared)):
            is_enum = form[0][0] in self._enums
            if not self._is_computable(form):
                continue
            low, high = self._bounds(node, form)
            least, greatest = _total(form, box)
            if len(form) == 2 and form[1][1] < 0 and low == high == 0 and least < greatest:
                yield Relation(form, "=", 0)
                continue
            if low > least and not is_enum:
                yield Relation(form, ">=", low)
            if high < greatest and not is_enum:
                yield Relation(form, "<=", high)
            if len(form) == 2 and form[1][1] < 0 and low < 0 < high:
                unequal = Relation(form, "!=", 0)
                if self._space.both(node, self._built(unequal.opposite)) == 0:
                    yield unequal

    def _pairs(self, compared: Iterable[int]) -> Iterator[Form]:
        """The differences of enumerations of one type, of whose values nothing but equality matters."""
        enums = [variable for variable in compared if variable in self._enums]
        for first, second in combinations(enums, 2):
            if self._enums[first] == self._enums[second]:
                yield (first, 1), (second, -1)

    def _bounds(self, node: Node, form: Form) -> tuple[int, int]:
        """The least and the greatest value of a sum where a predicate, which is not false, is true."""
        return -self._greatest(node, [(variable, -sign) for variable, sign in form]), self._greatest(node, form)

    def _greatest(self, node: Node, form: Iterable[tuple[int, int]]) -> int:
        signs = dict(form)
        count = len(self._space.subjects)
        gains: list[list[int]] = [[]] * count
        # For each place what it and all places below can give where nothing tests them.
        below = [0] * (count + 1)
        for variable in reversed(range(count)):
            below[variable] = below[variable + 1]
            if variable in signs:
                gains[variable] = [high if signs[variable] > 0 else -low for low, high in self._values[variable]]
                below[variable] += max(gains[variable])
        # For each node the most that the places from its own on can give, less what they can give untested.
        known: dict[Node, int] = {1: 0}

        def greatest(item: Node) -> int:
            variable, children = self._space.variable(item), self._space.children(item)
            gain = gains[variable]
            for child in children:
                if child and child not in known:
                    known[child] = greatest(child)
            if gain:
                most = max([gain[place] + known[child] for place, child in enumerate(children) if child])
            else:
                most = max([known[child] for child in children if child])
            return most + below[variable + 1] - below[variable]

        if node not in known:
            known[node] = greatest(node)
        self._space.effort.spend(len(known) - 1)
        return below[0] + known[node]

    def _is_computable(self, form: Form) -> bool:
        """Return True if no number in any relation of a sum, nor in its opposite, can leave 32 bits."""
        widest = sum(max(abs(end) for ends in self._values[variable] for end in ends) for variable, _ in form)
        # A bound is one of the sums or one more or less, and is added to a part of the sum.
        return 2 * widest + 2 <= MAXIMUM_INTEGER

    # Relations that are needed

    def _needed(self, description: Description, forbidden: Node) -> Description:
        """The description without the relations that the others and the rest make unnecessary, the longest first."""
        kept = list(description.relations)
        open_states = self._space.both(self.states(replace(description, relations=())), forbidden)
        for relation in sorted(kept, key=self._size, reverse=True):
            others = [other for other in kept if other != relation]
            if self._space.both(self._possible(others), open_states) == 0:
                kept = others
        return replace(description, relations=tuple(_equal(kept)))

    def _relaxed(self, description: Description, forbidden: Node) -> Description:
        """The description with those bounds that take the fewest words, of all that keep out what is forbidden."""
        found = list(description.relations)
        for place, relation in enumerate(found):
            if relation.operator in ("<=", ">="):
                others = replace(description, relations=(*found[:place], *found[place + 1 :]))
                # Never empty: the relation is needed.
                least, greatest = self._bounds(self._space.both(self.states(others), forbidden), relation.form)
                found[place] = self._shortest(relation, least - 1 if relation.operator == "<=" else greatest + 1)
        return replace(description, relations=tuple(found))

    def _shortest(self, relation: Relation, last: int) -> Relation:
        """The relation with the bound, from its own to the last, that takes the fewest words."""
        low, high = min(relation.bound, last), max(relation.bound, last)
        bounds = [relation.bound, *(bound for bound in (0, -1, 1, last) if low <= bound <= high)]
        found = [replace(relation, bound=bound) for bound in bounds]
        return min(found, key=self._size)

    def _size(self, relation: Relation) -> Size:
        return size(self.expression(relation))

    # Their nodes and their words

    def _built(self, relation: Relation) -> Node:
        """Return the node that is true where a relation may be true."""
        found = self._nodes.get(relation)
        if found is None:
            found = self._nodes[relation] = self._new(relation)
        return found

    def _new(self, relation: Relation) -> Node:
        match relation.operator:
            case "<=":
                return self._at_most(relation.form, relation.bound)
            case ">=":
                return self._at_most([(variable, -sign) for variable, sign in relation.form], -relation.bound)
            case "=":
                return self._possible(_halves(relation))
        return self._unequal(relation)

    def _at_most(self, form: Iterable[tuple[int, int]], bound: int) -> Node:
        ordered = sorted(form)
        losses = [[low if sign > 0 else -high for low, high in self._values[variable]] for variable, sign in ordered]
        least, most = [0], [0]
        for items in reversed(losses):
            least.append(least[-1] + min(items))
            most.append(most[-1] + max(items))
        known: dict[tuple[int, int], Node] = {}

        def built(place: int, left: int) -> Node:
            """Return the node that is true where the places from one on give no more than is left."""
            if most[len(ordered) - place] <= left:
                return 1
            if least[len(ordered) - place] > left:
                return 0
            node = known.get((place, left))
            if node is None:
                children = tuple(built(place + 1, left - loss) for loss in losses[place])
                node = known[place, left] = self._space.make(ordered[place][0], children)
            return node

        return built(0, bound)

    def _unequal(self, relation: Relation) -> Node:
        """Return the node that is true where a sum of two places can be another number than the bound.

        It is false where they have the wrong values and no other ones.
        """
        (first, sign), (second, other) = sorted(relation.form)
        rows = []
        for ends in self._values[first]:
            row = tuple(
                int({sign * end + other * own for end in ends for own in values} != {relation.bound})
                for values in self._values[second]
            )
            rows.append(self._space.make(second, row))
        return self._space.make(first, tuple(rows))

    def _added(self, variables: Sequence[int]) -> Expression:
        reads = [self._read(variable) for variable in variables]
        result = reads[0]
        for read in reads[1:]:
            result = Binary("+", result, read)
        return result

    def _read(self, variable: int) -> Expression:
        name, place = self._space.subjects[variable]
        return VariableRead(name, str(place))


def comparable(subjects: Iterable[Subject], domains: Domains) -> list[Subject]:
    """The places, among some, that hold integers, and those that hold enumerations of one type: none alone or too many.

    Args:
        subjects: The places.
        domains: Values that they can hold.
    """
    kinds: dict[object, list[Subject]] = {}
    for subject in subjects:
        kind = domains[subject].type
        if isinstance(kind, IntegerType | EnumType):
            kinds.setdefault(IntegerType if isinstance(kind, IntegerType) else kind, []).append(subject)
    return [item for found in kinds.values() if 2 <= len(found) <= MAXIMUM_PLACES for item in found]


def _halves(relation: Relation) -> tuple[Relation, ...]:
    """A relation as those that are one comparison of less or more."""
    if relation.operator != "=":
        return (relation,)
    return replace(relation, operator="<="), replace(relation, operator=">=")


def _equal(relations: Sequence[Relation]) -> Iterator[Relation]:
    """Relations, with `=` where a sum is bounded from both sides by one number."""
    for relation in relations:
        other = replace(relation, operator="<=" if relation.operator == ">=" else ">=")
        if other not in relations or relation.operator in ("=", "!="):
            yield relation
        elif relation.operator == ">=":
            yield replace(relation, operator="=")


def _forms(integers: Sequence[int]) -> Iterator[Form]:
    """The sums that are bounded."""
    for first, second in combinations(integers, 2):
        yield (first, 1), (second, -1)
        yield (first, 1), (second, 1)
    if len(integers) > _MAXIMUM_MIXED:
        yield tuple((variable, 1) for variable in integers)
        return
    for count in range(3, len(integers) + 1):
        for chosen in combinations(integers, count):
            for signs in product((1, -1), repeat=count - 1):
                yield tuple(zip(chosen, (1, *signs), strict=True))


def _total(form: Form, box: dict[int, tuple[int, int]]) -> tuple[int, int]:
    """The least and the greatest value of a sum of places that are bounded one by one."""
    ends = [box[variable] if sign > 0 else (-box[variable][1], -box[variable][0]) for variable, sign in form]
    return sum(low for low, _ in ends), sum(high for _, high in ends)
