#if ROBOT_REQUEST_COUNT > 0
/* Decisions. */

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
        open_call(r, call);
        if (!callbacks->call(callbacks->context, call->id, data)) {
            call->is_open = false;
            return fault(r, ROBOT_FAULT_CALLBACK);
        }
        return true;
    }
#endif
#if ROBOT_ACTION_COUNT > 0
    if (REQUESTS[request].action >= 0) {
        robot_goal_t *goal = open_goal(r, REQUESTS[request].action);
        if (!callbacks->send_goal(callbacks->context, goal->id, data)) {
            set_open(r, REQUESTS[request].action, false);
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

/* Issue a request, unless its data is unknown or does not fit: `is_issued` says whether it was. */
static bool issue(robot_t *r, int request, bool *is_issued)
{
    robot_request_t data;
    const bool is_unchanging = is_in(&r->unchanging, request);
    bool has_changed = false;
    *is_issued = false;
    memset(&data, 0, sizeof data);
    data.communication = REQUESTS[request].communication;
    if (!get_data(&r->state, request, &data)) {
        return withhold(r, request);
    }
#if ROBOT_LIMIT_COUNT > 0
    get_numbers(request, &data, r->numbers);
    r->moved = limit_numbers(&r->state, request, r->numbers);
    if (r->moved < 0) {
        return withhold(r, request);
    }
    if (r->moved > 0) {
        set_numbers(request, &data, r->numbers);
    }
#endif
    if ((r->callbacks.fits != NULL && !r->callbacks.fits(r->callbacks.context, &data))) {
        return withhold(r, request);
    }
#if ROBOT_LIMIT_COUNT > 0
    limited(r, request);
#endif
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
        if (!has_changed) {
            add_to(&r->unchanging, request);
        }
#if ROBOT_TOPIC_COUNT > 0
        if (is_acting) {
            const bool is_default = is_data_default(request, &data);
            if (has_changed || is_default || r->acting[REQUESTS[request].topic].request != request) {
                sent(r, request, is_default);
            }
#if ROBOT_LIMIT_COUNT > 0
            else if (!is_unchanging) {
                /* In an earlier state other limits, or other conditions of its data, applied. */
                robot_acting_t *acting = &r->acting[REQUESTS[request].topic];
                memcpy(acting->numbers, r->numbers, sizeof acting->numbers);
                (void)get_held(r, acting, acting->held);
            }
#endif
        }
#endif
    }
    if (!send(r, request, &data)) {
        return false;
    }
    *is_issued = true;
    return true;
}

/* Issue what the policy chooses among some candidates, or the next if its data is unknown or does not fit. */
static bool issue_one_of(robot_t *r, robot_set_t *among, bool *is_issued)
{
    int member = choose(r, among);
    *is_issued = false;
    while (member != NOBODY) {
        if (!issue(r, request_with(r, member), is_issued)) {
            return false;
        }
        if (*is_issued) {
            remember_issued(r, member);
            return true;
        }
        remove_from(among, member);
        remove_from(&r->candidates, member);
        add_to(&r->withheld, member);
        member = choose(r, among);
    }
    return true;
}

/* Whether a request is enabled, and no goal of its action is open. */
static bool may_be_issued(const robot_t *r, int request)
{
#if ROBOT_ACTION_COUNT > 0
    if (REQUESTS[request].action >= 0 && r->goals[REQUESTS[request].action].is_open) {
        return false;
    }
#endif
    return is_allowed(&r->state, REQUESTS[request].event);
}

/* Look at the requests that may be enabled now or no longer. */
static void find_candidates(robot_t *r)
{
    for (int number = first_in(&r->stale); number >= 0; number = next_in(&r->stale, number)) {
        const int request = number - ROBOT_SILENT_COUNT;
        if (request >= 0) {
            const int member = member_of(r, request);
            remove_from(&r->stale, number);
            if (!may_be_issued(r, request)) {
                remove_from(&r->candidates, member);
            } else if (!is_in(&r->candidates, member)) {
                add_to(&r->candidates, member);
                add_to(&r->fresh, member);
            }
        }
    }
}

#if ROBOT_TOPIC_COUNT > 0
/* The candidates whose message ends a release that waits. */
static void find_ending(const robot_t *r, robot_set_t *ending)
{
    memset(ending, 0, sizeof *ending);
    for (int topic = first_in(&r->acting_topics); topic >= 0; topic = next_in(&r->acting_topics, topic)) {
        if (r->acting[topic].is_waiting) {
            const int sender = r->acting[topic].request;
            for (int request = REQUESTS[sender].next; request != sender; request = REQUESTS[request].next) {
                if (is_in(&r->candidates, member_of(r, request))) {
                    add_to(ending, member_of(r, request));
                }
            }
        }
    }
}

#endif
#if ROBOT_HAS_STRATEGY
/* The request that the strategy chooses, or -1 to wait. */
static int choose_strategically(robot_t *r)
{
    int approached = 0;
    const int chosen = choose_by_strategy(&r->state, r->seen, &approached);
    r->chosen = chosen;
    if (approached != r->approached) {
        r->approached = approached;
        note(r, ROBOT_LOG_APPROACH, approached);
    }
    return chosen >= 0 && may_be_issued(r, chosen) ? chosen : -1;
}

/* One decision by the strategy: it is asked once in each stable state, and of the requests, the one that it chooses
   alone is asked whether it is enabled. */
static bool decide_strategically(robot_t *r)
{
    bool is_issued = false;
    int request = r->candidate;
    if (!r->is_choice_known) {
        request = r->candidate = choose_strategically(r);
        r->is_choice_known = true;
    }
#if ROBOT_TOPIC_COUNT > 0
    if (r->waiting_count > 0) {
        const int topic = request < 0 ? -1 : REQUESTS[request].topic;
        if (topic >= 0 && r->acting[topic].is_waiting && r->acting[topic].request != request) {
            if (!issue(r, request, &is_issued)) {
                return false;
            }
            if (is_issued) {
                return true;
            }
            request = -1;
        }
        /* The strategy chooses something else, or nothing: then no message comes that the releases wait for. */
        if (!release_waiting(r)) {
            return false;
        }
    }
#endif
    if (request < 0) {
        return true;
    }
    return issue(r, request, &is_issued);
}

#endif
/* One decision. */
static bool decide(robot_t *r)
{
    bool is_issued = false;
#if ROBOT_HAS_STRATEGY
    if (r->settings.policy == ROBOT_POLICY_STRATEGY) {
        return decide_strategically(r);
    }
#endif
    find_candidates(r);
#if ROBOT_TOPIC_COUNT > 0
    if (r->waiting_count > 0) {
        robot_set_t ending;
        find_ending(r, &ending);
        if (!issue_one_of(r, &ending, &is_issued)) {
            return false;
        }
    }
#endif
    if (!is_issued && !issue_one_of(r, &r->candidates, &is_issued)) {
        return false;
    }
    end_decision(r);
    return true;
}
#endif
