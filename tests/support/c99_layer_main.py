"""A test program around a generated C layer: reads commands from its standard input, prints all that happens."""

import re

from robosc.expressions import Type
from robosc.model.structure import Communication, CommunicationKind
from robosc.supervisor import Supervisor
from robosc.targets.code.c.header import receive_head, reply_head
from robosc.targets.code.c.layer import call_head, cancel_head, goal_head, request_head, request_parameters
from robosc.targets.code.c.layout import Layout, event_data, groups, sharing
from support.c99_main import _TOP, BEGIN, END, LOG, _Program, batch_types, events_back

TOKENS = 4096
"""Messages are distinguished by their address in an array of this length."""

CALLBACKS = (
    *("publish", "default", "call", "goal", "cancel", "pass", "blocked"),
    *("answer", "no_answer", "accept", "reject", "feedback", "end"),
)
"""Names of the callbacks here, in the order of the struct; also the bits of those that are to fail."""

_ABORT_REASON = """
#if @P@_ACTION_COUNT > 0
#define ABORT_REASON(action) ((int)@p@_abort_reason(&r, action))
#else
#define ABORT_REASON(action) (-1)
#endif
"""

_CALLBACK = """
static bool do_@name@(void *context@parameters@)
{
    (void)context;
    if (failing & @flag@) {
        return false;
    }
    printf(@format@);
    return true;
}
"""

_SET_NUMBER = """
static bool do_set_number(void *context, const void *message, @p@_number_t number, double value)
{
    (void)context;
    printf("set %d %d %.17g\\n", token(message), (int)number, value);
    return true;
}
"""

_IN_HEXADECIMAL = """
static const char *in_hexadecimal(const char *text)
{
    static char result[512];
    size_t length = 0;
    result[length++] = 'x';
    for (; *text; text++) {
        length += (size_t)sprintf(result + length, "%02x", (unsigned)(unsigned char)*text);
    }
    result[length] = 0;
    return result;
}
"""

_COMMUNICATION = "@p@_communication_t communication"
_MESSAGE, _CALLER = "const void *message", "uint32_t caller_id"
_TOPIC, _SOURCE = "@p@_topic_t topic", "@p@_source_t source"
_SIGNATURES: dict[str, tuple[str, ...]] = {
    "publish": (_TOPIC, _MESSAGE),
    "default": (_TOPIC,),
    "call": ("uint32_t id", _COMMUNICATION, _MESSAGE),
    "goal": ("uint32_t id", _COMMUNICATION, _MESSAGE),
    "cancel": (_COMMUNICATION, "uint32_t id"),
    "pass": (_SOURCE, _MESSAGE),
    "blocked": ("const char *identifier", "@p@_refusal_t why"),
    "answer": (_COMMUNICATION, _CALLER, _MESSAGE),
    "no_answer": (_COMMUNICATION, _CALLER),
    "accept": (_COMMUNICATION, _CALLER),
    "reject": (_COMMUNICATION, _CALLER),
    "feedback": (_COMMUNICATION, _CALLER, _MESSAGE),
    "end": (_COMMUNICATION, _CALLER, "@p@_end_t end", _MESSAGE),
}

_MAIN = (
    LOG.replace("@more@", '"blocked"')
    + """
static void do_new(void)
{
    static const @p@_callbacks_t callbacks = {NULL, @callbacks@, do_log};
    @p@_settings_t settings;
    @p@_default_settings(&settings);
    failing = 0;
    settings.on_unknown = (@p@_on_unknown_t)read_integer();
    settings.service_timeout_us = read_time();
    settings.action_timeout_us = read_time();
    settings.cancel_timeout_us = read_time();
    settings.command_timeout_us = read_time();
"""
    + BEGIN
    + """        case 'm': {
            const int source = (int)read_integer();
            do_receive(source, now_us, read_message());
            break;
        }
        case 'q': do_request((int)read_integer(), now_us); break;
        case 'b': {
            const int event = (int)read_integer();
            const uint32_t id = read_id();
            do_back(event, now_us, id, read_message());
            break;
        }
#if @P@_SERVICE_COUNT > 0
        case 'f': @p@_call_failed(&r, now_us, read_id()); break;
#endif
#if @P@_ACTION_COUNT > 0
        case 'a': @p@_goal_accepted(&r, now_us, read_id()); break;
        case 'e': {
            const uint32_t id = read_id();
            const @p@_outcome_t outcome = (@p@_outcome_t)read_integer();
            @p@_goal_ended(&r, now_us, id, outcome, read_message());
            break;
        }
"""
    + END
)


class _LayerProgram(_Program):
    """The test program of a layer."""

    def cases(self, name: str, parameters: str, calls: list[str]) -> str:
        """A function that makes one of some calls."""
        lines = [f"static void {name}({parameters})", "{", "    (void)now_us;"]
        lines += [f"    (void){word};" for word in ("id", "message") if re.search(rf"\b{word}\b", parameters)]
        lines += ["    switch (number) {", *(f"    case {place}: {call}" for place, call in enumerate(calls))]
        return "\n".join([*lines, "    default: break;", "    }", "}", ""])

    def call_with(self, head: str, types: list[Type], *around: str) -> str:
        """A call with data that is read, between or after other arguments."""
        function = re.match(r"void (\w+)\(", head)
        assert function is not None
        lines, data = [], []
        for number, type_ in enumerate(types):
            if self.layout.is_by_pointer(type_):
                raw = self.layout.raw(type_)
                lines.append(f"{raw} data_{number}; const bool is_{number} = read_integer() != 0;")
                lines.append(f"if (is_{number}) {{ data_{number} = {self.reader(type_)}(); }}")
                data.append(f"is_{number} ? &data_{number} : NULL")
            else:
                lines.append(f"{self.layout.raw(type_)} data_{number} = {self.reader(type_)}();")
                data.append(f"data_{number}")
        arguments = [item for word in around for item in (data if word == "@data" else [word])]
        return f"{{ {' '.join(lines)} {function.group(1)}({', '.join(['&r', 'now_us', *arguments])}); break; }}"

    def callbacks(self) -> list[str]:
        """Names of the callbacks of this layer."""
        return [*(["set_number"] if self.layout.numbers else []), *CALLBACKS]

    def text(self) -> str:
        layout = self.layout
        receive = [
            self.call_with(receive_head(layout, identifier), batch_types(layout, identifier), "@data", "message")
            for identifier in layout.received_topics
        ]
        back = []
        for event in events_back(layout):
            data = event_data(layout.model, event)
            types = [] if data is None else [data]
            back.append(self.call_with(reply_head(layout, event), types, "id", "@data", "message"))
        asked = []
        for identifier in layout.topics:
            group = sharing(layout.model, CommunicationKind.INCOMING_MESSAGE, identifier)
            types = [layout.source(type_) for _, type_ in request_parameters(layout, group).values()]
            call = self.call_with(request_head(layout, identifier), types, "@data", "what")
            asked.append(f"{{ const @p@_sent_t what = read_sent(); {call} break; }}")
        for head, parameters in _caller_heads(layout):
            what = ["what"] if "_sent_t" in head else []
            read = "const @p@_sent_t what = read_sent(); " if what else ""
            call = self.call_with(head, [layout.source(type_) for type_ in parameters], "caller_id", "@data", *what)
            asked.append(f"{{ const uint32_t caller_id = read_id(); {read}{call} break; }}")
        resets = "".join(f" {pool}_used = 0;" for pool in self.pools)
        parts = [
            _TOP,
            f"static const char tokens[{TOKENS}] = {{0}};",
            "static int token(const void *message) "
            "{ return message == NULL ? -1 : (int)((const char *)message - tokens); }",
            _IN_HEXADECIMAL,
            "static const void *read_message(void) "
            "{ const int64_t number = read_integer(); return number < 0 ? NULL : &tokens[number]; }",
            "static @p@_sent_t read_sent(void)\n{\n    @p@_sent_t what;\n    what.message = read_message();",
            "    what.is_finite = read_integer() != 0;\n    what.is_default = read_integer() != 0;",
            "    return what;\n}",
            *self.readers.values(),
            f"static void reset_pools(void) {{{resets} }}\n",
            self.cases("do_receive", "int number, uint64_t now_us, const void *message", receive),
            self.cases("do_back", "int number, uint64_t now_us, uint32_t id, const void *message", back),
            self.cases("do_request", "int number, uint64_t now_us", asked),
            self.print_state(),
            _ABORT_REASON,
            *([_SET_NUMBER] if layout.numbers else []),
            *(_callback(name, place) for place, name in enumerate(CALLBACKS)),
            _MAIN.replace("@callbacks@", ", ".join(f"do_{name}" for name in self.callbacks())),
        ]
        return "\n".join(parts).replace("@p@", layout.prefix).replace("@P@", layout.upper)


def _caller_heads(layout: Layout) -> list[tuple[str, list[Type]]]:
    """The functions for the caller's calls, goals and cancels, with the types of the data that they look at."""

    def types(group: tuple[Communication, ...]) -> list[Type]:
        return [type_ for _, type_ in request_parameters(layout, group).values()]

    heads = [(call_head(layout, group), types(group)) for group in groups(layout.model, CommunicationKind.SERVICE)]
    for group in groups(layout.model, CommunicationKind.ACTION):
        heads += [(goal_head(layout, group), types(group)), (cancel_head(layout, group[0].name), [])]
    return heads


def _callback(name: str, place: int) -> str:
    parameters = _SIGNATURES[name]
    formats, arguments = [name], []
    for parameter in parameters:
        word = parameter.replace("*", "").split()[-1]
        formats.append("%s" if word == "identifier" else "%d")
        shown = {"identifier": "in_hexadecimal(identifier)", "message": "token(message)"}
        arguments.append(shown.get(word, f"(int){word}"))
    if name == "end":
        # The reason of an aborted goal belongs to its end, though a caller asks for it.
        formats.append("%d")
        arguments.append("end == @P@_END_ABORTED ? ABORT_REASON(communication) : -1")
    text = _CALLBACK.replace("@name@", name).replace("@flag@", str(2**place))
    text = text.replace("@format@", ", ".join([f'"{" ".join(formats)}\\n"', *arguments]))
    return text.replace("@parameters@", "".join(f", {parameter}" for parameter in parameters))


def layer_program(supervisor: Supervisor) -> str:
    """The text of a test program."""
    return _LayerProgram(supervisor, None).text()
