/* Rest. */

/* Send the default messages and cancels that are still owed; how many failed. */
static unsigned retry(robot_t *r)
{
    unsigned failures = 0;
#if ROBOT_TOPIC_COUNT > 0
    for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
        if (r->is_restless[topic]) {
            r->is_restless[topic] = !r->callbacks.publish_default(r->callbacks.context, (robot_topic_t)topic);
            failures += r->is_restless[topic] ? 1U : 0U;
        }
    }
#endif
#if ROBOT_ACTION_COUNT > 0
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        if (!request_cancel(r, action)) {
            failures++;
        }
    }
#endif
    (void)r;
    return failures;
}

static void add_fault(robot_t *r, robot_fault_t why)
{
    r->counters.faults++;
    note(r, ROBOT_LOG_FAULT, (int)why);
    if (r->fault == ROBOT_FAULT_NONE) {
        r->fault = why;
    }
}

static void come_to_rest(robot_t *r)
{
    unsigned failures = 0;
    r->may_request = false;
    r->awaited_until_us = later(r->now_us, CANCEL_WAIT_US);
#if ROBOT_TOPIC_COUNT > 0
    for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
        r->is_restless[topic] = r->settings.releases[topic];
    }
#endif
#if ROBOT_ACTION_COUNT > 0
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        begin_cancel(r, action, ROBOT_CANCEL_STOP);
    }
#endif
    failures = retry(r);
#if ROBOT_TOPIC_COUNT > 0
    for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
        forget_acting(r, topic);
    }
#endif
    for (; failures > 0; failures--) {
        add_fault(r, ROBOT_FAULT_CALLBACK);
    }
}

static void fail(robot_t *r, robot_fault_t why)
{
    add_fault(r, why);
    come_to_rest(r);
}

static bool is_at_rest(const robot_t *r)
{
#if ROBOT_SENSOR_COUNT > 0
    for (int sensor = 0; sensor < ROBOT_SENSOR_COUNT; sensor++) {
        if (r->sensors[sensor].is_stale) {
            return true;
        }
    }
#endif
    return r->is_stopped || r->fault != ROBOT_FAULT_NONE;
}
