/* The executor: batches, silent steps, decisions, releases, calls, goals, sensors, safe stop. Nothing in this part
   depends on the model but through the tables and functions above it. A function that may find a fault tells by
   false, with the reason in `why`. */

static bool fault(robot_t *r, robot_fault_t why)
{
    r->why = why;
    return false;
}

static void note(const robot_t *r, robot_log_t kind, int what)
{
    if (r->callbacks.log != NULL) {
        r->callbacks.log(r->callbacks.context, kind, what);
    }
}

#if ROBOT_RECEIVED_COUNT > 0 || ROBOT_REQUEST_COUNT > 0 || ROBOT_SILENT_COUNT > 0
static void unexpected(robot_t *r, int event)
{
    r->counters.unexpected++;
    note(r, ROBOT_LOG_UNEXPECTED, event);
}

static void unknown(robot_t *r, int event)
{
    r->counters.unknown++;
    note(r, ROBOT_LOG_UNKNOWN, event);
}
#endif

static uint64_t later(uint64_t now_us, uint64_t span_us)
{
    return span_us > FOREVER - now_us ? FOREVER : now_us + span_us;
}

#if ROBOT_UNCONTROLLABLE_DATA > 0
/* Whether what came counts as having come, although something in it is unknown. */
static bool notes_count(robot_t *r, robot_event_t event, const notes_t *notes, bool may_keep)
{
    unknown(r, (int)event);
    if (notes->is_enum_unknown) {
        if (may_keep && r->settings.on_unknown == ROBOT_ON_UNKNOWN_KEEP) {
            return false;
        }
        if (r->settings.on_unknown == ROBOT_ON_UNKNOWN_FAULT) {
            r->is_pending = true;
        }
    }
    return true;
}
#endif

#if ROBOT_RECEIVED_COUNT > 0 || ROBOT_REQUEST_COUNT > 0 || ROBOT_SILENT_COUNT > 0
/* An event was taken, with so many skipped updates, or refused. */
static void happened(robot_t *r, robot_event_t event, int skipped)
{
    if (skipped == REFUSED) {
        unexpected(r, (int)event);
        return;
    }
    note(r, ROBOT_LOG_EVENT, (int)event);
    if (skipped > 0) {
        unknown(r, (int)event);
        if (r->settings.on_unknown == ROBOT_ON_UNKNOWN_FAULT) {
            r->is_pending = true;
        }
    }
}
#endif

#if ROBOT_REQUEST_COUNT > 0 || ROBOT_SILENT_COUNT > 0
/* Take an event that is enabled. */
static bool take(robot_t *r, robot_event_t event)
{
    const int skipped = take_event(&r->state, event);
    if (skipped == REFUSED) {
        return fault(r, ROBOT_FAULT_REFUSED);
    }
    happened(r, event, skipped);
    return true;
}
#endif

#if ROBOT_TOPIC_COUNT > 0
/* Messages that keep acting (releases). */

static void forget_acting(robot_t *r, int topic)
{
    r->acting[topic].request = -1;
    r->acting[topic].is_waiting = false;
}

static bool release(robot_t *r, int topic)
{
    if (!r->callbacks.publish_default(r->callbacks.context, (robot_topic_t)topic)) {
        return fault(r, ROBOT_FAULT_CALLBACK);
    }
    forget_acting(r, topic);
    note(r, ROBOT_LOG_RELEASE, topic);
    return true;
}

static bool keeps_acting(const robot_t *r, int request)
{
    return REQUESTS[request].topic >= 0 && r->settings.releases[REQUESTS[request].topic];
}

static bool another_is_enabled(const robot_t *r, int topic)
{
    for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
        if (REQUESTS[request].topic == topic && request != r->acting[topic].request
            && is_allowed(&r->state, REQUESTS[request].event)) {
            return true;
        }
    }
    return false;
}

/* Judge one message in a stable state. */
static void observe_acting(robot_t *r, int topic)
{
    robot_acting_t *acting = &r->acting[topic];
    bool holds[ROBOT_CONJUNCT_COUNT + 1] = {false};
    const bool is_enabled = is_allowed(&r->state, REQUESTS[acting->request].event);
    get_conjuncts(&r->state, acting->request, holds);
    if (acting->was_enabled && !is_enabled) {
        acting->is_due = true;
    }
    for (int place = 0; place < REQUESTS[acting->request].conjuncts; place++) {
        if (acting->held[place] && !holds[place]) {
            acting->is_due = true;
        }
        acting->held[place] = holds[place];
    }
    acting->was_enabled = is_enabled;
}

/* Release what is due in this stable state, in the order in which it was sent. */
static bool judge_releases(robot_t *r, int issuing)
{
    bool is_now[ROBOT_TOPIC_COUNT] = {false};
    for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
        robot_acting_t *acting = &r->acting[topic];
        if (acting->request >= 0) {
            acting->is_waiting = false;
            if (acting->request != issuing) {
                observe_acting(r, topic);
                if (acting->is_due) {
                    acting->is_waiting = another_is_enabled(r, topic);
                    is_now[topic] = !acting->is_waiting;
                }
            }
        }
    }
    for (;;) {
        int first = -1;
        for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
            if (is_now[topic] && (first < 0 || r->acting[topic].sent < r->acting[first].sent)) {
                first = topic;
            }
        }
        if (first < 0) {
            return true;
        }
        is_now[first] = false;
        if (!release(r, first)) {
            return false;
        }
    }
}

static bool is_any_waiting(const robot_t *r)
{
    for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
        if (r->acting[topic].is_waiting) {
            return true;
        }
    }
    return false;
}

static void sent(robot_t *r, int request, bool is_default)
{
    const int topic = REQUESTS[request].topic;
    robot_acting_t *acting = &r->acting[topic];
    forget_acting(r, topic);
    if (!is_default) {
        acting->request = request;
        acting->is_due = false;
        acting->sent = r->sent_count++;
        acting->was_enabled = is_allowed(&r->state, REQUESTS[request].event);
        get_conjuncts(&r->state, request, acting->held);
    }
}
#endif

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

/* Silent steps. */

/* Take one silent step, cancels first, then resets, then taus; whether there was one is told by `has_stepped`. */
static bool silent_step(robot_t *r, bool *has_stepped)
{
    (void)r;
    *has_stepped = true;
#if ROBOT_ACTION_COUNT > 0
    const int action = goal_to_cancel(r);
    if (action >= 0) {
        if (!take(r, ACTIONS[action].cancel)) {
            return false;
        }
        r->goals[action].is_running = false;
        return request_cancel(r, action);
    }
#endif
#if ROBOT_SILENT_COUNT > 0
    for (int place = 0; place < ROBOT_SILENT_COUNT; place++) {
        if (is_allowed(&r->state, SILENT[place])) {
            return take(r, SILENT[place]);
        }
    }
#endif
    *has_stepped = false;
    return true;
}

/* Silent steps after the first one. A run is deterministic: it ends if and only if no state comes twice, which the
   algorithm of R. P. Brent finds with one remembered state. */
static bool run_on(robot_t *r)
{
    state_t remembered = r->state;
    int64_t steps = 0;
    int64_t power = 1;
    int64_t distance = 0;
    bool has_remembered = false;
    bool has_stepped = true;
    while (has_stepped) {
        steps++;
        if (steps > SILENT_BOUND) {
            return fault(r, ROBOT_FAULT_ENDLESS);
        }
        if (steps > PATIENCE) {
            if (has_remembered && is_same_state(&r->state, &remembered)) {
                return fault(r, ROBOT_FAULT_ENDLESS);
            }
            distance++;
            if (distance == power) {
                remembered = r->state;
                has_remembered = true;
                power *= 2;
                distance = 0;
            }
        }
        if (!silent_step(r, &has_stepped)) {
            return false;
        }
    }
    return true;
}

/* Silent steps to the end; then releases and running goals are judged, if the stable state is another one. */
static bool settle(robot_t *r, int issuing, bool *has_changed)
{
    *has_changed = !r->has_stable || !is_same_state(&r->state, &r->stable);
    if (*has_changed) {
        bool has_stepped = false;
        r->has_stable = false;
        r->is_enabled_known = false;
#if ROBOT_REQUEST_COUNT > 0
        for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
            r->is_unchanging[request] = false;
        }
#endif
        if (!silent_step(r, &has_stepped) || (has_stepped && !run_on(r))) {
            return false;
        }
        r->stable = r->state;
        r->has_stable = true;
#if ROBOT_ACTION_COUNT > 0
        observe_goals(r);
#endif
#if ROBOT_TOPIC_COUNT > 0
        if (!judge_releases(r, issuing)) {
            return false;
        }
#endif
        (void)issuing;
    }
    if (r->is_pending) {
        r->is_pending = false;
        return fault(r, ROBOT_FAULT_UNKNOWN);
    }
    return true;
}

#if ROBOT_REQUEST_COUNT > 0
/* Decisions. */

static void new_policy(robot_t *r)
{
    r->decision = 0;
    r->is_new = false;
    r->random = r->settings.seed;
    for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
        r->was_enabled[request] = false;
        r->issued[request] = -1;
        r->favoured[request] = -ROBOT_REQUEST_COUNT;
    }
}

static bool is_listed(const robot_t *r, int request)
{
    for (int place = 0; place < r->settings.priority_count; place++) {
        if (r->settings.priority[place] == REQUESTS[request].communication) {
            return true;
        }
    }
    return false;
}

/* The splitmix64 generator (Steele, Lea and Flood, OOPSLA 2014). */
static int next_random(robot_t *r, int count)
{
    uint64_t z = (r->random += UINT64_C(0x9E3779B97F4A7C15));
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    z ^= z >> 31;
    return (int)(((z >> 32) * (uint64_t)count) >> 32);
}

static int choose_random(robot_t *r, const bool *candidates)
{
    int count = 0;
    int left = 0;
    int request = 0;
    for (int place = 0; place < ROBOT_REQUEST_COUNT; place++) {
        count += candidates[place] ? 1 : 0;
    }
    left = next_random(r, count);
    for (request = 0; request < ROBOT_REQUEST_COUNT - 1; request++) {
        if (candidates[request]) {
            if (left == 0) {
                break;
            }
            left--;
        }
    }
    return request;
}

/* Newly enabled requests first, each at most once in as many decisions as there are requests; then the longest-ago
   issued, never-issued first, source order. */
static int choose_fair(robot_t *r, const bool *candidates)
{
    int best = -1;
    bool is_best_new = false;
    for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
        if (candidates[request]) {
            const bool is_new
                = !r->was_enabled[request] && r->favoured[request] <= r->decision - ROBOT_REQUEST_COUNT;
            if (best < 0 || (is_new && !is_best_new)) {
                best = request;
                is_best_new = is_new;
            } else if (is_new == is_best_new && r->issued[request] < r->issued[best]) {
                best = request;
            }
        }
    }
    r->is_new = is_best_new;
    return best;
}

static int choose(robot_t *r, const bool *candidates)
{
    if (r->settings.policy == ROBOT_POLICY_RANDOM) {
        return choose_random(r, candidates);
    }
    if (r->settings.policy == ROBOT_POLICY_PRIORITY) {
        for (int place = 0; place < r->settings.priority_count; place++) {
            for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
                if (candidates[request] && REQUESTS[request].communication == r->settings.priority[place]) {
                    return request;
                }
            }
        }
    }
    return choose_fair(r, candidates);
}

static void remember_issued(robot_t *r, int request)
{
    const bool is_by_list = r->settings.policy == ROBOT_POLICY_PRIORITY && is_listed(r, request);
    if (r->settings.policy != ROBOT_POLICY_RANDOM && !is_by_list) {
        r->issued[request] = r->decision;
        if (r->is_new) {
            r->favoured[request] = r->decision;
        }
    }
}

/* A request cannot be issued: what acts on its identifier is released at once. */
static bool withhold(robot_t *r, int request)
{
    unknown(r, (int)REQUESTS[request].event);
#if ROBOT_TOPIC_COUNT > 0
    if (keeps_acting(r, request) && r->acting[REQUESTS[request].topic].request >= 0) {
        return release(r, REQUESTS[request].topic);
    }
#endif
    return true;
}

static bool send(robot_t *r, int request, const robot_request_t *data)
{
    const robot_callbacks_t *callbacks = &r->callbacks;
    (void)request;
#if ROBOT_SERVICE_COUNT > 0
    if (REQUESTS[request].service >= 0) {
        robot_call_t *call = &r->calls[REQUESTS[request].service];
        call->is_open = true;
        call->id = r->next_call_id++;
        call->deadline_us = later(r->now_us, r->settings.service_timeout_us);
        if (!callbacks->call(callbacks->context, call->id, data)) {
            call->is_open = false;
            return fault(r, ROBOT_FAULT_CALLBACK);
        }
        return true;
    }
#endif
#if ROBOT_ACTION_COUNT > 0
    if (REQUESTS[request].action >= 0) {
        robot_goal_t *goal = &r->goals[REQUESTS[request].action];
        goal->is_open = true;
        goal->is_running = true;
        goal->is_accepted = false;
        goal->is_cancel_wanted = false;
        goal->is_cancel_sent = false;
        goal->id = r->next_goal_id++;
        goal->deadline_us = later(r->now_us, r->settings.action_timeout_us);
        get_requirements(&r->state, REQUESTS[request].action, goal->held);
        if (!callbacks->send_goal(callbacks->context, goal->id, data)) {
            goal->is_open = false;
            return fault(r, ROBOT_FAULT_CALLBACK);
        }
        return true;
    }
#endif
    if (!callbacks->publish(callbacks->context, data)) {
        return fault(r, ROBOT_FAULT_CALLBACK);
    }
    return true;
}

/* Issue a request, unless its data is unknown or does not fit: whether it was is told by `is_issued`. */
static bool issue(robot_t *r, int request, bool *is_issued)
{
    robot_request_t data;
    const bool is_unchanging = r->is_unchanging[request];
    bool has_changed = false;
    *is_issued = false;
    memset(&data, 0, sizeof data);
    data.communication = REQUESTS[request].communication;
    if (!get_data(&r->state, request, &data)
        || (r->callbacks.fits != NULL && !r->callbacks.fits(r->callbacks.context, &data))) {
        return withhold(r, request);
    }
#if ROBOT_TOPIC_COUNT > 0
    const bool is_acting = keeps_acting(r, request);
    if (is_acting && !is_unchanging && r->acting[REQUESTS[request].topic].is_waiting) {
        forget_acting(r, REQUESTS[request].topic);
    }
#endif
    if (!take(r, REQUESTS[request].event)) {
        return false;
    }
    /* A step that changed nothing in this state changes nothing the next time. */
    if (!is_unchanging && !settle(r, request, &has_changed)) {
        return false;
    }
    if (REQUESTS[request].topic >= 0) {
        r->is_unchanging[request] = !has_changed;
#if ROBOT_TOPIC_COUNT > 0
        if (is_acting) {
            const bool is_default = is_data_default(request, &data);
            if (has_changed || is_default || r->acting[REQUESTS[request].topic].request != request) {
                sent(r, request, is_default);
            }
        }
#endif
    }
    if (!send(r, request, &data)) {
        return false;
    }
    *is_issued = true;
    return true;
}

/* Issue what the policy chooses among the candidates, or the next if its data is unknown or does not fit. */
static bool issue_one_of(robot_t *r, bool *candidates, int *issued)
{
    *issued = -1;
    for (;;) {
        bool is_issued = false;
        bool is_any = false;
        int chosen = 0;
        for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
            is_any = is_any || candidates[request];
        }
        if (!is_any) {
            return true;
        }
        chosen = choose(r, candidates);
        if (!issue(r, chosen, &is_issued)) {
            return false;
        }
        if (is_issued) {
            remember_issued(r, chosen);
            *issued = chosen;
            return true;
        }
        candidates[chosen] = false;
    }
}

static void find_enabled(robot_t *r)
{
    for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
        r->is_enabled[request] = is_allowed(&r->state, REQUESTS[request].event);
#if ROBOT_ACTION_COUNT > 0
        if (REQUESTS[request].action >= 0 && r->goals[REQUESTS[request].action].is_open) {
            r->is_enabled[request] = false;
        }
#endif
    }
    r->is_enabled_known = true;
}

static uint64_t next_deadline(const robot_t *r);

/* One decision. */
static bool decide(robot_t *r)
{
    bool enabled[ROBOT_REQUEST_COUNT];
    bool candidates[ROBOT_REQUEST_COUNT];
    int issued = -1;
    if (!r->is_enabled_known) {
        find_enabled(r);
    }
    for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
        enabled[request] = r->is_enabled[request];
        candidates[request] = enabled[request];
    }
#if ROBOT_TOPIC_COUNT > 0
    if (is_any_waiting(r)) {
        bool others[ROBOT_REQUEST_COUNT];
        for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
            const int topic = REQUESTS[request].topic;
            const bool is_ending
                = topic >= 0 && r->acting[topic].is_waiting && r->acting[topic].request != request;
            candidates[request] = enabled[request] && is_ending;
            others[request] = enabled[request] && !is_ending;
        }
        if (!issue_one_of(r, candidates, &issued)) {
            return false;
        }
        if (issued < 0 && !issue_one_of(r, others, &issued)) {
            return false;
        }
    } else
#endif
        if (!issue_one_of(r, candidates, &issued)) {
            return false;
        }
    for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
        r->was_enabled[request] = enabled[request];
    }
    r->decision++;
    if (issued >= 0 && REQUESTS[issued].topic < 0) {
        r->deadline_us = next_deadline(r);
    }
    return true;
}
#endif

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
        if (r->goals[action].is_open && r->goals[action].is_cancel_wanted && !request_cancel(r, action)) {
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
        r->goals[action].is_cancel_wanted = true;
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

/* Time. */

static void update_may_request(robot_t *r)
{
    r->may_request = r->is_started && !is_at_rest(r);
#if ROBOT_SENSOR_COUNT > 0
    for (int sensor = 0; sensor < ROBOT_SENSOR_COUNT; sensor++) {
        if (r->settings.max_age_us[SENSORS[sensor]] > 0 && !r->sensors[sensor].was_seen) {
            r->may_request = false;
        }
    }
#endif
}

static uint64_t next_deadline(const robot_t *r)
{
    uint64_t next = FOREVER;
#if ROBOT_SERVICE_COUNT > 0
    for (int service = 0; service < ROBOT_SERVICE_COUNT; service++) {
        if (r->calls[service].is_open && r->calls[service].deadline_us < next) {
            next = r->calls[service].deadline_us;
        }
    }
#endif
#if ROBOT_ACTION_COUNT > 0
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        if (r->goals[action].is_open && r->goals[action].is_running && r->goals[action].deadline_us < next) {
            next = r->goals[action].deadline_us;
        }
    }
#endif
#if ROBOT_SENSOR_COUNT > 0
    for (int sensor = 0; sensor < ROBOT_SENSOR_COUNT; sensor++) {
        const uint64_t max_age_us = r->settings.max_age_us[SENSORS[sensor]];
        const uint64_t age = later(r->sensors[sensor].seen_us, max_age_us);
        if (max_age_us > 0 && age > r->now_us && age < next) {
            next = age;
        }
    }
#endif
    (void)r;
    return next;
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
        happened(r, SERVICES[first].error, take_event(&r->state, SERVICES[first].error));
        if (!settle(r, -1, &has_changed)) {
            return false;
        }
    }
#endif
#if ROBOT_ACTION_COUNT > 0
    bool is_expired[ROBOT_ACTION_COUNT];
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        const robot_goal_t *goal = &r->goals[action];
        is_expired[action] = goal->is_open && goal->is_running && r->now_us >= goal->deadline_us;
    }
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        if (is_expired[action]) {
            r->goals[action].is_running = false;
            happened(r, ACTIONS[action].error, take_event(&r->state, ACTIONS[action].error));
            if (!settle(r, -1, &has_changed) || !request_cancel(r, action)) {
                return false;
            }
        }
    }
#endif
    (void)r;
    return true;
}

/* Replies that did not come in time, and stale sensors. */
static bool check_time(robot_t *r)
{
    if (!expire(r)) {
        return false;
    }
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
    r->deadline_us = next_deadline(r);
    return true;
}

/* Take the time; whatever is over by now has its effect first. */
static bool look_at_clock(robot_t *r, uint64_t now_us)
{
    r->now_us = now_us;
    return !(r->is_started && now_us >= r->deadline_us) || check_time(r);
}

#if ROBOT_RECEIVED_COUNT > 0
/* The end of a batch: silent steps, and a decision if each batch brings one. */
static bool end_batch(robot_t *r)
{
    bool has_changed = false;
    if (!settle(r, -1, &has_changed)) {
        return false;
    }
#if ROBOT_REQUEST_COUNT > 0
    if (r->settings.decides_after_batch && r->may_request) {
        return decide(r);
    }
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
static void see(robot_t *r, int sensor)
{
    if (r->settings.max_age_us[SENSORS[sensor]] > 0) {
        r->sensors[sensor].seen_us = r->now_us;
        r->sensors[sensor].was_seen = true;
        if (r->sensors[sensor].is_stale) {
            r->sensors[sensor].is_stale = false;
            note(r, ROBOT_LOG_RESUME, (int)SENSORS[sensor]);
            r->deadline_us = next_deadline(r);
        }
        update_may_request(r);
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
    return true;
}

void robot_call_failed(robot_t *r, uint64_t now_us, uint32_t id)
{
    int found = 0;
    if (!look_at_clock(r, now_us)) {
        fail(r, r->why);
        return;
    }
    for (int service = 0; service < ROBOT_SERVICE_COUNT; service++) {
        found = r->calls[service].is_open && r->calls[service].id == id ? service : found;
    }
    if (close_call(r, found, id)) {
        happened(r, SERVICES[found].error, take_event(&r->state, SERVICES[found].error));
        guard(r, end_batch(r));
    }
}
#endif

#if ROBOT_ACTION_COUNT > 0
/* The action whose open goal has an id, or -1. */
static int find_goal(robot_t *r, uint32_t id)
{
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        if (r->goals[action].is_open && r->goals[action].id == id) {
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
    r->goals[action].is_open = false;
    r->is_enabled_known = false;
}

void robot_goal_accepted(robot_t *r, uint64_t now_us, uint32_t id)
{
    int action = -1;
    if (!look_at_clock(r, now_us)) {
        fail(r, r->why);
        return;
    }
    action = find_goal(r, id);
    if (action >= 0) {
        r->goals[action].is_accepted = true;
        if (r->goals[action].is_cancel_wanted) {
            guard(r, request_cancel(r, action));
        }
    }
}

void robot_goal_ended(robot_t *r, uint64_t now_us, uint32_t id)
{
    int action = -1;
    if (!look_at_clock(r, now_us)) {
        fail(r, r->why);
        return;
    }
    action = find_goal(r, id);
    if (action >= 0) {
        close_goal(r, action);
        if (r->goals[action].is_running) {
            happened(r, ACTIONS[action].error, take_event(&r->state, ACTIONS[action].error));
            guard(r, end_batch(r));
        }
    }
}

void robot_cancel_refused(robot_t *r, uint64_t now_us, uint32_t id, bool has_ended)
{
    if (!look_at_clock(r, now_us)) {
        fail(r, r->why);
        return;
    }
    if (!has_ended && find_goal(r, id) >= 0) {
        fail(r, ROBOT_FAULT_CANCEL_REFUSED);
    }
}
#endif

static bool begin(robot_t *r)
{
    bool has_changed = false;
    r->is_started = true;
#if ROBOT_SERVICE_COUNT > 0
    for (int service = 0; service < ROBOT_SERVICE_COUNT; service++) {
        r->calls[service].is_open = false;
    }
#endif
#if ROBOT_ACTION_COUNT > 0
    for (int action = 0; action < ROBOT_ACTION_COUNT; action++) {
        r->goals[action].is_running = false;
    }
#endif
#if ROBOT_SENSOR_COUNT > 0
    for (int sensor = 0; sensor < ROBOT_SENSOR_COUNT; sensor++) {
        r->sensors[sensor].seen_us = r->now_us;
        r->sensors[sensor].was_seen = false;
    }
#endif
#if ROBOT_REQUEST_COUNT > 0
    new_policy(r);
    for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
        r->is_unchanging[request] = false;
    }
#endif
    set_initial(&r->state);
    r->has_stable = false;
    r->is_enabled_known = false;
    r->is_pending = false;
    if (!settle(r, -1, &has_changed)) {
        return false;
    }
    r->deadline_us = next_deadline(r);
    update_may_request(r);
    return true;
}

void robot_default_settings(robot_settings_t *settings)
{
    memset(settings, 0, sizeof *settings);
    settings->policy = ROBOT_POLICY_FAIR;
    settings->on_unknown = ROBOT_ON_UNKNOWN_DEFAULT;
    settings->service_timeout_us = UINT64_C(10000000);
    settings->action_timeout_us = FOREVER;
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
    if (callbacks == NULL || r->settings.policy > ROBOT_POLICY_RANDOM
        || r->settings.on_unknown > ROBOT_ON_UNKNOWN_FAULT || r->settings.priority_count < 0
        || r->settings.priority_count > ROBOT_REQUEST_COUNT) {
        return false;
    }
#if ROBOT_REQUEST_COUNT > 0
    for (int place = 0; place < r->settings.priority_count; place++) {
        bool is_request = false;
        for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
            is_request = is_request || REQUESTS[request].communication == r->settings.priority[place];
        }
        if (!is_request) {
            return false;
        }
    }
#endif
    r->callbacks = *callbacks;
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
    r->next_call_id = 1;
#endif
#if ROBOT_ACTION_COUNT > 0
    if (callbacks->send_goal == NULL || callbacks->cancel_goal == NULL) {
        return false;
    }
    r->next_goal_id = 1;
#endif
    set_initial(&r->state);
    return true;
}

void robot_start(robot_t *r, uint64_t now_us)
{
    if (!r->is_started) {
        r->now_us = now_us;
        guard(r, begin(r));
    }
}

void robot_tick(robot_t *r, uint64_t now_us)
{
    if (!r->is_started) {
        return;
    }
    if (!look_at_clock(r, now_us)) {
        fail(r, r->why);
        return;
    }
    if (r->may_request) {
#if ROBOT_REQUEST_COUNT > 0
        guard(r, decide(r));
#endif
    } else if (is_at_rest(r)) {
        (void)retry(r);
    }
}

void robot_watch(robot_t *r, uint64_t now_us)
{
    if (!r->is_started) {
        return;
    }
    if (!look_at_clock(r, now_us)) {
        fail(r, r->why);
        return;
    }
    if (is_at_rest(r)) {
        (void)retry(r);
    }
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
