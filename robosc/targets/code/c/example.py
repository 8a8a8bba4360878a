"""The generated `main.c` of a controller: a run with callbacks that print, without any replies."""

from robosc.model.structure import CommunicationKind
from robosc.targets.code.c.header import head
from robosc.targets.code.c.layout import Layout
from robosc.targets.code.c.unit import Unit

_MAIN = """\
/* An example: {purpose}. */

#include "{prefix}.h"

#include <inttypes.h>
#include <stdio.h>

{callbacks}
static void print_log(void *context, {prefix}_log_t kind, int what)
{{
    (void)context;
    if (kind == {upper}_LOG_EVENT) {{
        const char *name = {prefix}_event_name(what);
        printf("event %s\\n", name != NULL ? name : "?");
    }}
{cancelling}}}

int main(void)
{{
    static {prefix}_t {subject};
    {prefix}_callbacks_t callbacks = {{0}};
    uint64_t now_us = 0;
{settings}
    callbacks.log = print_log;
    if (!{prefix}_init(&{subject}, NULL, &callbacks)) {{
        return 1;
    }}
    printf("%lu bytes of RAM\\n", (unsigned long)sizeof {subject});
    {prefix}_start(&{subject}, now_us);
    for (int period = 0; period < 10; period++) {{
        now_us += UINT64_C(100000);
{period}
    }}
    printf("status %d after %" PRIu64 " us\\n", (int){prefix}_status(&{subject}, now_us), now_us);
    {prefix}_stop(&{subject}, now_us, false);
    return 0;
}}
"""

_PUBLISH = """\
static bool print_publish(void *context, const {prefix}_request_t *request)
{{
    (void)context;
    printf("publish %s\\n", {prefix}_communication_name((int)request->communication));
    return true;
}}
"""

PUBLISH_DEFAULT = """\
static bool print_default(void *context, {prefix}_topic_t topic)
{{
    (void)context;
    printf("default message on %s\\n", {prefix}_topic_name((int)topic));
    return true;
}}
"""

_SEND = """\
static bool print_{kind}(void *context, uint32_t id, const {prefix}_request_t *request)
{{
    (void)context;
    printf("{kind} %s, id %" PRIu32 "\\n", {prefix}_communication_name((int)request->communication), id);
    return true;
}}
"""

_CANCELLING = """\
    if (kind == {upper}_LOG_CANCELLING) {{
        printf("cancelling %s\\n", {prefix}_communication_name(what));
    }}
    if (kind == {upper}_LOG_CANCEL_OVERDUE) {{
        printf("%s has not ended in time after its cancel\\n", {prefix}_communication_name(what));
    }}
"""

CANCEL = """\
static bool print_cancel(void *context, {prefix}_communication_t action, uint32_t id)
{{
    (void)context;
    printf("cancel %s, id %" PRIu32 "\\n", {prefix}_communication_name((int)action), id);
    return true;
}}
"""


def example_file(unit: Unit) -> str:
    """The text of `main.c`."""
    prefix = unit.layout.prefix
    texts: list[str] = []
    settings: list[str] = []
    if unit.layout.of_kind(CommunicationKind.INCOMING_MESSAGE):
        texts += [_PUBLISH, PUBLISH_DEFAULT]
        settings += ["publish = print_publish", "publish_default = print_default"]
    if unit.layout.of_kind(CommunicationKind.SERVICE):
        texts.append(_SEND.replace("{kind}", "call"))
        settings.append("call = print_call")
    if unit.layout.of_kind(CommunicationKind.ACTION):
        texts += [_SEND.replace("{kind}", "send_goal"), CANCEL]
        settings += ["send_goal = print_send_goal", "cancel_goal = print_cancel"]
    tick = f"        {prefix}_tick(&robot, now_us);"
    purpose = "some periods of the robot with nothing but what happens by itself"
    return main_text(unit.layout, "robot", purpose, texts, settings, tick)


def main_text(
    layout: Layout, subject: str, purpose: str, callbacks: list[str], settings: list[str], period: str
) -> str:
    """Return the text of a `main.c`.

    Args:
        layout: Names.
        subject: Name of the variable.
        purpose: Description of what it is an example of.
        callbacks: Functions, with `{prefix}` in place of the prefix.
        settings: Assignments to the callbacks.
        period: Statements of one period.
    """
    has_goals = bool(layout.of_kind(CommunicationKind.ACTION))
    text = _MAIN.format(
        prefix=layout.prefix,
        upper=layout.upper,
        subject=subject,
        purpose=purpose,
        callbacks="\n".join(item.format(prefix=layout.prefix) for item in callbacks),
        settings="".join(f"\n    callbacks.{item};" for item in settings).lstrip("\n"),
        period=period,
        cancelling=_CANCELLING.format(prefix=layout.prefix, upper=layout.upper) if has_goals else "",
    )
    return f"{head(layout.supervisor)}\n{text}"
