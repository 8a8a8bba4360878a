/* Progress of the strategy. What is seen in a stable state: for each aim, then each assumption, whether it is met; for
   each visit whether its mission or detour is at it; for each mission whether every visit of its own is true. */

enum { ITEM_COUNT = ROBOT_AIM_COUNT + ROBOT_ASSUMPTION_COUNT, SEEN_COUNT = ITEM_COUNT + ROBOT_VISIT_COUNT + ROBOT_MISSION_COUNT };

static bool is_owed_unreported(const robot_t *r, int number)
{
    const robot_item_t *item = &r->items[number];
    return number >= ROBOT_AIM_COUNT && r->has_observed && !r->seen[number] && !item->is_reported;
}

/* Time at which the next assumption is to be reported as owed for too long. */
static uint64_t progress_deadline(const robot_t *r)
{
    uint64_t next = FOREVER;
    if (r->settings.assumption_timeout_us > 0) {
        for (int number = 0; number < ITEM_COUNT; number++) {
            const uint64_t due_us = later(r->items[number].since_us, r->settings.assumption_timeout_us);
            if (is_owed_unreported(r, number) && due_us < next) {
                next = due_us;
            }
        }
    }
    return next;
}

static void become_met(robot_t *r, int number)
{
    robot_item_t *item = &r->items[number];
    item->count++;
    if (number < ROBOT_AIM_COUNT) {
        note(r, ROBOT_LOG_REACHED, number);
    } else if (item->is_reported) {
        item->is_reported = false;
        note(r, ROBOT_LOG_MET, number - ROBOT_AIM_COUNT);
    }
}

#if ROBOT_MISSION_COUNT > 0
/* Number of the visit that a tour is at, from 0 on, or -1. */
static int tour_place(const bool *seen, int tour)
{
    const bool *here = &seen[ITEM_COUNT - (ROBOT_AIM_COUNT - ROBOT_VISIT_COUNT) + TOURS[tour].first];
    for (int visit = 0; visit < TOURS[tour].visits; visit++) {
        if (here[visit]) {
            return visit;
        }
    }
    return -1;
}

/* True if every visit of a mission's own is true. */
static bool is_round(const bool *seen, int mission)
{
    return seen[ITEM_COUNT + ROBOT_VISIT_COUNT + mission];
}

static void make_visits(robot_t *r, int tour, int first, int made)
{
    for (int visit = first; visit < first + made; visit++) {
        const int aim = TOURS[tour].first + visit % TOURS[tour].visits;
        r->items[aim].count++;
        note(r, ROBOT_LOG_REACHED, aim);
    }
}

/* Count the visits that a mission and its detours make between the stable state before and this one. */
static void move_mission(robot_t *r, const bool *seen, int mission)
{
    const int own = MISSIONS[mission].tour;
    const int place = tour_place(seen, own);
    const int was = tour_place(r->seen, own) < 0 ? 0 : tour_place(r->seen, own);
    if (place < 0) {
        /* Not asked for: its detours have been given up, too. */
        return;
    }
    /* All visits were made at once where every one was true already. */
    if (!is_round(r->seen, mission)) {
        const int count = TOURS[own].visits;
        make_visits(r, own, was, is_round(seen, mission) ? count : (place - was + count) % count);
    }
    for (int tour = own + 1; tour <= own + MISSIONS[mission].detours; tour++) {
        const int begun = tour_place(r->seen, tour);
        const int now = tour_place(seen, tour);
        const int first = begun < 0 ? 0 : begun;
        const int count = TOURS[tour].visits;
        if (now >= 0) {
            /* A detour that is before where it was has ended, and has begun again. */
            make_visits(r, tour, first, (now - first + count) % count);
        } else if (begun >= 0) {
            make_visits(r, tour, first, count - first);
        }
    }
}

/* True if a visit was made in this round. */
static bool is_made(const robot_t *r, int number)
{
    for (int tour = 0; tour < (int)(sizeof TOURS / sizeof *TOURS); tour++) {
        const int visit = number - TOURS[tour].first;
        if (visit >= 0 && visit < TOURS[tour].visits) {
            const int mission = TOURS[tour].mission;
            return visit < tour_place(r->seen, tour) || (MISSIONS[mission].tour == tour && is_round(r->seen, mission));
        }
    }
    return false;
}

#endif
/* Take in a stable state. */
static void observe_progress(robot_t *r)
{
    bool seen[SEEN_COUNT];
    bool is_complete = true;
    uint64_t due_us = 0;
    observe_for_strategy(&r->state, seen);
    for (int number = 0; number < ITEM_COUNT; number++) {
        if (!seen[number]) {
            if (!r->has_observed || r->seen[number]) {
                r->items[number].since_us = r->now_us;
            }
        } else if (r->has_observed && !r->seen[number] && ITEMS[number].mission == NULL) {
            become_met(r, number);
        }
        is_complete = is_complete && (seen[number] || number >= ROBOT_AIM_COUNT);
    }
#if ROBOT_MISSION_COUNT > 0
    for (int mission = 0; mission < ROBOT_MISSION_COUNT && r->has_observed; mission++) {
        move_mission(r, seen, mission);
    }
#endif
    memcpy(r->seen, seen, sizeof seen);
    r->has_observed = true;
    r->is_complete = is_complete;
    due_us = progress_deadline(r);
    if (due_us < r->deadline_us) {
        r->deadline_us = due_us;
    }
}

/* Report each assumption that is owed for too long by now, once. */
static void expire_progress(robot_t *r)
{
    for (int number = ROBOT_AIM_COUNT; number < ITEM_COUNT; number++) {
        robot_item_t *item = &r->items[number];
        if (r->settings.assumption_timeout_us > 0 && is_owed_unreported(r, number)
            && r->now_us >= later(item->since_us, r->settings.assumption_timeout_us)) {
            item->is_reported = true;
            note(r, ROBOT_LOG_OWED, number - ROBOT_AIM_COUNT);
        }
    }
}

static void forget_progress(robot_t *r)
{
    memset(r->items, 0, sizeof r->items);
    memset(r->seen, 0, sizeof r->seen);
    r->has_observed = false;
    r->is_complete = false;
    r->has_decided = false;
    r->approached = -1;
    r->chosen = -1;
}

robot_standing_t robot_standing(const robot_t *r, int number, uint64_t now_us)
{
    const robot_item_t *item = &r->items[number];
    robot_standing_t standing;
    memset(&standing, 0, sizeof standing);
    standing.name = ITEMS[number].name;
    standing.words = ITEMS[number].words;
    standing.mission = ITEMS[number].mission;
    standing.is_met = r->seen[number];
#if ROBOT_MISSION_COUNT > 0
    if (standing.mission != NULL) {
        standing.is_met = is_made(r, number);
    }
#endif
    standing.is_unmet = r->has_observed && !r->seen[number];
    standing.is_overdue = standing.is_unmet && item->is_reported;
    standing.count = item->count;
    standing.unmet_us = standing.is_unmet && now_us > item->since_us ? now_us - item->since_us : 0;
    return standing;
}

robot_mission_t robot_mission(const robot_t *r, int number)
{
    robot_mission_t found;
    memset(&found, 0, sizeof found);
#if ROBOT_MISSION_COUNT > 0
    const int own = MISSIONS[number].tour;
    found.name = MISSIONS[number].name;
    found.visit = tour_place(r->seen, own) + 1;
    found.is_round = is_round(r->seen, number);
    found.rounds = r->items[TOURS[own].first + TOURS[own].visits - 1].count;
    found.detours = MISSIONS[number].detours;
#else
    (void)r;
    (void)number;
#endif
    return found;
}

int robot_detour(const robot_t *r, int mission, int number)
{
#if ROBOT_MISSION_COUNT > 0
    return tour_place(r->seen, MISSIONS[mission].tour + 1 + number) + 1;
#else
    (void)r;
    (void)mission;
    (void)number;
    return 0;
#endif
}

int robot_approached(const robot_t *r)
{
    return r->approached;
}

int robot_chosen(const robot_t *r)
{
    return r->chosen;
}
