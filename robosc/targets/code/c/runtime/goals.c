#if ROBOT_SERVICE_COUNT > 0
/* Calls. */

/* Return true if a call from before a restart is not over. */
static bool is_any_call_old(const robot_t *r)
{
    for (int service = 0; service < ROBOT_SERVICE_COUNT; service++) {
        if (r->calls[service].is_open && r->calls[service].is_old) {
            return true;
        }
    }
    return false;
}

/* Begin a call with a new id. */
static void open_call(robot_t *r, robot_call_t *call)
{
    call->is_open = true;
    call->is_old = false;
    call->id = r->next_call_id++;
    call->deadline_us = later(r->now_us, r->settings.service_timeout_us);
    wake_at(r, call->deadline_us);
}
#endif

#if ROBOT_ACTION_COUNT > 0
/* Goals. */

static bool is_any_goal_open(const robot_t *r)
{
    return first_in(&r->open_goals) >= 0;
}

/* Return true if a goal from before a restart has not ended. */
static bool is_any_goal_old(const robot_t *r)
{
    for (int action = first_in(&r->open_goals); action >= 0; action = next_in(&r->open_goals, action)) {
        if (r->goals[action].cancelling.is_old) {
            return true;
        }
    }
    return false;
}

/* Note whether an action has a goal that has not ended. While it has one, it is not requested. */
static void set_open(robot_t *r, int action, bool is_open)
{
    r->goals[action].is_open = is_open;
    if (is_open) {
        add_to(&r->open_goals, action);
    } else {
        remove_from(&r->open_goals, action);
    }
#if ROBOT_HAS_STRATEGY
    r->is_choice_known = false;
#endif
#if !ROBOT_IS_LAYER
    add_to(&r->stale, ROBOT_SILENT_COUNT + ACTIONS[action].request);
#endif
}

/* Begin a goal with a new id and the requirements that hold now. */
static robot_goal_t *open_goal(robot_t *r, int action)
{
    robot_goal_t *goal = &r->goals[action];
    set_open(r, action, true);
    goal->is_running = true;
    goal->is_accepted = false;
    goal->is_cancel_sent = false;
    memset(&goal->cancelling, 0, sizeof goal->cancelling);
    goal->id = r->next_goal_id++;
    goal->deadline_us = later(r->now_us, r->settings.action_timeout_us);
    wake_at(r, goal->deadline_us);
    get_requirements(&r->state, action, goal->held);
    return goal;
}

/* Return the time at which a goal fails unless it has ended. One that is being cancelled does not: it may still move the
   robot. */
static uint64_t time_is_over_from(const robot_t *r, int action)
{
    const robot_goal_t *goal = &r->goals[action];
    const bool can_fail = goal->is_open && goal->is_running && goal->cancelling.why == ROBOT_CANCEL_NONE;
    return can_fail ? goal->deadline_us : FOREVER;
}

/* Return the time at which the cancel of a goal is overdue. */
static uint64_t overdue_from(const robot_t *r, int action)
{
    const robot_goal_t *goal = &r->goals[action];
    const bool is_awaited = goal->is_open && goal->cancelling.why != ROBOT_CANCEL_NONE && !goal->cancelling.is_overdue;
    return is_awaited && r->settings.cancel_timeout_us > 0
               ? later(goal->cancelling.asked_us, r->settings.cancel_timeout_us)
               : FOREVER;
}

/* Note that a goal is to be cancelled, once. For the model it is executed until its end is known. */
static void begin_cancel(robot_t *r, int action, robot_cancel_t why)
{
    robot_goal_t *goal = &r->goals[action];
    if (goal->is_open && goal->cancelling.why == ROBOT_CANCEL_NONE) {
        goal->cancelling.why = why;
        goal->cancelling.asked_us = r->now_us;
        wake_at(r, overdue_from(r, action));
        note(r, ROBOT_LOG_CANCELLING, (int)ACTIONS[action].communication);
    }
}

/* Ask the server to cancel a goal that is to be cancelled, once; before its acceptance that waits. */
static bool request_cancel(robot_t *r, int action)
{
    robot_goal_t *goal = &r->goals[action];
    const bool is_wanted = goal->is_open && goal->cancelling.why != ROBOT_CANCEL_NONE;
    if (is_wanted && goal->is_accepted && !goal->is_cancel_sent) {
        if (!r->callbacks.cancel_goal(r->callbacks.context, ACTIONS[action].communication, goal->id)) {
            return fault(r, ROBOT_FAULT_CALLBACK);
        }
        goal->is_cancel_sent = true;
    }
    return true;
}

static void observe_goals(robot_t *r)
{
    for (int action = first_in(&r->open_goals); action >= 0; action = next_in(&r->open_goals, action)) {
        robot_goal_t *goal = &r->goals[action];
        if (goal->is_running) {
            bool holds[ROBOT_REQUIREMENT_COUNT + 1] = {false};
            get_requirements(&r->state, action, holds);
            for (int place = 0; place < ACTIONS[action].requirements; place++) {
                goal->held[place] = goal->held[place] || holds[place];
            }
        }
    }
}

/* Cancel the goals that turn against their requirements: one that held since the request no longer does. It is asked
   whether or not the supervisor allows the event now: the goal's error can always follow. */
static bool cancel_turned(robot_t *r)
{
    for (int action = first_in(&r->open_goals); action >= 0; action = next_in(&r->open_goals, action)) {
        robot_goal_t *goal = &r->goals[action];
        if (goal->is_running && goal->cancelling.why == ROBOT_CANCEL_NONE) {
            bool holds[ROBOT_REQUIREMENT_COUNT + 1] = {false};
            bool has_turned = false;
            get_requirements(&r->state, action, holds);
            for (int place = 0; place < ACTIONS[action].requirements; place++) {
                goal->cancelling.turned[place] = goal->held[place] && !holds[place];
                has_turned = has_turned || goal->cancelling.turned[place];
            }
            if (has_turned) {
                begin_cancel(r, action, ROBOT_CANCEL_REQUIREMENT);
                if (!request_cancel(r, action)) {
                    return false;
                }
            }
        }
    }
    return true;
}

/* Report each goal that has not ended in time since it is to be cancelled, once. It goes on being executed. */
static void report_overdue(robot_t *r)
{
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        if (r->now_us >= overdue_from(r, action)) {
            r->goals[action].cancelling.is_overdue = true;
            note(r, ROBOT_LOG_CANCEL_OVERDUE, (int)ACTIONS[action].communication);
        }
    }
}
#endif
