#if ROBOT_RECEIVED_COUNT > 0
#if ROBOT_IS_LAYER
/* The end of a batch: silent steps. */
#else
/* The end of a batch: silent steps, and a decision if each batch brings one. */
#endif
static bool end_batch(robot_t *r)
{
    bool has_changed = false;
    if (!settle(r, -1, &has_changed)) {
        return false;
    }
#if !ROBOT_IS_LAYER
#if ROBOT_REQUEST_COUNT > 0
    if (r->settings.decides_after_batch && r->may_request) {
        return decide(r);
    }
#endif
#endif
    return true;
}
#endif

static void guard(robot_t *r, bool is_well)
{
    if (!is_well) {
        fail(r, r->why);
    }
}

#if ROBOT_SENSOR_COUNT > 0
/* A message came: its sensor is fresh, and a stop because it was not is over. */
static void see(robot_t *r, int index)
{
    robot_sensor_t *sensor = &r->sensors[index];
    const uint64_t max_age_us = r->settings.max_age_us[SENSORS[index]];
    if (max_age_us > 0) {
        const bool is_news = sensor->is_stale || !sensor->was_seen;
        sensor->seen_us = r->now_us;
        sensor->was_seen = true;
        if (sensor->is_stale) {
            sensor->is_stale = false;
            note(r, ROBOT_LOG_RESUME, (int)SENSORS[index]);
            wake_at(r, later(r->now_us, max_age_us));
        }
        if (is_news) {
            update_may_request(r);
        }
    }
}
#endif

#if ROBOT_SERVICE_COUNT > 0
/* End a call: whether it was under way. */
static bool close_call(robot_t *r, int service, uint32_t id)
{
    robot_call_t *call = &r->calls[service];
    if (!call->is_open || call->id != id) {
        unexpected(r, ROBOT_NO_EVENT);
        return false;
    }
    call->is_open = false;
    if (call->is_old) {
        update_may_request(r);
    }
    return true;
}

void robot_call_failed(robot_t *r, uint64_t now_us, uint32_t id)
{
    int found = 0;
    look_at_clock(r, now_us);
    for (int service = 0; service < ROBOT_SERVICE_COUNT; service++) {
        found = r->calls[service].is_open && r->calls[service].id == id ? service : found;
    }
    if (close_call(r, found, id) && !r->calls[found].is_old) {
        happened(r, SERVICES[found].error, take_event(r, SERVICES[found].error));
        guard(r, end_batch(r));
    }
#if ROBOT_IS_LAYER
    finish(r);
#endif
}
#endif

#if ROBOT_ACTION_COUNT > 0
/* The action whose open goal has an id, or -1. */
static int find_goal(robot_t *r, uint32_t id)
{
    for (int action = first_in(&r->open_goals); action >= 0; action = next_in(&r->open_goals, action)) {
        if (r->goals[action].id == id) {
            return action;
        }
    }
    unexpected(r, ROBOT_NO_EVENT);
    return -1;
}

/* An action's goal with an id: whether there is one. */
static bool has_goal(robot_t *r, int action, uint32_t id)
{
    if (!r->goals[action].is_open || r->goals[action].id != id) {
        unexpected(r, ROBOT_NO_EVENT);
        return false;
    }
    return true;
}

/* The end of a goal is known: its action may be requested again. */
static void close_goal(robot_t *r, int action)
{
    set_open(r, action, false);
    if (r->goals[action].cancelling.is_old) {
        update_may_request(r);
    }
}

void robot_goal_accepted(robot_t *r, uint64_t now_us, uint32_t id)
{
    int action = -1;
    look_at_clock(r, now_us);
    action = find_goal(r, id);
    if (action >= 0) {
        r->goals[action].is_accepted = true;
        guard(r, request_cancel(r, action));
    }
#if ROBOT_IS_LAYER
    finish(r);
#endif
}

/* Take the event of a goal that did not succeed. It is `cancel` if the model's own cancel ended it and the supervisor
   allows that now, else `error`: somebody else cancelled it, or the robot came to rest. */
static bool take_end(robot_t *r, int action, robot_outcome_t outcome)
{
    const robot_goal_t *goal = &r->goals[action];
    bool is_own = goal->cancelling.why == ROBOT_CANCEL_REQUIREMENT;
#if ROBOT_IS_LAYER
    is_own = is_own || goal->is_cancelled_by_caller;
#endif
    if (outcome == ROBOT_OUTCOME_CANCELLED && is_own && is_allowed(&r->state, ACTIONS[action].cancel)) {
        return take(r, ACTIONS[action].cancel);
    }
    happened(r, ACTIONS[action].error, take_event(r, ACTIONS[action].error));
    return true;
}

#if ROBOT_IS_LAYER
/* Return why a goal that has not succeeded is aborted to a caller that did not cancel it. */
static robot_abort_t abort_reason(const robot_goal_t *goal, robot_outcome_t outcome)
{
    switch (outcome) {
    case ROBOT_OUTCOME_REJECTED:
        return ROBOT_ABORT_REJECTED;
    case ROBOT_OUTCOME_ABORTED:
        return ROBOT_ABORT_ABORTED;
    case ROBOT_OUTCOME_LOST:
        return ROBOT_ABORT_LOST;
    default:
        return goal->cancelling.why == ROBOT_CANCEL_NONE          ? ROBOT_ABORT_CANCELLED
               : goal->cancelling.why == ROBOT_CANCEL_REQUIREMENT ? ROBOT_ABORT_TURNED
                                                                  : ROBOT_ABORT_STOP;
    }
}

void robot_goal_ended(robot_t *r, uint64_t now_us, uint32_t id, robot_outcome_t outcome, const void *message)
#else
void robot_goal_ended(robot_t *r, uint64_t now_us, uint32_t id, robot_outcome_t outcome)
#endif
{
    int action = -1;
    look_at_clock(r, now_us);
    action = find_goal(r, id);
    if (action >= 0) {
#if ROBOT_IS_LAYER
        bool is_well = true;
#endif
        close_goal(r, action);
        if (r->goals[action].is_running) {
#if ROBOT_IS_LAYER
            is_well = take_end(r, action, outcome) && end_batch(r);
#else
            guard(r, take_end(r, action, outcome) && end_batch(r));
#endif
        }
#if ROBOT_IS_LAYER
        r->goals[action].abort = abort_reason(&r->goals[action], outcome);
        end_for_caller(r, action, outcome == ROBOT_OUTCOME_CANCELLED ? ROBOT_END_CANCELLED : ROBOT_END_ABORTED,
                       message);
        guard(r, is_well);
#endif
    }
#if ROBOT_IS_LAYER
    finish(r);
#endif
}

void robot_cancel_refused(robot_t *r, uint64_t now_us, uint32_t id, bool has_ended)
{
    look_at_clock(r, now_us);
    if (!has_ended && find_goal(r, id) >= 0) {
        fail(r, ROBOT_FAULT_CANCEL_REFUSED);
    }
#if ROBOT_IS_LAYER
    finish(r);
#endif
}
#endif
