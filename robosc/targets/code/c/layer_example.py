"""The generated `main.c` of a supervision layer: a caller that makes every request, and a robot that sends nothing."""

from robosc.model.structure import CommunicationKind
from robosc.targets.code.c.example import CANCEL, PUBLISH_DEFAULT, main_text
from robosc.targets.code.c.layer import request_parameters
from robosc.targets.code.c.layout import Layout, groups
from robosc.targets.code.c.received import unknown_name
from robosc.targets.code.c.unit import Unit
from robosc.targets.text import indent

_BLOCKED = """\
static bool print_blocked(void *context, const char *identifier, {prefix}_refusal_t why)
{{
    (void)context;
    printf("blocked %s, reason %d\\n", identifier, (int)why);
    return true;
}}
"""

_PASS_ON = """\
static bool print_pass_on(void *context, {prefix}_source_t source, const void *message)
{{
    (void)context;
    (void)message;
    printf("pass on %s\\n", {prefix}_source_name((int)source));
    return true;
}}
"""

_SET_NUMBER = """\
static bool print_set_number(void *context, const void *message, {prefix}_number_t number, double value)
{{
    (void)context;
    (void)message;
    printf("%s becomes %g\\n", {prefix}_number_name((int)number), value);
    return true;
}}
"""

_PUBLISH = """\
static bool print_publish(void *context, {prefix}_topic_t topic, const void *message)
{{
    (void)context;
    (void)message;
    printf("publish on %s\\n", {prefix}_topic_name((int)topic));
    return true;
}}
"""

_SEND = """\
static bool print_{kind}(void *context, uint32_t id, {prefix}_communication_t what, const void *message)
{{
    (void)context;
    (void)message;
    printf("{kind} %s, id %" PRIu32 "\\n", {prefix}_communication_name((int)what), id);
    return true;
}}
"""

_TELL = """\
static bool print_{kind}(void *context, {prefix}_communication_t what, uint32_t caller_id)
{{
    (void)context;
    printf("to the caller: {kind} %s, its id %" PRIu32 "\\n", {prefix}_communication_name((int)what), caller_id);
    return true;
}}
"""

_HAND_ON = """\
static bool print_{kind}(void *context, {prefix}_communication_t what, uint32_t caller_id, const void *message)
{{
    (void)context;
    (void)message;
    printf("to the caller: {kind} %s, its id %" PRIu32 "\\n", {prefix}_communication_name((int)what), caller_id);
    return true;
}}
"""

_END = """\
static bool print_end(void *context, {prefix}_communication_t action, uint32_t caller_id, {prefix}_end_t end,
                      const void *message)
{{
    (void)context;
    (void)message;
    printf("to the caller: end %d of %s, its id %" PRIu32 "\\n", (int)end,
           {prefix}_communication_name((int)action), caller_id);
    return true;
}}
"""


def layer_example_file(unit: Unit) -> str:
    """The text of `main.c`."""
    layout = unit.layout
    texts: list[str] = []
    settings: list[str] = []
    if layout.requests:
        texts.append(_BLOCKED)
        settings.append("blocked = print_blocked")
    if layout.numbers:
        texts.append(_SET_NUMBER)
        settings.append("set_number = print_set_number")
    if layout.received_topics:
        texts.append(_PASS_ON)
        settings.append("pass_on = print_pass_on")
    if layout.topics:
        texts += [_PUBLISH, PUBLISH_DEFAULT]
        settings += ["publish = print_publish", "publish_default = print_default"]
    if layout.of_kind(CommunicationKind.SERVICE):
        texts += [_SEND.replace("{kind}", "call"), _HAND_ON.replace("{kind}", "answer")]
        texts.append(_TELL.replace("{kind}", "answer_default"))
        settings += ["call = print_call", "answer = print_answer", "answer_default = print_answer_default"]
    if layout.of_kind(CommunicationKind.ACTION):
        texts += [_SEND.replace("{kind}", "send_goal"), CANCEL, _TELL.replace("{kind}", "accept_goal")]
        texts += [_TELL.replace("{kind}", "reject_goal"), _HAND_ON.replace("{kind}", "pass_feedback"), _END]
        settings += ["send_goal = print_send_goal", "cancel_goal = print_cancel", "accept_goal = print_accept_goal"]
        settings += ["reject_goal = print_reject_goal", "pass_feedback = print_pass_feedback", "end_goal = print_end"]
    period = [*_requests(layout), f"{layout.prefix}_watch(&layer, now_us);"]
    purpose = "a caller that asks for everything once a period, and a robot that says nothing"
    return main_text(layout, "layer", purpose, texts, settings, "\n".join(indent(period, 2)))


def _requests(layout: Layout) -> list[str]:
    """Statements that ask for everything, with data of which nothing is known."""
    if not layout.requests:
        return []
    lines = [
        "/* This example has no messages; that they are finite must be found out where they come from. */",
        f"const {layout.prefix}_sent_t what = {{NULL, true, false}};",
    ]
    for kind, purpose in (
        (CommunicationKind.INCOMING_MESSAGE, "request"),
        (CommunicationKind.SERVICE, "call"),
        (CommunicationKind.ACTION, "goal"),
    ):
        for group in groups(layout.model, kind):
            data = [
                f"&{unknown_name(raw)}" if layout.is_by_pointer(type_) else _UNKNOWN[raw].format(upper=layout.upper)
                for raw, (_, type_) in request_parameters(layout, group).items()
            ]
            is_message = kind is CommunicationKind.INCOMING_MESSAGE
            number = [] if is_message else ["(uint32_t)period"]
            arguments = ", ".join(["&layer", "now_us", *number, *data, "what"])
            name = group[0].identifier if is_message else group[0].name
            lines.append(f"{layout.function(purpose, name)}({arguments});")
    return lines


_UNKNOWN = {"int8_t": "{upper}_UNKNOWN", "int64_t": "{upper}_UNKNOWN_INTEGER", "double": "0.0", "const char *": "NULL"}
"""Data of which nothing is known; a number stands for a double, since its NaN needs a header."""
