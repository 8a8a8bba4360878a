"""The generated C file: tables, the functions of the model, the engine, and the functions that take received data."""

from collections.abc import Iterable, Mapping, Sequence
from functools import partial

from robosc.automata.executable import CALLED_KINDS
from robosc.automata.plants import communication_plant_name
from robosc.expressions import ArrayType, BooleanType, DoubleType, EnumType, IntegerType, NoneType, ObjectType, Type
from robosc.model.received import converted_paths, required_parts
from robosc.model.structure import CommunicationKind, EventKind, is_tau
from robosc.targets.code.c.alike import MACROS, Family, Sharing
from robosc.targets.code.c.conditions import CConditions
from robosc.targets.code.c.expressions import number_code
from robosc.targets.code.c.header import (
    batch,
    batch_parameters,
    counts,
    head,
    is_small,
    receive_head,
    reply_head,
    runtime_text,
)
from robosc.targets.code.c.helpers import HELPERS, called
from robosc.targets.code.c.layer_source import request_functions
from robosc.targets.code.c.layout import Layout, data_that_comes, event_data, width
from robosc.targets.code.c.limits import HELPERS_TEXT as LIMITING
from robosc.targets.code.c.limits import get_function, limit_function, limited, set_function
from robosc.targets.code.c.provide import default_function, provide_function
from robosc.targets.code.c.readers import Readers
from robosc.targets.code.c.received import converter, converter_head, unknown_name
from robosc.targets.code.c.statements import statement_lines, unused
from robosc.targets.code.c.step import Stepper
from robosc.targets.code.c.strategy import forgotten, strategy_functions
from robosc.targets.code.c.text import comment, string_literal
from robosc.targets.code.c.unit import Reading, Unit
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, Code, double, variable
from robosc.targets.code.steps import initial_state
from robosc.targets.text import indent

_ENGINE = "log progress releases goals steps policies decisions safe_stop time replies lifecycle".split()
_LAYER_ENGINE = "log releases goals steps safe_stop callers time replies layer lifecycle".split()
"""The parts of the engines, each after those that it calls."""


_NUMBERED = (CommunicationKind.SERVICE, CommunicationKind.ACTION, CommunicationKind.OUTGOING_MESSAGE)


def source_file(unit: Unit) -> str:
    """The text of `<robot>.c`."""
    layout = unit.layout
    conditions = CConditions(unit)
    allowing = {event: conditions.allow_function(event) for event in layout.executable.issued}
    readers = Readers(is_small(layout), [conditions.reads[event] for event in _asked(layout)], unit.uses)
    steppers = [Stepper(unit, event, readers) for event in layout.events if not _never_taken(layout, event)]
    sharing = Sharing(layout)
    allows, steps = (
        sharing.family(functions) for functions in (allowing, {item.event: item.step_function() for item in steppers})
    )
    happens = [item.happen_function(steps) for item in steppers if _happens(layout, item.event)]
    messages = layout.of_kind(CommunicationKind.INCOMING_MESSAGE)
    provided = [] if layout.is_layer else [provide_function(unit, item) for item in layout.requests]
    provided += [] if layout.is_layer else [default_function(unit, item) for item in messages]
    limiting = [limit_function(unit, item) for _, item in limited(layout)]
    if not layout.is_layer:
        limiting += [made(unit, item) for _, item in limited(layout) for made in (get_function, set_function)]
    if limiting:
        limiting = [LIMITING.splitlines(), *limiting]
    held = [conditions.conjuncts_function(item.name) for item in messages]
    held += [conditions.requirements_function(item.name) for item in layout.of_kind(CommunicationKind.ACTION)]
    chosen: list[list[str]] = []
    if layout.supervisor.strategy is not None:
        chosen = strategy_functions(unit, conditions, layout.supervisor.strategy)
    parts = _LAYER_ENGINE if layout.is_layer else _ENGINE
    if layout.supervisor.strategy is None:
        parts = [part for part in parts if part != "progress"]
    engine = [runtime_text(layout, f"{part}.c").rstrip().splitlines() for part in parts]
    asked = request_functions(unit) if layout.is_layer else []
    ends = [*engine, *happens, *asked, *_entries(layout), *_names(layout)]
    rest = [
        *allows.blocks,
        *steps.blocks,
        *provided,
        *held,
        *limiting,
        *_dispatchers(unit, allows, steps),
        *chosen,
        *ends,
    ]
    converters = {layout.converters[enum.name]: converter(unit, enum) for enum in layout.model.enums}
    functions = {
        **HELPERS,
        **dict(unit.functions.values()),
        **{name: "\n".join(lines) for name, lines in (*converters.items(), *conditions.nodes.items())},
        "changed": runtime_text(layout, "changed.c").rstrip(),
    }
    needed = called(unit.used, unit.uses)
    heads = [f"{converter_head(unit, enum)};" for enum in layout.model.enums if layout.converters[enum.name] in needed]
    texts = [*heads, *(text for name, text in functions.items() if name in needed)]
    start = [_prologue(layout, readers, bool(allows.rows or steps.rows)), runtime_text(layout, "sets.c").rstrip()]
    return "\n\n".join([*start, *texts, *("\n".join(block) for block in rest)]) + "\n"


def _asked(layout: Layout) -> list[str]:
    """The events that are asked again and again whether they are allowed: silent steps, then requests."""
    requests = [] if layout.is_layer else [item.event(EventKind.REQUEST) for item in layout.requests]
    return [*layout.description.resets, *layout.description.taus, *requests]


def _never_taken(layout: Layout, event: str) -> bool:
    """Return True if an event is a tau that would change nothing in any state."""
    return is_tau(event) and event not in layout.description.taus


def _happens(layout: Layout, event: str) -> bool:
    """Return True if the environment causes an event otherwise than by an error."""
    found = layout.executable.events[event]
    return not found.is_issued and found.kind is not EventKind.ERROR


def _prologue(layout: Layout, readers: Readers, is_sharing: bool) -> str:
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
        f"#define {layout.upper}_TIMES {_waited_for(layout, numbers)}",
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
    if is_sharing:
        lines += ["", *MACROS]
    table = readers.lines()
    return "\n".join([*lines, *_unknown_constants(layout), *_tables(layout, numbers), *([""] if table else []), *table])


def _waited_for(layout: Layout, numbers: dict[str, int]) -> int:
    """Number of things that something is done about if they take too long."""
    count = numbers["SENSOR"] + numbers["SERVICE"] + numbers["ACTION"]
    count += numbers["TOPIC"] if layout.is_layer else 0
    return count + (layout.supervisor.strategy is not None)


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
            return "false"
        case IntegerType(low=int(low), high=int(high)):
            return str(min(max(0, low), high))
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
    communication, event = (f"{layout.prefix}_{kind}_t" for kind in ("communication", "event"))
    infos = {info.name: info for info in layout.description.communications}
    services, actions, sensors = ([item.name for item in layout.of_kind(kind)] for kind in _NUMBERED)
    topics = list(layout.topics)
    requests = []
    following = _following(layout)
    for number, item in enumerate(layout.requests):
        topic = topics.index(item.identifier) if item.kind is CommunicationKind.INCOMING_MESSAGE else -1
        places = (names.index(item.name) if item.name in names else -1 for names in (services, actions))
        numbers_of = map(str, (topic, *places, infos[item.name].conjunct_count, following[number]))
        identifier = [string_literal(item.identifier)] if layout.is_layer else []
        name = layout.events[item.event(EventKind.REQUEST)]
        requests.append([layout.communications[item.name], name, *numbers_of, *identifier])
    members = [f"{communication} communication", f"{event} event", "int topic", "int service", "int action"]
    members += ["int conjuncts", "int next", *(["const char *identifier"] if layout.is_layer else [])]
    words = "Requests in source order; -1 where something does not apply. `next`: the next one on the same topic."
    lines = _table(members, "REQUESTS", requests, words)
    if layout.is_layer and layout.numbers:
        owners = [name for name, _ in layout.numbers]
        rows = [str(owners.index(item.name) if item.name in owners else 0) for item in layout.requests]
        lines += _table("int", "FIRST_NUMBERS", rows, "Each request's first number.")
    errors = [[layout.communications[name], layout.events[f"{name}.error"]] for name in services]
    lines += _table([f"{communication} communication", f"{event} error"], "SERVICES", errors)
    members = [f"{communication} communication", f"{event} cancel", f"{event} error", "int requirements", "int request"]
    numbers_by_name = {item.name: number for number, item in enumerate(layout.requests)}
    ends = [
        [layout.communications[name], layout.events[f"{name}.cancel"], layout.events[f"{name}.error"],
         str(infos[name].requirement_count), str(numbers_by_name[name])] for name in actions
    ]  # fmt: skip
    lines += _table(members, "ACTIONS", ends)
    silent = [layout.events[name] for name in (*layout.description.resets, *layout.description.taus)]
    lines += _table(event, "SILENT", silent if numbers["SILENT"] else [], "Resets, then taus, in source order.")
    lines += _table(communication, "SENSORS", [layout.communications[name] for name in sensors])
    items = [
        ["NULL" if text is None else string_literal(text) for text in item]
        for item in (*layout.description.aims, *layout.description.assumptions)
    ]
    words = "Aims of the strategy, then its assumptions."
    lines += _table(["const char *name", "const char *words", "const char *mission"], "ITEMS", items, words)
    missions: list[list[str]] = []
    tours: list[list[str]] = []
    for number, mission in enumerate(layout.description.missions):
        missions.append([string_literal(mission.name), str(len(tours)), str(len(mission.detours))])
        first = mission.first
        for count in (mission.visits, *mission.detours):
            tours.append([str(number), str(first), str(count)])
            first += count
    words = "Missions: their own tour, which those of detours follow."
    lines += _table(["const char *name", "int tour", "int detours"], "MISSIONS", missions, words)
    words = "Tours: the aims that are the visits of a mission, or of one of its detours."
    return lines + _table(["int mission", "int first", "int visits"], "TOURS", tours, words)


def _following(layout: Layout) -> list[int]:
    """The number of the next request on the same topic for each request, the first one after the last; else its own."""
    following = list(range(len(layout.requests)))
    last: dict[str, int] = {}
    for number, item in enumerate(layout.requests):
        if item.kind is CommunicationKind.INCOMING_MESSAGE:
            if item.identifier in last:
                following[number] = following[last[item.identifier]]
                following[last[item.identifier]] = number
            last[item.identifier] = number
    return following


def _table(type_: str | list[str], name: str, rows: Sequence[str | list[str]], words: str = "") -> list[str]:
    """A constant array of a type, or of structs with some members; none where it has no rows."""
    if not rows:
        return []
    head_ = [f"static const {type_} {name}[] = {{"]
    if not isinstance(type_, str):
        head_ = ["static const struct {", *(f"    {member};" for member in type_), f"}} {name}[] = {{"]
    entries = (row if isinstance(row, str) else f"{{{', '.join(row)}}}" for row in rows)
    return ["", *(comment(words) if words else []), *head_, *(f"    {entry}," for entry in entries), "};"]


def _switch(head_: str, parameters: str, subject: str, cases: Iterable[tuple[object, str]], default: str) -> list[str]:
    """The function that chooses a statement by a subject: the default where there is none for it."""
    lines = [line for label, statement in cases for line in (f"case {label}:", *indent(statement.splitlines()))]
    if lines:
        lines = [f"switch ({subject}) {{", *lines, "default:", "    break;", "}"]
    ends = [default] if default else []
    return [head_, "{", *indent([*statement_lines(unused(*parameters.split())), *lines, *ends]), "}"]


def _by_event(
    layout: Layout, head_: str, name: str, parameter: str, cases: Mapping[str, str], family: Family, default: str
) -> list[str]:
    """The function that calls another one for an event, its own or that which does for many.

    Args:
        layout: Names.
        head_: Its head.
        name: Name of the table of those that do for many.
        parameter: Its parameter besides the event.
        cases: The statement for each event with a function of its own.
        family: The functions.
        default: The statement for all other events.
    """
    own = [(layout.events[event], text) for event, text in cases.items() if event not in family.rows]
    switch = _switch(head_, f"{parameter} event", "event", own, default)
    rows = [family.row_of(event) if event in cases else (0, 0) for event in layout.events]
    numbers = sorted({number for number, _ in rows if number})
    if not numbers:
        return switch
    shared = _switch("", "", f"{name}[event].function", [family.case(number, parameter) for number in numbers], "")
    types = [width(1 + max(column)) for column in zip(*rows, strict=True)]
    table = _table([f"{types[0]} function", f"{types[1]} row"], name, [[*map(str, row)] for row in rows], _DOES)
    test = f"if ((size_t)event < sizeof {name} / sizeof *{name}) {{"
    lines = [test, *indent([f"const int row = {name}[event].row;", *(line[4:] for line in shared[2:-1])]), "}"]
    return [*table[1:], "", *switch[:2], *indent(lines), *switch[2:]]


_DOES = "Number of the function that does for an event, or 0; the row of its table."


def _dispatchers(unit: Unit, allows: Family, steps: Family) -> list[list[str]]:
    """Return the functions by which the engine calls the model."""
    layout = unit.layout
    function = layout.function
    state, event, data = "const state_t *s", f"{layout.prefix}_event_t event", f"{layout.prefix}_request_t *data"
    allowed = {event: f"return {function('allows', event)}(s);" for event in layout.executable.issued}
    head_ = f"static bool is_allowed({state}, {event})"
    start = initial_state(layout.executable, Reading(unit), partial(_initial, layout))
    if layout.supervisor.strategy is not None:
        start += forgotten(unit)
    initial = unit.definition("static void set_initial(state_t *s)", [*unused("s"), *start])
    result = [initial, _same(layout), _model_settings(layout)]
    result.append(_by_event(layout, head_, "ALLOWS", "s", allowed, allows, "return false;"))
    if layout.requests or layout.description.taus:
        taken = {
            event.name: f"return {function('takes', event.name)}(r);"
            for event in layout.executable.events.values()
            if (event.is_issued and not _never_taken(layout, event.name)) or event.kind is EventKind.ERROR
        }
        head_ = f"static int take_event({layout.prefix}_t *r, {event})"
        result.append(_by_event(layout, head_, "TAKES", "r", taken, steps, "return REFUSED;"))
    requests = list(enumerate(layout.requests))
    if requests and not layout.is_layer:
        given = [(place, f"return {function('provides', item.name)}(s, data);") for place, item in requests]
        head_ = f"static bool get_data({state}, int request, {data})"
        result.append(_switch(head_, "s request data", "request", given, "return true;"))
    messages = [(place, item) for place, item in requests if item.kind is CommunicationKind.INCOMING_MESSAGE]
    if messages and not layout.is_layer:
        defaults = [(place, f"return {function('is_default', item.name)}(data);") for place, item in messages]
        head_ = f"static bool is_data_default(int request, const {data})"
        result.append(_switch(head_, "request data", "request", defaults, "return true;"))
    result += _limit_dispatchers(layout)
    held = [(place, f"{function('conjuncts', item.name)}(s, holds);\nbreak;") for place, item in messages]
    actions = list(enumerate(layout.of_kind(CommunicationKind.ACTION)))
    required = [(place, f"{function('requirements', item.name)}(s, holds);\nbreak;") for place, item in actions]
    for name, subject, cases in (("conjuncts", "request", held), ("requirements", "action", required)):
        if cases:
            head_ = f"static void get_{name}({state}, int {subject}, bool *holds)"
            result.append(_switch(head_, f"s {subject} holds", subject, cases, ""))
    return result


def _limit_dispatchers(layout: Layout) -> list[list[str]]:
    """Return the functions by which the engine moves numbers; none where nothing has limits."""
    function, found = layout.function, limited(layout)
    if not found:
        return []
    moves = [(place, f"return {function('limits', item.name)}(s, numbers);") for place, item in found]
    head_ = "static int limit_numbers(const state_t *s, int request, double *numbers)"
    result = [_switch(head_, "s request numbers", "request", moves, "return 0;")]
    if not layout.is_layer:
        request = f"{layout.prefix}_request_t *data"
        for name, purpose, parameters in (
            ("get", "numbers", f"int request, const {request}, double *numbers"),
            ("set", "moves", f"int request, {request}, const double *numbers"),
        ):
            cases = [(place, f"{function(purpose, item.name)}(data, numbers);\nbreak;") for place, item in found]
            result.append(
                _switch(f"static void {name}_numbers({parameters})", "request data numbers", "request", cases, "")
            )
    return result


def _initial(layout: Layout, type_: Type, value: bool | int | float | str) -> Code:
    match type_:
        case BooleanType():
            return TRUE_CODE if value else FALSE_CODE
        case IntegerType():
            return number_code(int(value))
        case DoubleType():
            return double(float(value))
        case EnumType(name=name):
            return variable(layout.values[name, str(value)])
        case _:
            return variable(string_literal(str(value)))


def _same(layout: Layout) -> list[str]:
    tests = []
    for component, behaviour in layout.executable.behaviours:
        tests.append(f"a->{layout.locations[component]} == b->{layout.locations[component]}")
        for item in behaviour.variables:
            name, type_ = layout.variables[component, item.name]
            is_plain = isinstance(type_, BooleanType | IntegerType | DoubleType | EnumType)
            tests.append(f"a->{name} == b->{name}" if is_plain else f"strcmp(a->{name}, b->{name}) == 0")
    plants = [communication_plant_name(item) for item in layout.model.communications if item.kind in CALLED_KINDS]
    tests += [f"a->{layout.locations[plant]} == b->{layout.locations[plant]}" for plant in plants]
    first, *others = tests or ["true"]
    ends = [f"    && {test}" for test in others] or (["    "] if tests else [])
    lines = [*statement_lines(unused("a", "b")), f"return {first}", *ends]
    lines[-1] += ";"
    return ["static bool is_same_state(const state_t *a, const state_t *b)", "{", *indent(lines), "}"]


def _model_settings(layout: Layout) -> list[str]:
    """Return the function that sets what the model itself says about the deployment."""
    lines = [f"static void set_model_settings({layout.prefix}_settings_t *settings)", "{", "    (void)settings;"]
    for item in layout.of_kind(CommunicationKind.OUTGOING_MESSAGE):
        if item.max_age is not None:
            span = max(1, round(item.max_age * 1e6))
            lines.append(f"    settings->max_age_us[{layout.communications[item.name]}] = UINT64_C({span});")
    lines += [f"    settings->releases[{layout.topics[identifier]}] = true;" for identifier in layout.releases]
    return [*lines, "}"]


_LOOK = "look_at_clock(r, now_us);"


def _entries(layout: Layout) -> list[list[str]]:
    """The functions through which data comes."""
    result: list[list[str]] = []
    sensors = [item.name for item in layout.of_kind(CommunicationKind.OUTGOING_MESSAGE)]
    for identifier in layout.received_topics:
        parameters = batch_parameters(layout, identifier)
        ignored = statement_lines(unused(*parameters.values()))
        body = ["if (!r->is_started) {", "    return;", "}", _LOOK]
        for item in batch(layout, identifier):
            data = event_data(layout.model, item.event(EventKind.RESPONSE))
            body += _refused(
                layout, item.event(EventKind.RESPONSE), data, "" if data is None else parameters[layout.raw(data)]
            )
        for item in batch(layout, identifier):
            event = item.event(EventKind.RESPONSE)
            data = event_data(layout.model, event)
            arguments = ["r", *([parameters[layout.raw(data)]] if data is not None else []), "true"]
            call = f"{layout.function('happens', event)}({', '.join(arguments)})"
            body += [f"if ({call}) {{", f"    see(r, {sensors.index(item.name)});", "}"]
        body.append("guard(r, end_batch(r));")
        if layout.is_layer:
            source = layout.received_topics[identifier]
            body += ["finish(r);", f"require(r, r->callbacks.pass_on(r->callbacks.context, {source}, message));"]
        result.append([receive_head(layout, identifier), "{", *indent([*ignored, *body]), "}"])
    return result + _replies(layout)


def _refused(layout: Layout, event: str, data: Type | None, name: str, condition: str = "") -> list[str]:
    """Refuse no data for an event that cannot happen without, where a condition holds."""
    if data is None or not layout.is_by_pointer(data) or not required_parts(layout.model, event):
        return []
    ends = ["finish(r);"] if layout.is_layer else []
    body = [f"unexpected(r, (int){layout.events[event]});", *ends, "return;"]
    return [f"if ({name} == NULL{condition}) {{", *indent(body), "}"]


def _replies(layout: Layout) -> list[list[str]]:
    """The functions through which answers come; a layer hands them on to the caller."""
    result = []

    def add(event: str, start: list[str], body: list[str], end: list[str]) -> None:
        before = ["bool is_well = true;", *start[:1], _LOOK, *start[1:]] if layout.is_layer else [_LOOK]
        after = [*end, "guard(r, is_well);", "finish(r);"] if layout.is_layer else []
        result.append([reply_head(layout, event), "{", *indent([*before, *body, *after]), "}"])

    def taken(event: str) -> list[str]:
        data = ["data"] if event_data(layout.model, event) is not None else []
        happens = f"(void){layout.function('happens', event)}({', '.join(['r', *data, 'false'])});"
        return [happens, "is_well = end_batch(r);" if layout.is_layer else "guard(r, end_batch(r));"]

    for place, item in enumerate(layout.of_kind(CommunicationKind.SERVICE)):
        event = item.event(EventKind.RESPONSE)
        awaited = f"is_awaited = r->calls[{place}].is_awaited && r->calls[{place}].id == id;"
        is_open = f" && r->calls[{place}].is_open && !r->calls[{place}].is_old && r->calls[{place}].id == id"
        body = [
            *_refused(layout, event, event_data(layout.model, event), "data", is_open),
            f"if (close_call(r, {place}, id)) {{",
            f"    if (r->calls[{place}].is_old) {{",
            f"        unexpected(r, (int){layout.events[event]});",
            "    } else {",
            *indent(indent(taken(event))),
            "    }",
            "}",
        ]
        answer = [f"answer_caller(r, {place}, is_awaited, message);"]
        add(event, ["bool is_awaited = false;", awaited], body, answer)
    for place, item in enumerate(layout.of_kind(CommunicationKind.ACTION)):
        for kind in (EventKind.FEEDBACK, EventKind.RESPONSE):
            event, is_end = item.event(kind), kind is EventKind.RESPONSE
            ended = f"end_for_caller(r, {place}, {layout.upper}_END_SUCCEEDED, message);"
            body = [
                *_refused(layout, event, event_data(layout.model, event), "data", f" && r->goals[{place}].is_running"),
                *([f"close_goal(r, {place});"] if is_end else []),
                f"if (r->goals[{place}].is_running) {{",
                *indent(taken(event)),
                "} else {",
                f"    unexpected(r, (int){layout.events[event]});",
                "}",
                *([ended if is_end else f"pass_feedback(r, {place}, message);"] if layout.is_layer else []),
            ]
            add(event, [], [f"if (has_goal(r, {place}, id)) {{", *indent(body), "}"], [])
    return result


def _names(layout: Layout) -> list[list[str]]:
    result = []
    named = {"event": layout.events, "communication": layout.communications, "topic": layout.topics}
    if layout.is_layer:
        named["source"] = layout.received_topics
        if layout.numbers:
            named["number"] = {f"{name}: {'.'.join(path)}": word for (name, path), word in layout.numbers.items()}
    for kind, names in named.items():
        body = [f"(void){kind};", "return NULL;"]
        if names:
            entries = (f"    {string_literal(name)}," for name in names)
            value = f"({kind} >= 0 && {kind} < {len(names)}) ? names[{kind}] : NULL"
            body = ["static const char *const names[] = {", *entries, "};", f"return {value};"]
        result.append([f"const char *{layout.prefix}_{kind}_name(int {kind})", "{", *indent(body), "}"])
    return result
