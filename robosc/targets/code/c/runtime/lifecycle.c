static bool begin(robot_t *r)
{
    bool has_changed = false;
    r->is_started = true;
#if ROBOT_SERVICE_COUNT > 0
    for (int service = 0; service < ROBOT_SERVICE_COUNT; service++) {
        r->calls[service].is_old = true;
    }
#endif
#if ROBOT_ACTION_COUNT > 0
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        r->goals[action].is_running = false;
        r->goals[action].cancelling.is_old = true;
    }
#endif
#if ROBOT_SENSOR_COUNT > 0
    for (int sensor = 0; sensor < ROBOT_SENSOR_COUNT; sensor++) {
        r->sensors[sensor].seen_us = r->now_us;
        r->sensors[sensor].was_seen = false;
    }
#endif
#if !ROBOT_IS_LAYER
#if ROBOT_REQUEST_COUNT > 0
    new_policy(r);
#endif
#endif
    set_initial(&r->state);
#if ROBOT_HAS_STRATEGY
    forget_progress(r);
#endif
    all_changed(r);
    r->is_pending = false;
    if (!settle(r, -1, &has_changed)) {
        return false;
    }
    find_deadline(r);
    update_may_request(r);
    return true;
}

void robot_default_settings(robot_settings_t *settings)
{
    memset(settings, 0, sizeof *settings);
#if ROBOT_HAS_STRATEGY
    settings->policy = ROBOT_POLICY_STRATEGY;
#else
#if !ROBOT_IS_LAYER
    settings->policy = ROBOT_POLICY_FAIR;
#endif
#endif
    settings->on_unknown = ROBOT_ON_UNKNOWN_DEFAULT;
    settings->service_timeout_us = UINT64_C(10000000);
    settings->action_timeout_us = FOREVER;
    settings->cancel_timeout_us = UINT64_C(5000000);
#if ROBOT_IS_LAYER
    settings->command_timeout_us = UINT64_C(1000000);
#endif
#if ROBOT_HAS_STRATEGY
    settings->assumption_timeout_us = UINT64_C(30000000);
#endif
    set_model_settings(settings);
}

bool robot_init(robot_t *r, const robot_settings_t *settings, const robot_callbacks_t *callbacks)
{
    memset(r, 0, sizeof *r);
    if (settings != NULL) {
        r->settings = *settings;
    } else {
        robot_default_settings(&r->settings);
    }
#if ROBOT_IS_LAYER
    if (callbacks == NULL || r->settings.on_unknown > ROBOT_ON_UNKNOWN_FAULT) {
        return false;
    }
#else
#if ROBOT_HAS_STRATEGY
    if (r->settings.policy > ROBOT_POLICY_STRATEGY) {
        return false;
    }
#else
    if (r->settings.policy > ROBOT_POLICY_RANDOM) {
        return false;
    }
#endif
    if (callbacks == NULL || r->settings.on_unknown > ROBOT_ON_UNKNOWN_FAULT || r->settings.priority_count < 0
        || r->settings.priority_count > ROBOT_REQUEST_COUNT) {
        return false;
    }
#if ROBOT_REQUEST_COUNT > 0
    for (int place = 0; place < r->settings.priority_count; place++) {
        if (request_of(r->settings.priority[place]) == ROBOT_REQUEST_COUNT) {
            return false;
        }
    }
#endif
#endif
    r->callbacks = *callbacks;
#if ROBOT_IS_LAYER
#if ROBOT_REQUEST_COUNT > 0
    if (callbacks->blocked == NULL) {
        return false;
    }
#if ROBOT_LIMIT_COUNT > 0
    if (callbacks->set_number == NULL) {
        return false;
    }
#endif
#endif
#if ROBOT_SENSOR_COUNT > 0
    if (callbacks->pass_on == NULL) {
        return false;
    }
#endif
#endif
#if ROBOT_TOPIC_COUNT > 0
    if (callbacks->publish == NULL || callbacks->publish_default == NULL) {
        return false;
    }
    for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
        forget_acting(r, topic);
    }
#endif
#if ROBOT_SERVICE_COUNT > 0
    if (callbacks->call == NULL) {
        return false;
    }
#if ROBOT_IS_LAYER
    if (callbacks->answer == NULL || callbacks->answer_default == NULL) {
        return false;
    }
#endif
    r->next_call_id = 1;
#endif
#if ROBOT_ACTION_COUNT > 0
    if (callbacks->send_goal == NULL || callbacks->cancel_goal == NULL) {
        return false;
    }
#if ROBOT_IS_LAYER
    if (callbacks->accept_goal == NULL || callbacks->reject_goal == NULL || callbacks->pass_feedback == NULL
        || callbacks->end_goal == NULL) {
        return false;
    }
#endif
    r->next_goal_id = 1;
#endif
    set_initial(&r->state);
#if ROBOT_HAS_STRATEGY
    forget_progress(r);
#endif
    return true;
}

void robot_start(robot_t *r, uint64_t now_us)
{
    if (!r->is_started) {
        r->now_us = now_us;
        guard(r, begin(r));
    }
}

#if !ROBOT_IS_LAYER
void robot_tick(robot_t *r, uint64_t now_us)
{
    if (!r->is_started) {
        return;
    }
    look_at_clock(r, now_us);
    if (r->may_request) {
#if ROBOT_REQUEST_COUNT > 0
        guard(r, decide(r));
#endif
    } else {
        (void)retry(r);
    }
}

#endif
void robot_watch(robot_t *r, uint64_t now_us)
{
    if (!r->is_started) {
        return;
    }
    look_at_clock(r, now_us);
    if (!r->may_request) {
        (void)retry(r);
    }
#if ROBOT_IS_LAYER
    finish(r);
#endif
}

void robot_stop(robot_t *r, uint64_t now_us, bool is_fault)
{
    r->now_us = now_us;
    if (is_fault) {
        fail(r, ROBOT_FAULT_CALLER);
        return;
    }
    note(r, ROBOT_LOG_STOP, -1);
    r->is_stopped = true;
    come_to_rest(r);
}

void robot_restart(robot_t *r, uint64_t now_us)
{
    bool is_restless = false;
    r->now_us = now_us;
#if ROBOT_TOPIC_COUNT > 0
    for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
        is_restless = is_restless || r->is_restless[topic];
    }
#endif
    if (is_restless || !is_at_rest(r)) {
        come_to_rest(r);
    }
    is_restless = false;
#if ROBOT_TOPIC_COUNT > 0
    for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
        is_restless = is_restless || r->is_restless[topic];
    }
#endif
    if (is_restless) {
        fail(r, ROBOT_FAULT_CALLBACK);
#if ROBOT_IS_LAYER
        finish(r);
#endif
        return;
    }
    r->is_stopped = false;
    r->fault = ROBOT_FAULT_NONE;
#if ROBOT_SENSOR_COUNT > 0
    for (int sensor = 0; sensor < ROBOT_SENSOR_COUNT; sensor++) {
        r->sensors[sensor].is_stale = false;
    }
#endif
    note(r, ROBOT_LOG_RESTART, -1);
    guard(r, begin(r));
#if ROBOT_IS_LAYER
    finish(r);
#endif
}

robot_status_t robot_status(const robot_t *r, uint64_t now_us)
{
    if (is_at_rest(r)) {
#if ROBOT_ACTION_COUNT > 0
        if (is_any_goal_open(r) && now_us < r->awaited_until_us) {
            return ROBOT_STATUS_STOPPING;
        }
#endif
        (void)now_us;
        return ROBOT_STATUS_STOPPED;
    }
    if (!r->is_started) {
        return ROBOT_STATUS_NEW;
    }
    return r->may_request ? ROBOT_STATUS_RUNNING : ROBOT_STATUS_WAITING;
}

bool robot_enabled(const robot_t *r, robot_event_t event)
{
    return is_allowed(&r->state, event);
}

robot_fault_t robot_fault(const robot_t *r)
{
    return r->fault;
}
#if ROBOT_SERVICE_COUNT > 0

bool robot_is_call_old(const robot_t *r, robot_communication_t service)
{
    bool found = false;
    for (int place = 0; place < ROBOT_SERVICE_COUNT; place++) {
        found = found || (SERVICES[place].communication == service && r->calls[place].is_open && r->calls[place].is_old);
    }
    return found;
}
#endif
#if ROBOT_ACTION_COUNT > 0

robot_cancelling_t robot_cancelling(const robot_t *r, robot_communication_t action)
{
    robot_cancelling_t found;
    memset(&found, 0, sizeof found);
    for (int place = 0; place < ROBOT_ACTION_COUNT; place++) {
        if (ACTIONS[place].communication == action && r->goals[place].is_open) {
            found = r->goals[place].cancelling;
        }
    }
    return found;
}
#if ROBOT_IS_LAYER

robot_abort_t robot_abort_reason(const robot_t *r, robot_communication_t action)
{
    robot_abort_t found = ROBOT_ABORT_FAILED;
    for (int place = 0; place < ROBOT_ACTION_COUNT; place++) {
        if (ACTIONS[place].communication == action) {
            found = r->goals[place].abort;
        }
    }
    return found;
}
#endif
#endif
