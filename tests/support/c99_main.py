"""A generic test program around generated C: reads commands from its standard input, prints all that happens."""

import re

from robosc.automata.executable import CALLED_KINDS
from robosc.automata.plants import communication_plant_name
from robosc.expressions import (
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    NoneType,
    ObjectType,
    StringType,
    Type,
)
from robosc.model.structure import CommunicationKind
from robosc.supervisor import Supervisor
from robosc.targets.code.c.header import batch, batch_parameters, receive_head, reply_head
from robosc.targets.code.c.layout import Layout, event_data
from robosc.targets.code.c.provide import Field, request_field
from robosc.targets.code.c.source import source_file
from robosc.targets.code.c.unit import make_unit
from support.c99_changes import check_changes

_TOP = """
#include "@p@.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char words[8192][2048];
static int failing;

static const char *next_word(void)
{
    static char word[4096];
    if (scanf("%4095s", word) != 1) {
        exit(0);
    }
    return word;
}

static int64_t read_integer(void) { return (int64_t)strtoll(next_word(), NULL, 10); }
static uint64_t read_time(void) { return (uint64_t)strtoull(next_word(), NULL, 10); }
static uint32_t read_id(void) { return (uint32_t)strtoul(next_word(), NULL, 10); }
static int8_t read_boolean(void) { return (int8_t)read_integer(); }
static double read_double(void) { return strtod(next_word(), NULL); }
static int word_count;

static const char *read_string(void)
{
    const char *word = next_word();
    char *text = words[word_count];
    size_t length = (strlen(word) - 1) / 2;
    if (word[0] == '?') {
        return NULL;
    }
    word_count++;
    for (size_t k = 0; k < length; k++) {
        char digits[3] = {word[1 + 2 * k], word[2 + 2 * k], 0};
        text[k] = (char)strtol(digits, NULL, 16);
    }
    text[length] = 0;
    return text;
}

static void print_text(const char *text)
{
    printf("x");
    for (; *text; text++) {
        printf("%02x", (unsigned)(unsigned char)*text);
    }
}

static @p@_t r;
"""

LOG = """#if @P@_ACTION_COUNT > 0
static void print_reason(int action)
{
    const @p@_cancelling_t found = @p@_cancelling(&r, (@p@_communication_t)action);
    switch (found.why) {
    case @P@_CANCEL_REQUIREMENT: printf(" requirement"); break;
    case @P@_CANCEL_TIMEOUT: printf(" timeout"); break;
    case @P@_CANCEL_STOP: printf(" stop"); break;
    case @P@_CANCEL_NONE: printf(" nothing"); break;
    default: printf(" caller"); break;
    }
    for (int place = 0; place < @P@_REQUIREMENT_COUNT; place++) {
        if (found.turned[place]) {
            printf(" %d", place + 1);
        }
    }
}
#else
static void print_reason(int action) { (void)action; }
#endif

static void do_log(void *context, @p@_log_t kind, int what)
{
    static const char *const kinds[]
        = {"event", "unexpected", "unknown",
#if @P@_LIMIT_COUNT > 0
           "limited",
#endif
           "release", "fault", "stop", "resume", "cancelling", "cancel_overdue", "restart", @more@};
    (void)context;
    if (kind == @P@_LOG_CANCELLING || kind == @P@_LOG_CANCEL_OVERDUE) {
        printf("log %s %d", kinds[kind], what);
        if (kind == @P@_LOG_CANCELLING) {
            print_reason(what);
        }
        printf("\\n");
    } else if (kind == @P@_LOG_FAULT || kind == @P@_LOG_STOP || kind == @P@_LOG_RESTART || kind == @P@_LOG_RESUME) {
        printf("log %s\\n", kinds[kind]);
    } else {
        printf("log %s %d\\n", kinds[kind], what);
    }
}
"""
"""The callback `log` of either deployment."""

BEGIN = """    for (int k = 0; k < @P@_COMMUNICATION_COUNT; k++) {
        settings.max_age_us[k] = read_time();
    }
    for (int k = 0; k < @P@_TOPIC_COUNT; k++) {
        settings.releases[k] = read_integer() != 0;
    }
    if (!@p@_init(&r, &settings, &callbacks)) {
        printf("refused\\n");
    }
}

int main(void)
{
    for (;;) {
        const char command = next_word()[0];
        const uint64_t now_us = command == 'n' || command == 'x' ? 0 : read_time();
        word_count = 0;
        reset_pools();
        switch (command) {
        case 'n': do_new(); break;
        case 'x': failing = (int)read_integer(); break;
        case 's': @p@_start(&r, now_us); break;
        case 'w': @p@_watch(&r, now_us); break;
        case 'S': @p@_stop(&r, now_us, read_integer() != 0); break;
        case 'R': @p@_restart(&r, now_us); break;
"""
"""Common part of the program: the last settings, and commands of either deployment."""

END = """        case 'c': {
            const uint32_t id = read_id();
            @p@_cancel_refused(&r, now_us, id, read_integer() != 0);
            break;
        }
#endif
        default: printf("what?\\n"); return 1;
        }
        print_state(now_us);
        fflush(stdout);
    }
}
"""
"""End of the program: the last command of either deployment, and what follows each."""

_CALLBACKS = (
    LOG.replace("@more@", '"reached", "approach", "owed", "met"')
    + """
static bool do_publish(void *context, const @p@_request_t *request)
{
    (void)context;
    if (failing & 1) {
        return false;
    }
    printf("publish ");
    print_request(request);
    return true;
}

static bool do_default(void *context, @p@_topic_t topic)
{
    (void)context;
    if (failing & 2) {
        return false;
    }
    printf("default %d\\n", (int)topic);
    return true;
}

static bool do_call(void *context, uint32_t id, const @p@_request_t *request)
{
    (void)context;
    if (failing & 4) {
        return false;
    }
    printf("call %" PRIu32 " ", id);
    print_request(request);
    return true;
}

static bool do_goal(void *context, uint32_t id, const @p@_request_t *request)
{
    (void)context;
    if (failing & 8) {
        return false;
    }
    printf("goal %" PRIu32 " ", id);
    print_request(request);
    return true;
}

static bool do_cancel(void *context, @p@_communication_t action, uint32_t id)
{
    (void)context;
    if (failing & 16) {
        return false;
    }
    printf("cancel %" PRIu32 " %d\\n", id, (int)action);
    return true;
}

static bool do_fits(void *context, const @p@_request_t *request)
{
    (void)context;
    return !(failing & 32) || (int)request->communication % 2 == 0;
}

static void do_new(void)
{
    static const @p@_callbacks_t callbacks
        = {NULL, do_publish, do_default, do_call, do_goal, do_cancel, do_fits, do_log};
    @p@_settings_t settings;
    @p@_default_settings(&settings);
    failing = 0;
    settings.policy = (@p@_policy_t)read_integer();
    settings.priority_count = (int)read_integer();
    for (int k = 0; k < settings.priority_count; k++) {
        settings.priority[k] = (@p@_communication_t)read_integer();
    }
    settings.seed = read_time();
    settings.decides_after_batch = read_integer() != 0;
    settings.on_unknown = (@p@_on_unknown_t)read_integer();
    settings.service_timeout_us = read_time();
    settings.action_timeout_us = read_time();
    settings.cancel_timeout_us = read_time();
@assumption_timeout@
"""
    + BEGIN
    + """        case 't': @p@_tick(&r, now_us); break;
        case 'm': do_receive((int)read_integer(), now_us); break;
        case 'b': {
            const int event = (int)read_integer();
            do_back(event, now_us, read_id());
            break;
        }
#if @P@_SERVICE_COUNT > 0
        case 'f': @p@_call_failed(&r, now_us, read_id()); break;
#endif
#if @P@_ACTION_COUNT > 0
        case 'a': @p@_goal_accepted(&r, now_us, read_id()); break;
        case 'e': {
            const uint32_t id = read_id();
            @p@_goal_ended(&r, now_us, id, (@p@_outcome_t)read_integer());
            break;
        }
"""
    + END
)


_PRINT_PROGRESS = """\
    printf(" progress %d %d", @p@_approached(&r), @p@_chosen(&r));
    for (int number = 0; number < @P@_AIM_COUNT + @P@_ASSUMPTION_COUNT; number++) {
        const @p@_standing_t found = @p@_standing(&r, number, now_us);
        printf(" %d %d %d %" PRIu32 " %" PRIu64, found.is_met, found.is_unmet, found.is_overdue, found.count,
               found.unmet_us);
    }
    for (int number = 0; number < @P@_MISSION_COUNT; number++) {
        const @p@_mission_t found = @p@_mission(&r, number);
        printf(" %d %d %" PRIu32, found.visit, found.is_round, found.rounds);
        for (int detour = 0; detour < found.detours; detour++) {
            printf(" %d", @p@_detour(&r, number, detour));
        }
    }"""


class _Program:
    def __init__(self, supervisor: Supervisor, prefix: str | None) -> None:
        self.unit = make_unit(supervisor, prefix)
        source_file(self.unit)
        self.layout: Layout = self.unit.layout
        self.readers: dict[str, str] = {}
        self.pools: list[str] = []

    def reader(self, type_: Type) -> str:
        """The function that reads a datum of a type."""
        type_ = self.layout.source(type_)
        match type_:
            case BooleanType():
                return "read_boolean"
            case IntegerType():
                return "read_integer"
            case DoubleType():
                return "read_double"
            case StringType():
                return "read_string"
        raw = self.layout.raw(type_)
        name = f"read_{raw}"
        if raw in self.readers:
            return name
        if isinstance(type_, ObjectType):
            body = [f"{raw} data;", "memset(&data, 0, sizeof data);"]
            for part in self.layout.model.object(type_.name).properties:
                if not isinstance(part.type, NoneType):
                    member = self.layout.properties[type_.name, part.name]
                    body.append(f"data.{member} = {self.reader(part.type)}();")
        else:
            assert isinstance(type_, ArrayType)
            element, inner = self.layout.raw_element(type_.element), self.reader(type_.element)
            pool = f"pool_{raw}"
            self.pools.append(pool)
            self.readers[pool] = f"static {element} {pool}[65536]; static size_t {pool}_used;\n"
            body = [
                f"{raw} data = {{NULL, 0}};",
                "int64_t count = read_integer();",
                "if (count < 0) { return data; }",
                f"{element} *items = &{pool}[{pool}_used];",
                f"{pool}_used += (size_t)count;",
                f"for (int64_t k = 0; k < count; k++) {{ items[k] = {inner}(); }}",
                "data.items = items; data.length = (size_t)count;",
            ]
        self.readers[raw] = f"static {raw} {name}(void)\n{{\n    " + "\n    ".join([*body, "return data;"]) + "\n}\n"
        return name

    def call(self, head: str, types: list[Type], fixed: list[str]) -> str:
        """A call with data that is read."""
        function = re.match(r"void (\w+)\(", head)
        assert function is not None
        lines, arguments = [], ["&r", "now_us", *fixed]
        for number, type_ in enumerate(types):
            if self.layout.is_by_pointer(type_):
                raw = self.layout.raw(type_)
                lines.append(f"{raw} data_{number}; const bool is_{number} = read_integer() != 0;")
                lines.append(f"if (is_{number}) {{ data_{number} = {self.reader(type_)}(); }}")
                arguments.append(f"is_{number} ? &data_{number} : NULL")
            else:
                lines.append(f"{self.layout.raw(type_)} data_{number} = {self.reader(type_)}();")
                arguments.append(f"data_{number}")
        return "{ " + " ".join(lines) + f" {function.group(1)}({', '.join(arguments)}); break; }}"

    def text(self) -> str:
        layout = self.layout
        receive = [
            f"    case {number}: {self.call(receive_head(layout, identifier), batch_types(layout, identifier), [])}"
            for number, identifier in enumerate(layout.received_topics)
        ]
        back = []
        for number, event in enumerate(events_back(layout)):
            data = event_data(layout.model, event)
            types = [] if data is None else [data]
            back.append(f"    case {number}: {self.call(reply_head(layout, event), types, ['id'])}")
        resets = "".join(f" {pool}_used = 0;" for pool in self.pools)
        parts = [
            _TOP,
            *self.readers.values(),
            f"static void reset_pools(void) {{{resets} }}\n",
            "static void do_receive(int topic, uint64_t now_us)\n{\n    (void)now_us;\n    switch (topic) {",
            *receive,
            "    default: break;\n    }\n}\n",
            "static void do_back(int event, uint64_t now_us, uint32_t id)\n{\n    (void)now_us;\n    (void)id;",
            "    switch (event) {",
            *back,
            "    default: break;\n    }\n}\n",
            self.print_request(),
            self.print_state(),
            _CALLBACKS,
        ]
        setting = "" if layout.supervisor.strategy is None else "    settings.assumption_timeout_us = read_time();"
        text = "\n".join(parts).replace("@assumption_timeout@\n", setting + "\n")
        return text.replace("@p@", layout.prefix).replace("@P@", layout.upper)

    def print_request(self) -> str:
        lines = [
            "static void print_request(const @p@_request_t *request)",
            "{",
            '    printf("%d", (int)request->communication);',
        ]
        lines.append("    switch ((int)request->communication) {")
        for item in self.layout.requests:
            found = request_field(self.unit, item)
            lines.append(f"    case {self.layout.communications[item.name]}:")
            if found is not None:
                lines += _print_field(found, f"request->data.{self.layout.request_members[item.name]}", [])
            lines.append("        break;")
        return "\n".join([*lines, "    default: break;", "    }", '    printf("\\n");', "}", ""])

    def print_state(self) -> str:
        layout = self.layout
        lines = ["static void print_state(uint64_t now_us)", "{", '    printf("state");']
        for component, behaviour in layout.executable.behaviours:
            lines.append(f'    printf(" %d", (int)r.state.{layout.locations[component]});')
            for variable in behaviour.variables:
                name, type_ = layout.variables[component, variable.name]
                lines.append("    " + _print_value(type_, f"r.state.{name}"))
        for item in layout.model.communications:
            if item.kind in CALLED_KINDS:
                lines.append(f'    printf(" %d", (int)r.state.{layout.locations[communication_plant_name(item)]});')
        lines.append('    printf(" enabled ");')
        lines += [
            f'    printf("%d", (int)@p@_enabled(&r, {layout.events[event]}));' for event in layout.executable.issued
        ]
        for item in layout.of_kind(CommunicationKind.ACTION):
            found = f"@p@_cancelling(&r, {layout.communications[item.name]})"
            lines.append(f'    printf(" %d", ({found}.why != @P@_CANCEL_NONE) + {found}.is_overdue);')
        if layout.supervisor.strategy is not None:
            lines += _PRINT_PROGRESS.splitlines()
        lines.append(
            '    printf(" status %d fault %d counters %u %u %u\\n", (int)@p@_status(&r, now_us), @p@_fault(&r) != 0,'
            " (unsigned)r.counters.unknown, (unsigned)r.counters.unexpected, (unsigned)r.counters.faults);"
        )
        lines.append("    check_changes();")
        return "\n".join([check_changes(layout), *lines, "}", ""])


def _print_value(type_: Type, place: str) -> str:
    match type_:
        case DoubleType():
            return f'printf(" %.17g", {place});'
        case StringType():
            return f'printf(" "); print_text({place});'
        case _:
            return f'printf(" %ld", (long){place});'


def _print_field(found: Field, place: str, path: list[str]) -> list[str]:
    if not isinstance(found.type, ObjectType):
        given = _print_given(found.type, f"{place}.{found.value}")
        return [f'        if ({place}.{found.flag}) {{ printf(" ="); {given} }}']
    lines = []
    for name, (member, part) in found.parts.items():
        if isinstance(part.type, ObjectType):
            lines += _print_field(part, f"{place}.{member}", [*path, name])
        else:
            label = ".".join([*path, name])
            given = _print_given(part.type, f"{place}.{member}")
            lines.append(f'        if ({place}.{part.flag}) {{ printf(" {label}="); {given} }}')
    return lines


def _print_given(type_: Type, place: str) -> str:
    match type_:
        case DoubleType():
            return f'printf("%.17g", {place});'
        case StringType() | EnumType():
            return f"print_text({place});"
        case _:
            return f'printf("%ld", (long){place});'


def batch_types(layout: Layout, identifier: str) -> list[Type]:
    """The types of the parameters of a message's function."""
    types: dict[str, Type] = {}
    for item in batch(layout, identifier):
        data = event_data(layout.model, f"{item.name}.response")
        if data is not None:
            types.setdefault(layout.raw(data), layout.source(data))
    assert list(types) == list(batch_parameters(layout, identifier))
    return list(types.values())


def events_back(layout: Layout) -> list[str]:
    """Events that come back to requests, with or without data."""
    found = []
    for item in layout.model.communications:
        if item.kind is CommunicationKind.SERVICE:
            found.append(f"{item.name}.response")
        elif item.kind is CommunicationKind.ACTION:
            found += [f"{item.name}.feedback", f"{item.name}.response"]
    return found


def test_program(supervisor: Supervisor, prefix: str | None = None) -> str:
    """The text of a test program."""
    return _Program(supervisor, prefix).text()


test_program.__test__ = False  # type: ignore[attr-defined]
