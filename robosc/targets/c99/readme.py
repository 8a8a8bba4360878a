"""The generated README: what there is, how to build it, what it needs."""

from robosc.model.structure import CommunicationKind, EventKind
from robosc.targets.c99.header import batch, receive_head, reply_head
from robosc.targets.c99.unit import Unit

_README = """\
# {name} in C

The supervisor of {name} and its executor as portable C99: no allocation, no recursion, no global variable.
`{prefix}.h` documents the functions, `main.c` shows them at work.

## Build

```
cmake -S . -B build && cmake --build build && ./build/{prefix}_example
```

or without CMake: `cc -std=c99 -O2 -ffp-contract=off {prefix}.c main.c -lm -o example`.
Not with `-ffast-math`: NaN stands for what is unknown.

What this model needs: flash is `text` + `data` of `cc -std=c99 -Os -c {prefix}.c && size {prefix}.o` (with the
compiler of your target); RAM is `sizeof({prefix}_t)`, which the example prints, and the stack.

## Use

1. `{prefix}_init` with settings (NULL: the default ones) and callbacks, then `{prefix}_start`.
2. `{prefix}_tick` once a period: at most one request is issued, through a callback.
3. What comes goes to the functions below; `{prefix}_watch` in between if the period is long.
4. On a signal `{prefix}_stop`; after a fault or a stop `{prefix}_restart`.

All of it from one thread, with the time in microseconds since any moment. A callback must not call the executor.

```c
{functions}
```

The state is in `{prefix}_t.state`: numbers of states (`{upper}_STATE_...`), of locations (`{upper}_AT_...`), of values
of enums (`{upper}_VALUE_...`), and the variables as they are. `{prefix}_enabled` tells whether an event is allowed now.

## What is different from the Python executor

- The policy `random` draws from another generator (splitmix64): the same seed gives another sequence.
- The counters count entries of the log; one entry may tell several unknown values.
- The event log and the state topic are the caller's, made from the `log` callback and the state.
- Received data is typed: what does not fit is for the caller to tell as unknown.
"""


def readme_file(unit: Unit) -> str:
    """The text of `README.md` after its head."""
    layout = unit.layout
    functions = [receive_head(layout, identifier) for identifier in layout.received_topics if batch(layout, identifier)]
    for item in layout.model.communications:
        if item.kind is CommunicationKind.ACTION:
            functions.append(reply_head(layout, item.event(EventKind.FEEDBACK)))
        if item.kind in (CommunicationKind.ACTION, CommunicationKind.SERVICE):
            functions.append(reply_head(layout, item.event(EventKind.RESPONSE)))
    return _README.format(
        name=layout.model.name,
        prefix=layout.prefix,
        upper=layout.upper,
        functions="\n".join(f"{function};" for function in functions) or "/* Nothing comes. */",
    )
