/* Progress of the strategy: its aims come first, then its assumptions. */

static bool is_owed_unreported(const robot_t *r, int number)
{
    const robot_item_t *item = &r->items[number];
    return number >= ROBOT_AIM_COUNT && r->has_observed && !r->met[number] && !item->is_reported;
}

/* Time at which the next assumption is to be reported as owed for too long. */
static uint64_t progress_deadline(const robot_t *r)
{
    uint64_t next = FOREVER;
    if (r->settings.assumption_timeout_us > 0) {
        for (int number = 0; number < ROBOT_AIM_COUNT + ROBOT_ASSUMPTION_COUNT; number++) {
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

/* Take in a stable state. */
static void observe_progress(robot_t *r)
{
    bool met[ROBOT_AIM_COUNT + ROBOT_ASSUMPTION_COUNT];
    bool is_complete = true;
    uint64_t due_us = 0;
    observe_for_strategy(&r->state, met);
    for (int number = 0; number < ROBOT_AIM_COUNT + ROBOT_ASSUMPTION_COUNT; number++) {
        if (!met[number]) {
            if (!r->has_observed || r->met[number]) {
                r->items[number].since_us = r->now_us;
            }
        } else if (r->has_observed && !r->met[number]) {
            become_met(r, number);
        }
        r->met[number] = met[number];
        is_complete = is_complete && (met[number] || number >= ROBOT_AIM_COUNT);
    }
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
    for (int number = ROBOT_AIM_COUNT; number < ROBOT_AIM_COUNT + ROBOT_ASSUMPTION_COUNT; number++) {
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
    memset(r->met, 0, sizeof r->met);
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
    standing.is_met = r->met[number];
    standing.is_unmet = r->has_observed && !r->met[number];
    standing.is_overdue = standing.is_unmet && item->is_reported;
    standing.count = item->count;
    standing.unmet_us = standing.is_unmet && now_us > item->since_us ? now_us - item->since_us : 0;
    return standing;
}

int robot_approached(const robot_t *r)
{
    return r->approached;
}

int robot_chosen(const robot_t *r)
{
    return r->chosen;
}
