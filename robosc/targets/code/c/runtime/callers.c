/* Answers and ends of goals that the caller waits for. */

#if ROBOT_REQUEST_COUNT > 0 || ROBOT_SENSOR_COUNT > 0
/* A callback of the caller has returned; a failure is a fault. */
static void require(robot_t *r, bool is_well)
{
    if (!is_well) {
        fail(r, ROBOT_FAULT_CALLBACK);
    }
}
#endif

#if ROBOT_TOPIC_COUNT > 0
/* Return the time from which the caller counts as silent on a topic, in microseconds. */
static uint64_t silent_from(const robot_t *r, int topic)
{
    return r->settings.command_timeout_us > 0 ? later(r->arrived_us[topic], r->settings.command_timeout_us) : FOREVER;
}
#endif

#if ROBOT_ACTION_COUNT > 0
/* A goal has ended: report that to its caller, unless that was done before. A cancelled one is aborted to a caller that
   did not ask for that. */
static void end_for_caller(robot_t *r, int action, robot_end_t end, const void *message)
{
    robot_goal_t *goal = &r->goals[action];
    if (goal->is_awaited) {
        const robot_end_t shown = end == ROBOT_END_CANCELLED && !goal->is_cancelled_by_caller ? ROBOT_END_ABORTED : end;
        goal->is_awaited = false;
        require(r, r->callbacks.end_goal(r->callbacks.context, ACTIONS[action].communication, goal->caller_id, shown,
                                         message));
    }
}
#endif

/* Report to the caller the calls and goals that failed or violate a requirement; the oldest first. */
static void finish(robot_t *r)
{
#if ROBOT_SERVICE_COUNT > 0
    for (;;) {
        int first = -1;
        for (int service = 0; service < ROBOT_SERVICE_COUNT; service++) {
            const robot_call_t *call = &r->calls[service];
            const bool has_failed = !call->is_open || call->is_old;
            if (call->is_awaited && has_failed && (first < 0 || call->id < r->calls[first].id)) {
                first = service;
            }
        }
        if (first < 0) {
            break;
        }
        r->calls[first].is_awaited = false;
        require(r, r->callbacks.answer_default(r->callbacks.context, SERVICES[first].communication,
                                               r->calls[first].caller_id));
    }
#endif
#if ROBOT_ACTION_COUNT > 0
    for (;;) {
        int first = -1;
        for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
            const robot_goal_t *goal = &r->goals[action];
            const bool has_failed = !goal->is_open || !(goal->is_running || goal->is_cancelled_by_caller);
            if (goal->is_awaited && has_failed && (first < 0 || goal->id < r->goals[first].id)) {
                first = action;
            }
        }
        if (first < 0) {
            break;
        }
        r->goals[first].abort = ROBOT_ABORT_FAILED;
        end_for_caller(r, first, ROBOT_END_ABORTED, NULL);
    }
#endif
    (void)r;
}
