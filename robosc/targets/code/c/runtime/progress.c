/* Progress of the strategy. What is seen in a stable state, a bit each: for each aim, then each assumption, whether it
   is met; for each visit whether its mission or detour is at it; for each mission whether every visit of its own is
   true. */

enum {
    ITEM_COUNT = ROBOT_AIM_COUNT + ROBOT_ASSUMPTION_COUNT,
    ITEM_WORDS = (ITEM_COUNT + 31) / 32,
    SEEN_COUNT = ITEM_COUNT + ROBOT_VISIT_COUNT + ROBOT_MISSION_COUNT,
    SEEN_WORDS = (SEEN_COUNT + 31) / 32,
    NOTHING_DECIDED = -2 /* instead of the aim that is approached */
};

/* The bits of a word that belong to the first ones, `count` of them. */
static uint32_t first_bits(int count, int word)
{
    const int left = count - 32 * word;
    return left >= 32 ? UINT32_MAX : left <= 0 ? 0 : (UINT32_C(1) << left) - 1;
}

static bool is_owed_unreported(const robot_t *r, int number)
{
    return number >= ROBOT_AIM_COUNT && r->has_observed && !is_seen(r->seen, number) && !is_seen(r->reported, number);
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

#if ROBOT_MISSION_COUNT > 0
/* Number of the visit that a tour is at, from 0 on, or -1. */
static int tour_place(const uint32_t *seen, int tour)
{
    const int here = ITEM_COUNT - (ROBOT_AIM_COUNT - ROBOT_VISIT_COUNT) + TOURS[tour].first;
    for (int visit = 0; visit < TOURS[tour].visits; visit++) {
        if (is_seen(seen, here + visit)) {
            return visit;
        }
    }
    return -1;
}

/* True if every visit of a mission's own is true. */
static bool is_round(const uint32_t *seen, int mission)
{
    return is_seen(seen, ITEM_COUNT + ROBOT_VISIT_COUNT + mission);
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
static void move_mission(robot_t *r, const uint32_t *seen, int mission)
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
/* Note what is reached or met again, bits of a word. */
static void note_met(robot_t *r, int word, uint32_t met)
{
    for (; met != 0; met &= met - 1) {
        const int number = 32 * word + lowest_bit(met);
        if (number < ROBOT_AIM_COUNT) {
            note(r, ROBOT_LOG_REACHED, number);
        } else if (is_seen(r->reported, number)) {
            r->reported[word] &= ~(met & (0 - met));
            note(r, ROBOT_LOG_MET, number - ROBOT_AIM_COUNT);
        }
    }
}

/* Begin the account in the first stable state: what is met there was not reached. */
static void begin_progress(robot_t *r, const uint32_t *seen)
{
    for (int number = 0; number < ITEM_COUNT; number++) {
        r->items[number].since_us = r->now_us;
    }
    memcpy(r->seen, seen, sizeof r->seen);
    r->has_observed = true;
    wake_at(r, progress_deadline(r));
}

/* Take in a stable state. The loops go over what changes alone: the cycle time of the controller. */
static void observe_progress(robot_t *r)
{
    uint32_t seen[SEEN_WORDS] = {0};
    observe_for_strategy(&r->state, r->seen, seen);
    if (!r->has_observed) {
        begin_progress(r, seen);
        return;
    }
    for (int word = 0; word < ITEM_WORDS; word++) {
        const uint32_t aims = first_bits(ROBOT_AIM_COUNT, word);
        const uint32_t items = first_bits(ITEM_COUNT, word);
        /* Visits are made as their missions move on. */
        const uint32_t visits = aims & ~first_bits(ROBOT_AIM_COUNT - ROBOT_VISIT_COUNT, word);
        const uint32_t unmet = r->seen[word] & ~seen[word] & items;
        const uint32_t met = seen[word] & ~r->seen[word] & items & ~visits;
        for (uint32_t left = unmet; left != 0; left &= left - 1) {
            r->items[32 * word + lowest_bit(left)].since_us = r->now_us;
        }
        if ((unmet & ~aims) != 0 && r->settings.assumption_timeout_us > 0) {
            /* One that was to be reported earlier may be met by now: that costs a look at the time. */
            wake_at(r, later(r->now_us, r->settings.assumption_timeout_us));
        }
        for (uint32_t left = met; left != 0; left &= left - 1) {
            r->items[32 * word + lowest_bit(left)].count++;
        }
        if (r->callbacks.log != NULL || r->reported[word] != 0) {
            note_met(r, word, met);
        }
    }
#if ROBOT_MISSION_COUNT > 0
    if (memcmp(seen, r->seen, sizeof seen) != 0) {
        for (int mission = 0; mission < ROBOT_MISSION_COUNT; mission++) {
            move_mission(r, seen, mission);
        }
    }
#endif
    memcpy(r->seen, seen, sizeof seen);
}

/* Report each assumption that is owed for too long by now, once. */
static void expire_progress(robot_t *r)
{
    for (int number = ROBOT_AIM_COUNT; number < ITEM_COUNT; number++) {
        const robot_item_t *item = &r->items[number];
        if (r->settings.assumption_timeout_us > 0 && is_owed_unreported(r, number)
            && r->now_us >= later(item->since_us, r->settings.assumption_timeout_us)) {
            r->reported[number / 32] |= UINT32_C(1) << number % 32;
            note(r, ROBOT_LOG_OWED, number - ROBOT_AIM_COUNT);
        }
    }
}

static void forget_progress(robot_t *r)
{
    memset(r->items, 0, sizeof r->items);
    memcpy(r->seen, NOTHING_OWED, sizeof r->seen);
    memset(r->reported, 0, sizeof r->reported);
    r->has_observed = false;
    r->approached = NOTHING_DECIDED;
    r->chosen = -1;
    r->candidate = -1;
}

robot_standing_t robot_standing(const robot_t *r, int number, uint64_t now_us)
{
    const robot_item_t *item = &r->items[number];
    robot_standing_t standing;
    memset(&standing, 0, sizeof standing);
    standing.name = ITEMS[number].name;
    standing.words = ITEMS[number].words;
    standing.mission = ITEMS[number].mission;
    standing.is_met = r->has_observed && is_seen(r->seen, number);
#if ROBOT_MISSION_COUNT > 0
    if (standing.mission != NULL) {
        standing.is_met = r->has_observed && is_made(r, number);
    }
#endif
    standing.is_unmet = r->has_observed && !is_seen(r->seen, number);
    standing.is_overdue = standing.is_unmet && is_seen(r->reported, number);
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
    found.visit = r->has_observed ? tour_place(r->seen, own) + 1 : 0;
    found.is_round = r->has_observed && is_round(r->seen, number);
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
    return r->has_observed ? tour_place(r->seen, MISSIONS[mission].tour + 1 + number) + 1 : 0;
#else
    (void)r;
    (void)mission;
    (void)number;
    return 0;
#endif
}

int robot_approached(const robot_t *r)
{
    return r->approached < 0 ? -1 : r->approached;
}

int robot_chosen(const robot_t *r)
{
    return r->chosen < 0 ? -1 : (int)REQUESTS[r->chosen].communication;
}
