"""The generated README: its files, how to build them, and what they need."""

from robosc.model.structure import CommunicationKind, EventKind
from robosc.targets.code.c.header import batch, receive_head, reply_head
from robosc.targets.code.c.layer import request_heads
from robosc.targets.code.c.unit import Unit
from robosc.targets.text import requirements_chapter

_BUILD = """\
## Build

```
cmake -S . -B build && cmake --build build && ./build/{prefix}_example
```

or without CMake: `cc -std=c99 -O2 -ffp-contract=off {prefix}.c main.c -lm -o example`.
Not with `-ffast-math`: NaN stands for what is unknown.

What this model needs: flash is `text` + `data` of `cc -std=c99 -Os -c {prefix}.c && size {prefix}.o` (with the
compiler of your target); RAM is `sizeof({prefix}_t)`, which the example prints, and the stack.
"""

_README = """\
# {name} in C

The supervisor of {name} and its executor as portable C99: no allocation, no recursion, no global variable.
`{prefix}.h` documents the functions, `main.c` shows them at work.

{build}
{requirements}## Use

1. `{prefix}_init` with settings (NULL: the default ones) and callbacks, then `{prefix}_start`.
2. `{prefix}_tick` once a period: at most one request is issued, through a callback.
3. What comes goes to the functions below; `{prefix}_watch` in between if the period is long.
4. On a signal `{prefix}_stop`; after a fault or a stop `{prefix}_restart`.

All of it from one thread, with the time in microseconds since any moment. A callback must not call the executor.
{goals}
```c
{functions}
```

The state is in `{prefix}_t.state`: numbers of states (`{upper}_STATE_...`), of locations (`{upper}_AT_...`), of values
of enums (`{upper}_VALUE_...`), and the variables as they are. `{prefix}_enabled` says whether an event is allowed now.

## What is different from the Python executor

- The policy `random` draws from another generator (splitmix64): the same seed gives another sequence.
- The counters count entries of the log; one entry may list several unknown values.
- The event log and the state topic are the caller's, made from the `log` callback and the state.
- Received data is typed: what does not fit is for the caller to give as unknown.
"""


_GOALS = """
A cancel is an event of the model when it has happened, not when `cancel_goal` is called. Until then the goal is
executing, whatever its server does meanwhile. Its end goes to `..._succeeded_...`, or to `{prefix}_goal_ended`, which
takes how it ended (`{upper}_OUTCOME_...`): say CANCELLED only when what it moved is at rest. `{prefix}_cancelling`
returns whether the goal of an action is being cancelled, why, and since when. One that has not ended within
`cancel_timeout_us` is reported to `log`, and goes on executing.
"""

_LAYER_README = """\
# {name} in C: supervision layer

A supervision layer between an existing controller, the *caller*, and the robot, as portable C99: no allocation, no
recursion, no global variable. It decides nothing: what the caller sends is let through if the supervisor allows it
now, else held back. `{prefix}.h` documents the functions, `main.c` shows them at work.

{build}
{requirements}## Use

1. `{prefix}_init` with settings (NULL: the default ones) and callbacks, then `{prefix}_start`.
2. What the caller sends goes to the first functions below, never to the robot: the layer sends it on through `publish`,
   `call` or `send_goal`, or reports to `blocked` why not.
3. What the robot sends goes to the others; the layer hands it on to the caller (`pass_on`, `answer`, `pass_feedback`,
   `end_goal`). What the model does not know is the program's to pass on or not.
4. `{prefix}_watch` at least every 100 ms: a caller that fell silent, stale sensors, replies that did not come.
5. On a signal `{prefix}_stop`; after a fault or a stop `{prefix}_restart`.

All of it from one thread, with the time in microseconds since any moment. A callback must not call the layer.
{goals}
```c
{functions}
```

`what` says of the caller's message where it is (a pointer that the callback gets back), whether all of it is finite
and whether it is all-default. Only the program knows that: the message may have fields that the model does not have.
What is not said to be finite is held back.

The state is in `{prefix}_t.state`: numbers of states (`{upper}_STATE_...`), of locations (`{upper}_AT_...`), of values
of enums (`{upper}_VALUE_...`), and the variables as they are. `{prefix}_enabled` says whether an event is allowed now.

## What is different from the Python layer

- The counters count entries of the log; one entry may list several unknown values.
- The event log and the state topic are the program's, made from the `log` callback and the state.
- Received data is typed: what does not fit is for the program to give as unknown.
"""


def readme_file(unit: Unit) -> str:
    """The text of `README.md` after its head."""
    layout = unit.layout
    functions = [head for _, head in request_heads(layout)] if layout.is_layer else []
    functions += [
        receive_head(layout, identifier) for identifier in layout.received_topics if batch(layout, identifier)
    ]
    for item in layout.model.communications:
        if item.kind is CommunicationKind.ACTION:
            functions.append(reply_head(layout, item.event(EventKind.FEEDBACK)))
        if item.kind in (CommunicationKind.ACTION, CommunicationKind.SERVICE):
            functions.append(reply_head(layout, item.event(EventKind.RESPONSE)))
    has_goals = bool(layout.of_kind(CommunicationKind.ACTION))
    return (_LAYER_README if layout.is_layer else _README).format(
        name=layout.model.name,
        prefix=layout.prefix,
        build=_BUILD.format(prefix=layout.prefix),
        requirements=requirements_chapter(layout.model),
        upper=layout.upper,
        goals=_GOALS.format(prefix=layout.prefix, upper=layout.upper) if has_goals else "",
        functions="\n".join(f"{function};" for function in functions) or "/* Nothing comes. */",
    )
