/* Time. */

static void update_may_request(robot_t *r)
{
    r->may_request = r->is_started && !is_at_rest(r);
#if ROBOT_SERVICE_COUNT > 0
    r->may_request = r->may_request && !is_any_call_old(r);
#endif
#if ROBOT_ACTION_COUNT > 0
    r->may_request = r->may_request && !is_any_goal_old(r);
#endif
#if ROBOT_SENSOR_COUNT > 0
    for (int sensor = 0; sensor < ROBOT_SENSOR_COUNT; sensor++) {
        if (r->settings.max_age_us[SENSORS[sensor]] > 0 && !r->sensors[sensor].was_seen) {
            r->may_request = false;
        }
    }
#endif
}

/* Find the time at which something is over next. */
static void find_deadline(robot_t *r)
{
    r->deadline_us = FOREVER;
#if ROBOT_SERVICE_COUNT > 0
    for (int service = 0; service < ROBOT_SERVICE_COUNT; service++) {
        if (r->calls[service].is_open) {
            wake_at(r, r->calls[service].deadline_us);
        }
    }
#endif
#if ROBOT_ACTION_COUNT > 0
    for (int action = first_in(&r->open_goals); action >= 0; action = next_in(&r->open_goals, action)) {
        wake_at(r, time_is_over_from(r, action));
        wake_at(r, overdue_from(r, action));
    }
#endif
#if ROBOT_SENSOR_COUNT > 0
    for (int sensor = 0; sensor < ROBOT_SENSOR_COUNT; sensor++) {
        const uint64_t max_age_us = r->settings.max_age_us[SENSORS[sensor]];
        const uint64_t age = later(r->sensors[sensor].seen_us, max_age_us);
        if (max_age_us > 0 && age > r->now_us) {
            wake_at(r, age);
        }
    }
#endif
#if ROBOT_HAS_STRATEGY
    wake_at(r, progress_deadline(r));
#endif
#if ROBOT_IS_LAYER
#if ROBOT_TOPIC_COUNT > 0
    for (int topic = first_in(&r->acting_topics); topic >= 0; topic = next_in(&r->acting_topics, topic)) {
        wake_at(r, silent_from(r, topic));
    }
#endif
#endif
}

/* Replies that did not come in time. */
static bool expire(robot_t *r)
{
#if ROBOT_SERVICE_COUNT > 0 || ROBOT_ACTION_COUNT > 0
    bool has_changed = false;
#endif
#if ROBOT_SERVICE_COUNT > 0
    for (;;) {
        int first = -1;
        for (int service = 0; service < ROBOT_SERVICE_COUNT; service++) {
            const robot_call_t *call = &r->calls[service];
            if (call->is_open && r->now_us >= call->deadline_us
                && (first < 0 || call->id < r->calls[first].id)) {
                first = service;
            }
        }
        if (first < 0) {
            break;
        }
        r->calls[first].is_open = false;
        if (!r->calls[first].is_old) {
            happened(r, SERVICES[first].error, take_event(r, SERVICES[first].error));
            if (!settle(r, -1, &has_changed)) {
                return false;
            }
        }
    }
#endif
#if ROBOT_ACTION_COUNT > 0
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        if (r->now_us >= time_is_over_from(r, action)) {
            r->goals[action].is_running = false;
            happened(r, ACTIONS[action].error, take_event(r, ACTIONS[action].error));
            if (!settle(r, -1, &has_changed)) {
                return false;
            }
            begin_cancel(r, action, ROBOT_CANCEL_TIMEOUT);
            if (!request_cancel(r, action)) {
                return false;
            }
        }
    }
    report_overdue(r);
#endif
    (void)r;
    return true;
}

#if ROBOT_IS_LAYER
/* A caller that fell silent, replies that did not come in time, and stale sensors. */
#else
/* Replies that did not come in time, and stale sensors. */
#endif
static bool check_time(robot_t *r)
{
#if ROBOT_IS_LAYER
#if ROBOT_TOPIC_COUNT > 0
    robot_set_t silent = r->acting_topics;
    for (int topic = first_in(&silent); topic >= 0; topic = next_in(&silent, topic)) {
        if (r->now_us < silent_from(r, topic)) {
            remove_from(&silent, topic);
        }
    }
    if (!release_all(r, &silent)) {
        return false;
    }
#endif
#endif
    if (!expire(r)) {
        return false;
    }
    update_may_request(r);
#if ROBOT_HAS_STRATEGY
    expire_progress(r);
#endif
#if ROBOT_SENSOR_COUNT > 0
    for (int sensor = 0; sensor < ROBOT_SENSOR_COUNT; sensor++) {
        const uint64_t max_age_us = r->settings.max_age_us[SENSORS[sensor]];
        if (max_age_us > 0 && r->now_us >= later(r->sensors[sensor].seen_us, max_age_us)
            && !r->sensors[sensor].is_stale) {
            note(r, ROBOT_LOG_STOP, (int)SENSORS[sensor]);
            r->sensors[sensor].is_stale = true;
            come_to_rest(r);
        }
    }
#endif
    find_deadline(r);
#if ROBOT_IS_LAYER
    /* Calls and goals that are over end for the caller before all that comes at the same moment.
       */
    finish(r);
#endif
    return true;
}

/* Take the time; whatever is over by now has its effect first. If that goes wrong, the robot comes to rest, but what
   came is still taken: the end of a goal that were lost here would never come again. */
static void look_at_clock(robot_t *r, uint64_t now_us)
{
    r->now_us = now_us;
    if (r->is_started && now_us >= r->deadline_us && !check_time(r)) {
        fail(r, r->why);
    }
}
