from collections.abc import Iterable
from random import Random

from hypothesis import given
from hypothesis import strategies as st

from robosc.execution.runtime.decision import FairPolicy, Policy, RandomPolicy, make_policy

NAMES = ("a", "b", "c")


def run(policy: Policy, *decisions: tuple[int, ...]) -> list[int]:
    """Return the requests that are issued when these are enabled, one decision after the other."""
    issued = []
    for enabled in decisions:
        tell(policy, enabled)
        chosen = policy.choose()
        if chosen is not None:
            policy.issued(chosen)
            issued.append(chosen)
        policy.close()
    return issued


def tell(policy: Policy, enabled: Iterable[int]) -> None:
    """Tell a policy that these are enabled now, and no others."""
    for request in set(policy.enabled) - set(enabled):
        policy.disable(request)
    for request in enabled:
        policy.enable(request)


def test_fair_goes_around_in_source_order() -> None:
    assert run(FairPolicy(3), *[(0, 1, 2)] * 6) == [0, 1, 2, 0, 1, 2]


def test_fair_prefers_what_was_not_enabled_at_the_previous_decision() -> None:
    # 1 was never issued, yet 2, issued at the start and newly enabled since, comes first.
    assert run(FairPolicy(3), (2,), (), (), (0, 1), (0, 1, 2)) == [2, 0, 2]


def test_fair_takes_the_longest_ago_issued_of_those_that_are_not_new() -> None:
    assert run(FairPolicy(2), (0,), (0, 1), (0, 1), (0, 1)) == [0, 1, 0, 1]


def test_a_request_is_favoured_for_being_new_once_in_n_decisions() -> None:
    # 0 blinks; 1 waits. With N = 2 request 0 may not use its newness at two decisions in a row of two.
    policy = FairPolicy(2)
    assert run(policy, (0,), (1,), (0, 1), (1,), (0, 1)) == [0, 1, 0, 1, 0]
    # Favoured at decision 4 it may be so again at 6, not at 5.
    assert run(policy, (0, 1)) == [1]


def test_a_favour_used_up_leaves_the_waiting_one_first() -> None:
    policy = FairPolicy(3)
    # 0: new at decision 0. Absent at 1, new again at 2: fewer than N = 3 decisions later, so it counts as old.
    assert run(policy, (0, 1), (1, 2), (0, 1, 2)) == [0, 2, 1]


def test_a_decision_with_nothing_enabled_counts_as_a_decision() -> None:
    assert run(FairPolicy(2), (0, 1), (), (0, 1)) == [0, 1]
    # After the empty decision both are new again, and the never-issued one comes first.
    assert run(FairPolicy(2), (1,), (), (), (0, 1)) == [1, 0]


def test_what_could_not_be_issued_has_not_used_its_favour() -> None:
    policy = FairPolicy(2)
    tell(policy, (0, 1))
    assert policy.choose() == 0
    policy.withhold(0)
    assert policy.choose() == 1
    policy.issued(1)
    policy.close()
    assert run(policy, (0, 1)) == [0]


@given(
    st.integers(2, 5).flatmap(lambda n: st.tuples(st.just(n), st.lists(st.sets(st.integers(0, n - 1)), max_size=120)))
)
def test_no_request_starves(case: tuple[int, list[set[int]]]) -> None:
    count, enabled_sets = case
    policy = FairPolicy(count)
    waiting = [0] * count
    for enabled_set in enabled_sets:
        # Request 0 waits all the time, while the others come and go as they like.
        enabled = tuple(sorted(enabled_set | {0}))
        tell(policy, enabled)
        chosen = policy.choose()
        assert chosen is not None
        policy.issued(chosen)
        policy.close()
        for request in range(count):
            waiting[request] = waiting[request] + 1 if request in enabled and request != chosen else 0
        # At most N - 1 of N decisions go to others for being new; each of the others is longest-ago issued once.
        assert waiting[0] <= count * count


@given(st.lists(st.sets(st.integers(0, 3)), max_size=60))
def test_fair_agrees_with_the_words(enabled_sets: list[set[int]]) -> None:
    count = 4
    policy = FairPolicy(count)
    previous: set[int] = set()
    issued_at: dict[int, int] = {}
    favoured_at: dict[int, int] = {}
    for number, enabled in enumerate(enabled_sets):
        candidates = tuple(sorted(enabled))
        if candidates:
            new = [c for c in candidates if c not in previous and number - favoured_at.get(c, -count) >= count]
            expected = min(new or candidates, key=lambda c: (issued_at.get(c, -1), c))
            tell(policy, candidates)
            assert policy.choose() == expected
            policy.issued(expected)
            issued_at[expected] = number
            if new:
                favoured_at[expected] = number
        else:
            tell(policy, ())
        policy.close()
        previous = enabled


def test_priority_takes_the_list_first_then_fair() -> None:
    policy = make_policy("priority", NAMES, ("c",), 0)
    assert run(policy, (0, 1, 2), (0, 1), (0, 1), (0, 1, 2), (0, 1)) == [2, 0, 1, 2, 0]


def test_priority_starves_on_purpose() -> None:
    assert run(make_policy("priority", NAMES, ("b", "a"), 0), *[(0, 1, 2)] * 4) == [1] * 4


def test_random_is_the_same_for_the_same_seed() -> None:
    decisions = [(0, 1, 2)] * 50
    first = run(make_policy("random", NAMES, (), 7), *decisions)
    assert first == run(make_policy("random", NAMES, (), 7), *decisions)
    assert first != run(make_policy("random", NAMES, (), 8), *decisions)
    assert set(first) == {0, 1, 2}


@given(st.lists(st.frozensets(st.integers(0, 5)), max_size=30), st.lists(st.integers(0, 5), unique=True), st.data())
def test_it_chooses_as_the_words_say(decisions: list[frozenset[int]], order: list[int], data: st.DataObject) -> None:
    """Among all that are enabled, or among some of them, those left out that could not be issued."""
    policy, before = FairPolicy(6, order), frozenset[int]()
    issued, favoured = dict.fromkeys(range(6), -1), dict.fromkeys(range(6), -6)

    def rank(request: int) -> int:
        return order.index(request) if request in order else len(order)

    for number, enabled in enumerate(decisions):
        tell(policy, enabled)
        left = set(enabled)
        some = data.draw(st.sets(st.sampled_from(sorted(enabled)))) if enabled else set()
        while left:
            among = sorted(left & some) or None
            chosen = policy.choose(among)

            def is_old(request: int, number: int = number, before: frozenset[int] = before) -> bool:
                return request in before or favoured[request] > number - 6

            def place(item: int) -> tuple[int, bool, int, int]:
                return (rank(item), is_old(item), issued[item], item) if item not in order else (rank(item), True, 0, 0)

            assert chosen == min(among or left, key=place)
            if data.draw(st.booleans()):
                policy.issued(chosen)
                if chosen not in order:
                    issued[chosen] = number
                    if not is_old(chosen):
                        favoured[chosen] = number
                break
            policy.withhold(chosen)
            left.remove(chosen)
        else:
            assert policy.choose() is None
        policy.close()
        assert policy.enabled == set(enabled)
        before = enabled


@given(st.lists(st.frozensets(st.integers(0, 5)), max_size=12), st.integers(0, 9))
def test_chance_takes_every_enabled_request_in_the_order_of_the_source(
    decisions: list[frozenset[int]], seed: int
) -> None:
    policy, dice = RandomPolicy(seed), Random(seed)
    for enabled in decisions:
        tell(policy, enabled)
        left = sorted(enabled)
        while left:
            chosen = left[dice.randrange(len(left))]
            assert policy.choose() == chosen
            policy.withhold(chosen)
            left.remove(chosen)
        assert policy.choose() is None
        policy.close()
        assert policy.enabled == sorted(enabled)


def test_the_queue_does_not_grow_with_time() -> None:
    policy = FairPolicy(20)
    for number in range(4000):
        tell(policy, {number % 7, number % 11, 19})
        chosen = policy.choose()
        assert chosen is not None
        policy.issued(chosen)
        policy.close()
        assert len(policy._queue) <= 60
