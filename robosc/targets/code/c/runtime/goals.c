#if ROBOT_ACTION_COUNT > 0
/* Goals. */

static bool is_any_goal_open(const robot_t *r)
{
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        if (r->goals[action].is_open) {
            return true;
        }
    }
    return false;
}

/* Begin a goal with a new id and the requirements that hold now. */
static robot_goal_t *open_goal(robot_t *r, int action)
{
    robot_goal_t *goal = &r->goals[action];
    goal->is_open = true;
    goal->is_running = true;
    goal->is_accepted = false;
    goal->is_cancel_wanted = false;
    goal->is_cancel_sent = false;
    goal->id = r->next_goal_id++;
    goal->deadline_us = later(r->now_us, r->settings.action_timeout_us);
    get_requirements(&r->state, action, goal->held);
    return goal;
}

/* Ask for the cancel of a goal, once; before its acceptance it is only remembered. */
static bool request_cancel(robot_t *r, int action)
{
    robot_goal_t *goal = &r->goals[action];
    goal->is_cancel_wanted = true;
    if (goal->is_accepted && !goal->is_cancel_sent) {
        if (!r->callbacks.cancel_goal(r->callbacks.context, ACTIONS[action].communication, goal->id)) {
            return fault(r, ROBOT_FAULT_CALLBACK);
        }
        goal->is_cancel_sent = true;
    }
    return true;
}

static void observe_goals(robot_t *r)
{
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        robot_goal_t *goal = &r->goals[action];
        if (goal->is_open && goal->is_running) {
            bool holds[ROBOT_REQUIREMENT_COUNT + 1] = {false};
            get_requirements(&r->state, action, holds);
            for (int place = 0; place < ACTIONS[action].requirements; place++) {
                goal->held[place] = goal->held[place] || holds[place];
            }
        }
    }
}

/* A goal to be cancelled now: a requirement that held since its request no longer does, and cancel is allowed. */
static int goal_to_cancel(const robot_t *r)
{
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        const robot_goal_t *goal = &r->goals[action];
        if (goal->is_open && goal->is_running) {
            bool holds[ROBOT_REQUIREMENT_COUNT + 1] = {false};
            bool has_turned = false;
            get_requirements(&r->state, action, holds);
            for (int place = 0; place < ACTIONS[action].requirements; place++) {
                has_turned = has_turned || (goal->held[place] && !holds[place]);
            }
            if (has_turned && is_allowed(&r->state, ACTIONS[action].cancel)) {
                return action;
            }
        }
    }
    return -1;
}
#endif
