"""Check in C, after every command, that what a generated executor knows of its events is what a full look finds."""

from robosc.model.structure import CommunicationKind, EventKind
from robosc.targets.code.c.header import is_small
from robosc.targets.code.c.layout import Layout

_CHECK = """
static void complain(const char *what, int number)
{
    fprintf(stderr, "changes: %s %d\\n", what, number);
}

#if @P@_SET_COUNT > 0
static bool is_member(const @p@_set_t *set, int number)
{
#if !@P@_IS_SMALL
    return (set->bits[number / @P@_WORD_BITS] >> (number % @P@_WORD_BITS) & 1U) != 0;
#else
    return (*set >> number & 1U) != 0;
#endif
}

/* The bits of words are set for those words alone that are not zero, and no bit is that of no number. */
static void check_set(const char *name, const @p@_set_t *set)
{
#if !@P@_IS_SMALL
    const int size = @P@_WORD_BITS;
    for (int word = 0; word < (@P@_SET_COUNT + size - 1) / size; word++) {
        if ((set->used[word / size] >> (word % size) & 1U) != (set->bits[word] != 0)) {
            complain(name, word);
        }
    }
#else
    if ((uint64_t)*set >> @P@_SET_COUNT != 0) {
        complain(name, -1);
    }
#endif
}

#endif
static void check_changes(void)
{
#if @P@_STALE_COUNT > 0
    static const @p@_event_t asked[] = {@asked@};
    check_set("stale", &r.stale);
    for (int number = 0; number < @P@_STALE_COUNT && r.is_started && r.fault == @P@_FAULT_NONE; number++) {
        bool is_enabled = @p@_enabled(&r, asked[number]);
        bool is_known = false;
#if !@P@_IS_LAYER && @P@_REQUEST_COUNT > 0
        const int request = number - @P@_SILENT_COUNT;
#if @P@_IS_SMALL
        is_known = request >= 0 && is_member(&r.candidates, request);
#else
        is_known = request >= 0 && is_member(&r.candidates, r.turns[request]);
#endif
@open@
#endif
        if (!is_member(&r.stale, number) && is_enabled != is_known) {
            complain("not noticed", number);
        }
    }
#endif
#if !@P@_IS_LAYER && @P@_REQUEST_COUNT > 0
    check_set("candidates", &r.candidates);
    check_set("fresh", &r.fresh);
    check_set("withheld", &r.withheld);
    check_set("unchanging", &r.unchanging);
#if @P@_IS_SMALL
    for (int request = 0; request < @P@_REQUEST_COUNT && r.is_started; request++) {
        for (int other = 0; other < request; other++) {
            if (r.turns[request] == r.turns[other]) {
                complain("equal turns", request);
            }
        }
        if (r.fault == @P@_FAULT_NONE && (is_member(&r.fresh, request) || is_member(&r.withheld, request))) {
            complain("left from a decision", request);
        }
    }
#else
    for (int turn = 0; turn < 2 * @P@_REQUEST_COUNT && r.is_started; turn++) {
        const bool has_owner = turn < r.next_turn && r.owners[turn] >= 0;
        if (has_owner ? r.turns[r.owners[turn]] != turn : is_member(&r.candidates, turn)) {
            complain("wrong turn", turn);
        }
        if (r.fault == @P@_FAULT_NONE && (is_member(&r.fresh, turn) || is_member(&r.withheld, turn))) {
            complain("left from a decision", turn);
        }
    }
#endif
#endif
#if @P@_TOPIC_COUNT > 0
    check_set("acting topics", &r.acting_topics);
    for (int topic = 0; topic < @P@_TOPIC_COUNT; topic++) {
        if (is_member(&r.acting_topics, topic) != (r.acting[topic].request >= 0)) {
            complain("topic", topic);
        }
    }
#if !@P@_IS_LAYER
    {
        int waiting_count = 0;
        for (int topic = 0; topic < @P@_TOPIC_COUNT; topic++) {
            waiting_count += r.acting[topic].is_waiting ? 1 : 0;
        }
        if (waiting_count != r.waiting_count) {
            complain("waiting", waiting_count);
        }
    }
#endif
#endif
#if @P@_ACTION_COUNT > 0
    check_set("open goals", &r.open_goals);
    for (int action = 0; action < @P@_ACTION_COUNT; action++) {
        if (is_member(&r.open_goals, action) != r.goals[action].is_open) {
            complain("goal", action);
        }
    }
#endif
}
"""


def check_changes(layout: Layout) -> str:
    """The text of the function `check_changes`, which writes what is wrong to standard error."""
    requests = [] if layout.is_layer else layout.requests
    asked = [
        *layout.description.resets,
        *layout.description.taus,
        *(item.event(EventKind.REQUEST) for item in requests),
    ]
    actions = [item.name for item in layout.of_kind(CommunicationKind.ACTION)]
    is_open = [
        f"        is_enabled = is_enabled && !(request == {number} && r.goals[{actions.index(item.name)}].is_open);"
        for number, item in enumerate(requests)
        if item.name in actions
    ]
    text = _CHECK.replace("@asked@", ", ".join(layout.events[event] for event in asked))
    return (
        text.replace("@open@", "\n".join(is_open))
        .replace("@P@_IS_LAYER", str(int(layout.is_layer)))
        .replace("@P@_IS_SMALL", str(int(is_small(layout))))
    )
