"""The generated C file: tables, the functions of the model, the engine, and the functions through which data comes."""

from robosc.automata.executable import CALLED_KINDS
from robosc.automata.plants import communication_plant_name
from robosc.expressions import ArrayType, BooleanType, DoubleType, EnumType, IntegerType, NoneType, ObjectType, Type
from robosc.model.received import converted_paths
from robosc.model.structure import CommunicationKind, EventKind, is_tau
from robosc.targets.c99.conditions import CConditions
from robosc.targets.c99.expressions import low_text
from robosc.targets.c99.header import batch, batch_parameters, counts, head, receive_head, reply_head, runtime_text
from robosc.targets.c99.helpers import HELPER_CALLS, HELPERS
from robosc.targets.c99.layer_source import happen_call, reply_functions, request_functions
from robosc.targets.c99.layout import Layout, data_that_comes, event_data
from robosc.targets.c99.provide import default_function, provide_function
from robosc.targets.c99.received import converter, converter_head
from robosc.targets.c99.step import Stepper, unknown_name
from robosc.targets.c99.text import string_literal
from robosc.targets.c99.unit import Unit
from robosc.targets.code.text import indent

_ENGINE = tuple(f"{part}.c" for part in "log releases goals steps policies decisions rest time replies life".split())
_LAYER_ENGINE = tuple(f"{part}.c" for part in "log releases goals steps rest callers time replies layer life".split())
"""The parts of the engines, each after those that it calls."""


def source_file(unit: Unit) -> str:
    """The text of `<robot>.c`."""
    layout = unit.layout
    conditions = CConditions(unit)
    allows = [conditions.allow_function(event) for event in layout.executable.issued]
    steppers = [Stepper(unit, event) for event in layout.events if not _never_taken(layout, event)]
    steps = [item.step_function() for item in steppers]
    happens = [item.happen_function() for item in steppers if _happens(layout, item.event)]
    messages = layout.of_kind(CommunicationKind.INCOMING_MESSAGE)
    provided = [] if layout.is_layer else [provide_function(unit, item) for item in layout.requests]
    provided += [] if layout.is_layer else [default_function(unit, item) for item in messages]
    held = [conditions.conjuncts_function(item.name) for item in messages]
    held += [conditions.requirements_function(item.name) for item in layout.of_kind(CommunicationKind.ACTION)]
    parts = _LAYER_ENGINE if layout.is_layer else _ENGINE
    engine = [runtime_text(layout, part).rstrip().splitlines() for part in parts]
    asked = request_functions(unit) if layout.is_layer else []
    ends = [*engine, *happens, *asked, *_entries(layout), *_names(layout)]
    rest = [*allows, *steps, *provided, *held, *_dispatchers(layout), *ends]
    converters = {layout.converters[enum.name]: converter(unit, enum) for enum in layout.model.enums}
    functions = {
        **HELPERS,
        **dict(unit.functions.values()),
        **{name: "\n".join(lines) for name, lines in (*converters.items(), *conditions.nodes.items())},
    }
    called = _called(unit.used, HELPER_CALLS | unit.uses)
    heads = [f"{converter_head(unit, enum)};" for enum in layout.model.enums if layout.converters[enum.name] in called]
    texts = [*heads, *(text for name, text in functions.items() if name in called)]
    return "\n\n".join([_prologue(layout), *texts, *("\n".join(block) for block in rest)]) + "\n"


def _called(called: set[str], calls: dict[str, set[str]]) -> set[str]:
    """The functions that are called, or that those call: a compiler warns about others."""
    found: set[str] = set()
    to_do = [*called]
    while to_do:
        name = to_do.pop()
        if name not in found:
            found.add(name)
            to_do += calls.get(name, ())
    return found


def _never_taken(layout: Layout, event: str) -> bool:
    """Return True if an event is a tau that would change nothing in any state."""
    return is_tau(event) and event not in layout.description.taus


def _happens(layout: Layout, event: str) -> bool:
    """Return True if the environment causes an event otherwise than by an error."""
    found = layout.executable.events[event]
    return not found.is_issued and found.kind is not EventKind.ERROR


def _prologue(layout: Layout) -> str:
    prefix = layout.prefix
    numbers = counts(layout)
    with_data = sum(_happens(layout, event) and bool(converted_paths(layout.model, event)) for event in layout.events)
    lines = [
        *head(layout.supervisor).splitlines(),
        "",
        f'#include "{prefix}.h"',
        "",
        "#include <math.h>",
        "#include <string.h>",
        "",
        "#ifdef __FAST_MATH__",
        '#error "NaN stands for what is unknown: do not compile with -ffast-math"',
        "#endif",
        "",
        f"#define {layout.upper}_UNCONTROLLABLE_DATA {with_data}",
        "#define FOREVER UINT64_MAX",
        f"#define SILENT_BOUND INT64_C({layout.description.silent_bound})",
        "#define PATIENCE 8",
        "#define CANCEL_WAIT_US UINT64_C(500000)",
        "#define REFUSED (-1)",
        "#define KLEENE_UNKNOWN (-1)",
        *(["#define LET_THROUGH (-1)"] if layout.is_layer else []),
        "",
        f"typedef {prefix}_state_t state_t;",
    ]
    if with_data or numbers.get("WHEN"):
        lines += [
            "",
            "/* Notes on what was unknown in received data. */",
            "typedef struct {",
            "    bool is_unknown;",
            "    bool is_enum_unknown;",
            "} notes_t;",
        ]
    return "\n".join([*lines, *_unknown_constants(layout), *_tables(layout, numbers)])


def _unknown_constants(layout: Layout) -> list[str]:
    lines: list[str] = []
    roots = [layout.source(data) for data in data_that_comes(layout)]
    for root in dict.fromkeys(root for root in roots if isinstance(root, ObjectType | ArrayType)):
        raw = layout.raw(root)
        text = f"const {raw} {unknown_name(raw)} = {_unknown_value(layout, root)};"
        if text not in lines:
            lines += ["", text]
    return lines


def _unknown_value(layout: Layout, type_: Type) -> str:
    match layout.source(type_):
        case BooleanType():
            return "-1"
        case IntegerType():
            return "INT64_MIN"
        case DoubleType():
            return "(double)NAN"
        case ArrayType():
            return "{NULL, 0}"
        case ObjectType(name=name):
            parts = [
                _unknown_value(layout, part.type)
                for part in layout.model.object(name).properties
                if not isinstance(part.type, NoneType)
            ]
            return f"{{{', '.join(parts) or '0'}}}"
        case _:
            return "NULL"


def _tables(layout: Layout, numbers: dict[str, int]) -> list[str]:
    lines: list[str] = []
    prefix = layout.prefix
    infos = {info.name: info for info in layout.description.communications}
    services = [item.name for item in layout.of_kind(CommunicationKind.SERVICE)]
    actions = [item.name for item in layout.of_kind(CommunicationKind.ACTION)]
    topics = list(layout.topics)
    if layout.requests:
        lines += [
            "",
            "/* Requests in source order; -1 where something does not apply. */",
            "static const struct {",
            f"    {prefix}_communication_t communication;",
            f"    {prefix}_event_t event;",
            "    int topic;",
            "    int service;",
            "    int action;",
            "    int conjuncts;",
            *(["    const char *identifier;"] if layout.is_layer else []),
            "} REQUESTS[] = {",
        ]
        for item in layout.requests:
            topic = topics.index(item.identifier) if item.kind is CommunicationKind.INCOMING_MESSAGE else -1
            service = services.index(item.name) if item.name in services else -1
            action = actions.index(item.name) if item.name in actions else -1
            event = layout.events[item.event(EventKind.REQUEST)]
            conjuncts = infos[item.name].conjunct_count
            parts = [layout.communications[item.name], event, str(topic), str(service), str(action), str(conjuncts)]
            parts += [string_literal(item.identifier)] if layout.is_layer else []
            lines.append(f"    {{{', '.join(parts)}}},")
        lines.append("};")
    if services:
        member = [f"    {prefix}_communication_t communication;"] if layout.is_layer else []
        lines += ["", "static const struct {", *member, f"    {prefix}_event_t error;", "} SERVICES[] = {"]
        for name in services:
            parts = [layout.communications[name]] if layout.is_layer else []
            lines.append(f"    {{{', '.join([*parts, layout.events[f'{name}.error']])}}},")
        lines.append("};")
    if actions:
        lines += [
            "",
            "static const struct {",
            f"    {prefix}_communication_t communication;",
            f"    {prefix}_event_t cancel;",
            f"    {prefix}_event_t error;",
            "    int requirements;",
            "} ACTIONS[] = {",
        ]
        for name in actions:
            parts = [layout.communications[name], *(layout.events[f"{name}.{kind}"] for kind in ("cancel", "error"))]
            lines.append(f"    {{{', '.join(parts)}, {infos[name].requirement_count}}},")
        lines.append("};")
    if numbers["SILENT"]:
        lines += ["", "/* Resets, then taus, in source order. */", f"static const {prefix}_event_t SILENT[] = {{"]
        lines += [f"    {layout.events[event]}," for event in (*layout.description.resets, *layout.description.taus)]
        lines.append("};")
    sensors = layout.of_kind(CommunicationKind.OUTGOING_MESSAGE)
    if sensors:
        lines += ["", f"static const {prefix}_communication_t SENSORS[] = {{"]
        lines += [f"    {layout.communications[item.name]}," for item in sensors] + ["};"]
    return lines


def _switch(head_: str, subject: str, cases: list[tuple[str, str]], default: str, unused: list[str]) -> list[str]:
    lines = [head_, "{", *indent([f"(void){name};" for name in unused])]
    if cases:
        lines.append(f"    switch ({subject}) {{")
        for label, statement in cases:
            lines += [f"    case {label}:", *indent(statement.splitlines(), 2)]
        lines += ["    default:", "        break;", "    }"]
    return [*lines, *([f"    {default}"] if default else []), "}"]


def _dispatchers(layout: Layout) -> list[list[str]]:
    """Return the functions through which the engine asks the model."""
    prefix, function, events = layout.prefix, layout.function, layout.events
    result = [_initial(layout), _same(layout), _model_settings(layout)]
    allowed = [(events[event], f"return {function('allows', event)}(s);") for event in layout.executable.issued]
    result.append(
        _switch(
            f"static bool is_allowed(const state_t *s, {prefix}_event_t event)",
            "event",
            allowed,
            "return false;",
            ["s", "event"],
        )
    )
    if layout.requests or layout.description.taus:
        taken = [
            (events[event.name], f"return {function('takes', event.name)}(s);")
            for event in layout.executable.events.values()
            if (event.is_issued and not _never_taken(layout, event.name)) or event.kind is EventKind.ERROR
        ]
        result.append(
            _switch(
                f"static int take_event(state_t *s, {prefix}_event_t event)",
                "event",
                taken,
                "return REFUSED;",
                ["s", "event"],
            )
        )
    if layout.requests and not layout.is_layer:
        data = [
            (str(place), f"return {function('provides', item.name)}(s, data);")
            for place, item in enumerate(layout.requests)
        ]
        result.append(
            _switch(
                f"static bool get_data(const state_t *s, int request, {prefix}_request_t *data)",
                "request",
                data,
                "return false;",
                ["s", "request", "data"],
            )
        )
    if layout.topics:
        messages = [
            (place, item)
            for place, item in enumerate(layout.requests)
            if item.kind is CommunicationKind.INCOMING_MESSAGE
        ]
        defaults = [(str(place), f"return {function('is_default', item.name)}(data);") for place, item in messages]
        if not layout.is_layer:
            result.append(
                _switch(
                    f"static bool is_data_default(int request, const {prefix}_request_t *data)",
                    "request",
                    defaults,
                    "return true;",
                    ["request", "data"],
                )
            )
        held = [(str(place), f"{function('conjuncts', item.name)}(s, holds);\nbreak;") for place, item in messages]
        result.append(
            _switch(
                "static void get_conjuncts(const state_t *s, int request, bool *holds)",
                "request",
                held,
                "",
                ["s", "request", "holds"],
            )
        )
    actions = layout.of_kind(CommunicationKind.ACTION)
    if actions:
        required = [
            (str(place), f"{function('requirements', item.name)}(s, holds);\nbreak;")
            for place, item in enumerate(actions)
        ]
        result.append(
            _switch(
                "static void get_requirements(const state_t *s, int action, bool *holds)",
                "action",
                required,
                "",
                ["s", "action", "holds"],
            )
        )
    return result


def _initial(layout: Layout) -> list[str]:
    lines = ["static void set_initial(state_t *s)", "{", "    (void)s;"]
    for component, behaviour in layout.executable.behaviours:
        lines.append(f"    s->{layout.locations[component]} = {layout.location_names[component, behaviour.initial]};")
        for variable in behaviour.variables:
            name, type_ = layout.variables[component, variable.name]
            lines.append(f"    s->{name} = {_literal(layout, type_, variable.initial)};")
    for item in layout.model.communications:
        if item.kind in CALLED_KINDS:
            plant = communication_plant_name(item)
            lines.append(f"    s->{layout.locations[plant]} = {layout.location_names[plant, 'idle']};")
    return [*lines, "}"]


def _literal(layout: Layout, type_: Type, value: bool | int | float | str) -> str:
    match type_:
        case BooleanType():
            return "true" if value else "false"
        case IntegerType():
            return low_text(int(value))
        case DoubleType():
            return repr(float(value))
        case EnumType(name=name):
            return layout.values[name, str(value)]
        case _:
            return string_literal(str(value))


def _same(layout: Layout) -> list[str]:
    tests = []
    for component, behaviour in layout.executable.behaviours:
        tests.append(f"a->{layout.locations[component]} == b->{layout.locations[component]}")
        for variable in behaviour.variables:
            name, type_ = layout.variables[component, variable.name]
            is_plain = isinstance(type_, BooleanType | IntegerType | DoubleType | EnumType)
            tests.append(f"a->{name} == b->{name}" if is_plain else f"strcmp(a->{name}, b->{name}) == 0")
    for item in layout.model.communications:
        if item.kind in CALLED_KINDS:
            name = layout.locations[communication_plant_name(item)]
            tests.append(f"a->{name} == b->{name}")
    lines = ["static bool is_same_state(const state_t *a, const state_t *b)", "{", "    (void)a;", "    (void)b;"]
    if not tests:
        return [*lines, "    return true;", "}"]
    return [
        *lines,
        f"    return {tests[0]}",
        *(f"        && {test}" for test in tests[1:-1]),
        f"        && {tests[-1]};" if len(tests) > 1 else "        ;",
        "}",
    ]


def _model_settings(layout: Layout) -> list[str]:
    """Return the function that sets what the model itself says about the deployment."""
    lines = [f"static void set_model_settings({layout.prefix}_settings_t *settings)", "{", "    (void)settings;"]
    for item in layout.of_kind(CommunicationKind.OUTGOING_MESSAGE):
        if item.max_age is not None:
            span = max(1, round(item.max_age * 1e6))
            lines.append(f"    settings->max_age_us[{layout.communications[item.name]}] = UINT64_C({span});")
    lines += [f"    settings->releases[{layout.topics[identifier]}] = true;" for identifier in layout.releases]
    return [*lines, "}"]


_LOOK = "    look_at_clock(r, now_us);"


def _entries(layout: Layout) -> list[list[str]]:
    """The functions through which data comes."""
    result: list[list[str]] = []
    sensors = [item.name for item in layout.of_kind(CommunicationKind.OUTGOING_MESSAGE)]
    for identifier in layout.received_topics:
        parameters = batch_parameters(layout, identifier)
        body = ["    if (!r->is_started) {", "        return;", "    }", _LOOK]
        for item in batch(layout, identifier):
            event = item.event(EventKind.RESPONSE)
            data = event_data(layout.model, event)
            arguments = ["r", *([parameters[layout.raw(data)]] if data is not None else []), "true"]
            call = f"{layout.function('happens', event)}({', '.join(arguments)})"
            body += indent([f"if ({call}) {{", f"    see(r, {sensors.index(item.name)});", "}"])
        unused = [f"    (void){name};" for name in parameters.values()]
        body.append("    guard(r, end_batch(r));")
        if layout.is_layer:
            source = layout.received_topics[identifier]
            body += ["    finish(r);", f"    told(r, r->callbacks.pass_on(r->callbacks.context, {source}, message));"]
        result.append([receive_head(layout, identifier), "{", *unused, *body, "}"])
    return result + (reply_functions(layout) if layout.is_layer else _replies(layout))


def _replies(layout: Layout) -> list[list[str]]:
    """The functions of a controller through which answers come."""
    result = []
    services = [item.name for item in layout.of_kind(CommunicationKind.SERVICE)]
    actions = [item.name for item in layout.of_kind(CommunicationKind.ACTION)]
    for name in services:
        event = f"{name}.response"
        body = [
            f"if (close_call(r, {services.index(name)}, id)) {{",
            f"    {happen_call(layout, event)}",
            "    guard(r, end_batch(r));",
            "}",
        ]
        result.append([reply_head(layout, event), "{", _LOOK, *indent(body), "}"])
    for name in actions:
        place = actions.index(name)
        for event in (f"{name}.feedback", f"{name}.response"):
            is_end = event.endswith(".response")
            body = [
                f"if (has_goal(r, {place}, id)) {{",
                *([f"    close_goal(r, {place});"] if is_end else []),
                f"    if (r->goals[{place}].is_running) {{",
                f"        {happen_call(layout, event)}",
                "        guard(r, end_batch(r));",
                "    } else {",
                f"        unexpected(r, (int){layout.events[event]});",
                "    }",
                "}",
            ]
            result.append([reply_head(layout, event), "{", _LOOK, *indent(body), "}"])
    return result


def _names(layout: Layout) -> list[list[str]]:
    result = []
    for kind, names in (
        ("event", list(layout.events)),
        ("communication", list(layout.communications)),
        ("topic", list(layout.topics)),
        *([("source", list(layout.received_topics))] if layout.is_layer else []),
    ):
        head_ = f"const char *{layout.prefix}_{kind}_name(int {kind})"
        if not names:
            result.append([head_, "{", f"    (void){kind};", "    return NULL;", "}"])
            continue
        result.append(
            [
                head_,
                "{",
                "    static const char *const names[] = {",
                *(f"        {string_literal(name)}," for name in names),
                "    };",
                f"    return ({kind} >= 0 && {kind} < {len(names)}) ? names[{kind}] : NULL;",
                "}",
            ]
        )
    return result
