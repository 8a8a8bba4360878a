"""Generated C evaluates what has changed alone, and that is enough: in robots of many parts, too."""

import subprocess
from pathlib import Path
from random import Random

import pytest

from robosc.execution.runtime.runner import Status
from robosc.execution.runtime.settings import Settings
from robosc.supervisor import Supervisor
from robosc.targets import generate
from robosc.targets.code.c.expressions import code_text
from robosc.targets.code.c.layout import make_layout
from robosc.targets.code.c.readers import Readers
from support.c99 import GCC, SANITIZERS, WARNINGS, Reference, built, compare, compiled, microseconds
from support.execution import unsupervised

pytestmark = pytest.mark.skipif(GCC is None, reason="gcc is not installed")

_PART = """
    component C{0} {{
        incoming message go{0} with identifier: "/go{0}", type: none
        incoming message back{0} with identifier: "/back{0}", type: none
        outgoing message done{0} with identifier: "/done{0}", type: none
        behaviour {{
            initial marked state idle {{ on request to go{0} goto busy }}
            state busy {{ on response from done{0} goto there }}
            state there {{ transition if C{1}.idle goto out }}
            state out {{ on request to back{0} goto idle }}
        }}
    }}
    requirement go{0} needs not C{1}.out
"""

PARTS = 260
"""With two requests and a silent step each: the turns of requests fill many words."""


def _ring(parts: int) -> Supervisor:
    """Parts that go while the next one is not out, and are out once it is idle."""
    texts = (_PART.format(number, (number + 1) % parts) for number in range(parts))
    return unsupervised(f"robot Ring {{{''.join(texts)}}}")


class _Going(Reference):
    """Parts that were told to go say now and then that they are there; the last ones are told to first."""

    def act(self) -> None:
        """A decision, or what comes from a part that goes."""
        self.clock.advance(0.125)
        now = microseconds(self.clock.now_s)
        going = [number for number in range(PARTS) if self.system.state()[f"C{number}"]["state"] == "busy"]
        if self.executor.status is Status.NEW:
            self.executor.start()
            self.command("s")
        elif going and self.dice.random() < 0.5:
            number = self.dice.choice(going)
            self.executor.receive(f"/done{number}", None)
            self._note_command(["m", now, number])
        else:
            self.executor.tick()
            self._note_command(["t", now])


@pytest.mark.parametrize("policy", ["fair", "priority", "random"])
def test_a_robot_of_many_parts_behaves_as_the_reference(policy: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    supervisor = _ring(PARTS)
    program = compiled(supervisor, tmp_path_factory.getbasetemp() / "many_parts", "-O0")
    order = tuple(f"{word}{number}" for number in range(PARTS - 1, PARTS - 9, -1) for word in ("go", "back"))
    settings = Settings(policy=policy, priority=order if policy == "priority" else (), seed=5)
    lines = compare(supervisor, program, Random(1), 1, 90, lambda made, dice: _Going(made, dice, settings))
    assert sum(line.startswith("log event") for line in lines) > 90
    assert sum(line.startswith("publish") for line in lines) > 40


_PUBLISHING = """
static bool publish(void *context, const @p@_request_t *request)
{
    (void)context;
    printf("%d\\n", (int)request->communication);
    return true;
}

static bool publish_default(void *context, @p@_topic_t topic)
{
    (void)context;
    (void)topic;
    return true;
}
"""

_TURNS = """
#include "@p@.h"
#include <stdio.h>
@publishing@
static @p@_t r;

int main(void)
{
    static const @p@_callbacks_t callbacks = {NULL, publish, publish_default, NULL, NULL, NULL, NULL, NULL};
    unsigned number = 0;
    if (!@p@_init(&r, NULL, &callbacks)) {
        return 1;
    }
    @p@_start(&r, 0);
    while (scanf("%u", &number) == 1) {
        switch (number) {
@cases@
        default: @p@_tick(&r, 0); break;
        }
    }
    return 0;
}
"""

_SPEAKER = """
    component C{0} {{
        incoming message say{0} with identifier: "/say{0}", type: none
        outgoing message flip{0} with identifier: "/flip{0}", type: none
        behaviour {{
            initial marked state silent {{ on response from flip{0} goto speaking }}
            marked state speaking {{ on response from flip{0} goto silent on request to say{0} }}
        }}
    }}
"""


@pytest.mark.parametrize("parts", [12, 40], ids=["small", "large"])
def test_turns_go_round_as_the_words_say(parts: int, tmp_path: Path) -> None:
    """The turns of a large robot are numbered anew several times, while requests come and go."""
    decisions = 400
    supervisor = unsupervised(f"robot Many {{{''.join(_SPEAKER.format(number) for number in range(parts))}}}")
    prefix = make_layout(supervisor).prefix
    cases = "\n".join(f"        case {n}: {prefix}_receive_flip{n}(&r, 0); break;" for n in range(parts))
    main = _TURNS.replace("@publishing@", _PUBLISHING).replace("@cases@", cases).replace("@p@", prefix)
    program = built(supervisor, main, tmp_path, *SANITIZERS)
    dice, enabled, before = Random(3), set[int](), set[int]()
    issued, favoured = dict.fromkeys(range(parts), -1), dict.fromkeys(range(parts), -parts)
    commands, expected = [], []
    for decision in range(decisions):
        for number in dice.sample(range(parts), dice.choice([0, 0, 1, 3])):
            commands.append(number)
            enabled ^= {number}
        commands.append(parts)
        if enabled:
            new = [n for n in enabled - before if favoured[n] <= decision - parts]
            chosen = min(new or enabled, key=lambda number: (issued[number], number))
            issued[chosen] = decision
            if new:
                favoured[chosen] = decision
            expected.append(2 * chosen)
        before = set(enabled)
    found = subprocess.run([program], input="\n".join(map(str, commands)), capture_output=True, text=True, check=True)
    assert [int(line) for line in found.stdout.split()] == expected
    assert len(expected) > 5 * parts


_SETS = """
#include "@p@.c"
#include <stdio.h>
#include <stdlib.h>

static uint32_t seed = 1;

static int next_number(int count)
{
    seed = seed * 1664525U + 1013904223U;
    return (int)((seed >> 8) % (uint32_t)count);
}

/* A set beside an array of flags, which each member is looked for in. */
int main(void)
{
    static @p@_set_t set;
    static bool flags[@P@_SET_COUNT];
    for (int round = 0; round < 20000; round++) {
        const int number = next_number(@P@_SET_COUNT);
        int expected = -1;
        int found = -1;
        /* Few or many, in turn. */
        if (next_number(100) < (round / 2000 % 2 == 0 ? 30 : 60)) {
            add_to(&set, number);
            flags[number] = true;
        } else {
            remove_from(&set, number);
            flags[number] = false;
        }
        if (next_number(3000) == 0) {
            empty(&set);
            memset(flags, 0, sizeof flags);
        }
        if (is_in(&set, number) != flags[number]) {
            return 1;
        }
        found = round % 2 == 0 ? first_in(&set) : next_in(&set, number);
        for (expected = round % 2 == 0 ? 0 : number + 1; expected < @P@_SET_COUNT && !flags[expected]; expected++) {
        }
        if (found != (expected < @P@_SET_COUNT ? expected : -1)) {
            printf("%d after %d: %d\\n", expected, number, found);
            return 1;
        }
    }
    return 0;
}
"""


@pytest.mark.parametrize("parts", [1, 8, 40, 600, 2100])
def test_sets_are_as_flags(parts: int, tmp_path: Path) -> None:
    """Sets of one word, of several words, of wide words, and of several words of words."""
    supervisor = unsupervised(f"robot Many {{{''.join(_SPEAKER.format(number) for number in range(parts))}}}")
    prefix = make_layout(supervisor).prefix
    for path, text in generate(supervisor, "c99").items():
        (tmp_path / path).write_text(text, encoding="utf-8")
    text = _SETS.replace("@p@", prefix).replace("@P@", prefix.upper())
    (tmp_path / "test.c").write_text(text, encoding="utf-8")
    options = SANITIZERS if parts < 100 else []
    command = [GCC or "gcc", *WARNINGS, *options, "test.c", "-lm", "-o", "test"]
    subprocess.run(command, cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "test"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_readers_of_a_place_are_those_that_read_it() -> None:
    read = [{"s->a"}, {"node_1"}, {"s->b", "s->a"}, set[str]()]
    readers = Readers(False, read, {"node_1": {"node_2"}, "node_2": {"s->c"}})
    found = [code_text(readers.noted(place)) for place in ("s->a", "s->a", "s->c", "s->d")]
    assert found == ["changed(r, 0)", "changed(r, 0)", "changed(r, 3)", "changed(r, 5)"]
    table = [line.strip() for line in readers.lines()]
    assert table[-4:] == ["2, 0, 2, /* 0: a */", "1, 1, /* 3: c */", "0, /* 5: d */", "};"]


def test_the_readers_of_a_place_in_a_small_robot_are_bits() -> None:
    readers = Readers(True, [{"s->a"}, {"s->b"}, {"s->a"}], {})
    assert code_text(readers.noted("s->a")) == "changed(r, UINT32_C(0x5))"
    assert readers.lines() == []


def test_what_is_read_by_everything_has_no_entry() -> None:
    """The table of a model in which all depends on all does not grow with the square of its size."""
    everywhere = {f"s->at_{number}" for number in range(400)}
    readers = Readers(False, [everywhere] * 400, {})
    assert {code_text(readers.noted(place)) for place in everywhere} == {"all_changed(r)"}
    assert readers.lines() == []
