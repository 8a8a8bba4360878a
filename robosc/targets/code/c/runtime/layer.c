#if ROBOT_REQUEST_COUNT > 0
/* Requests of the caller: the reason why one is held back, or LET_THROUGH. */

static void hold_back(robot_t *r, const char *identifier, int why)
{
    note(r, ROBOT_LOG_BLOCKED, why);
    require(r, r->callbacks.blocked(r->callbacks.context, identifier, (robot_refusal_t)why));
    /* A request that was refused because of a fault stops the robot now that the caller knows. */
    guard(r, why != (int)ROBOT_REFUSAL_FAULT);
    finish(r);
}

/* Return the reason why nothing at all, or not this, is let through now. */
static int refusal(const robot_t *r, const robot_sent_t *sent_by_caller)
{
    if (r->may_request) {
        return sent_by_caller->is_finite ? LET_THROUGH : (int)ROBOT_REFUSAL_NOT_FINITE;
    }
    if (is_at_rest(r)) {
        return (int)ROBOT_REFUSAL_STOPPED;
    }
    if (!r->is_started) {
        return (int)ROBOT_REFUSAL_NOT_STARTED;
    }
#if ROBOT_ACTION_COUNT > 0
    if (is_any_goal_old(r)) {
        return (int)ROBOT_REFUSAL_OLD_GOALS;
    }
#endif
#if ROBOT_SERVICE_COUNT > 0
    if (is_any_call_old(r)) {
        return (int)ROBOT_REFUSAL_OLD_CALLS;
    }
#endif
    return (int)ROBOT_REFUSAL_WAITING;
}

/* A callback failed while something was let through. */
static int failed(robot_t *r)
{
    r->why = ROBOT_FAULT_CALLBACK;
    return (int)ROBOT_REFUSAL_FAULT;
}

#if ROBOT_LIMIT_COUNT > 0
/* Numbers are moved into the bounds that apply now; the program writes them into its message. */
static int limit_request(robot_t *r, int request, const robot_sent_t *sent_by_caller)
{
    double given[ROBOT_NUMBER_COUNT];
    memcpy(given, r->numbers, sizeof given);
    r->moved = limit_numbers(&r->state, request, r->numbers);
    if (r->moved < 0) {
        return (int)ROBOT_REFUSAL_NOT_WITHIN;
    }
    for (int place = 0; r->moved > 0 && place < ROBOT_NUMBER_COUNT; place++) {
        if ((r->numbers[place] < given[place] || r->numbers[place] > given[place])
            && !r->callbacks.set_number(r->callbacks.context, sent_by_caller->message,
                                        (robot_number_t)(FIRST_NUMBERS[request] + place), r->numbers[place])) {
            return failed(r);
        }
    }
    limited(r, request);
    return LET_THROUGH;
}
#endif

/* The request happens, if it is allowed, with all that follows from it, before its message goes out. */
static int take_request(robot_t *r, int request, const robot_sent_t *sent_by_caller)
{
    bool has_changed = false;
    (void)sent_by_caller;
    if (!is_allowed(&r->state, REQUESTS[request].event)) {
        return (int)ROBOT_REFUSAL_NOT_ALLOWED;
    }
#if ROBOT_LIMIT_COUNT > 0
    {
        const int why = limit_request(r, request, sent_by_caller);
        if (why != LET_THROUGH) {
            return why;
        }
    }
#endif
    if (!take(r, REQUESTS[request].event) || !settle(r, request, &has_changed)) {
        return (int)ROBOT_REFUSAL_FAULT;
    }
    return LET_THROUGH;
}

#if ROBOT_WHEN_COUNT > 0
/* Decide whether the condition of a message may be evaluated although some of its data is unknown. */
static int judge_notes(robot_t *r, robot_event_t event, const notes_t *notes)
{
    if (notes->is_unknown) {
        unknown(r, (int)event);
    }
    if (notes->is_enum_unknown && r->settings.on_unknown == ROBOT_ON_UNKNOWN_FAULT) {
        r->why = ROBOT_FAULT_UNKNOWN;
        return (int)ROBOT_REFUSAL_FAULT;
    }
    if (notes->is_enum_unknown && r->settings.on_unknown == ROBOT_ON_UNKNOWN_KEEP) {
        return (int)ROBOT_REFUSAL_NOT_KNOWN;
    }
    return LET_THROUGH;
}
#endif
#endif

#if ROBOT_TOPIC_COUNT > 0
/* A message came from the caller. */
static int message_refusal(robot_t *r, uint64_t now_us, int topic, const robot_sent_t *sent_by_caller)
{
    look_at_clock(r, now_us);
    r->arrived_us[topic] = r->now_us;
    return refusal(r, sent_by_caller);
}

/* It is one of the model's, unless `why` says otherwise. */
static void let_message_through(robot_t *r, int topic, int request, int why, const robot_sent_t *sent_by_caller)
{
    if (why == LET_THROUGH) {
        why = take_request(r, request, sent_by_caller);
    }
    if (why == LET_THROUGH) {
        if (keeps_acting(r, request)) {
#if ROBOT_LIMIT_COUNT > 0
            /* What was moved counts as acting, whatever it is: a release too many does no harm. */
            sent(r, request, sent_by_caller->is_default && r->moved == 0);
#else
            sent(r, request, sent_by_caller->is_default);
#endif
            wake_at(r, silent_from(r, topic));
        }
        if (!r->callbacks.publish(r->callbacks.context, (robot_topic_t)topic, sent_by_caller->message)) {
            why = failed(r);
        }
    }
    if (why != LET_THROUGH) {
        hold_back(r, robot_topic_name(topic), why);
        return;
    }
    finish(r);
}
#endif

#if ROBOT_SERVICE_COUNT + ROBOT_ACTION_COUNT > 0
/* A call or a goal came from the caller. */
static int request_refusal(robot_t *r, uint64_t now_us, const robot_sent_t *sent_by_caller)
{
    look_at_clock(r, now_us);
    return refusal(r, sent_by_caller);
}
#endif

#if ROBOT_SERVICE_COUNT > 0
/* The caller called a service: it is the one of the model, unless `why` says otherwise. */
static void let_call_through(robot_t *r, int request, int why, uint32_t caller_id,
                             const robot_sent_t *sent_by_caller)
{
    const robot_callbacks_t *callbacks = &r->callbacks;
    const robot_communication_t service = REQUESTS[request].communication;
    robot_call_t *call = &r->calls[REQUESTS[request].service];
    if (why == LET_THROUGH) {
        why = take_request(r, request, sent_by_caller);
    }
    if (why == LET_THROUGH) {
        open_call(r, call);
        if (callbacks->call(callbacks->context, call->id, service, sent_by_caller->message)) {
            call->is_awaited = true;
            call->caller_id = caller_id;
        } else {
            call->is_open = false;
            why = failed(r);
        }
    }
    if (why != LET_THROUGH) {
        require(r, callbacks->answer_default(callbacks->context, service, caller_id));
        hold_back(r, REQUESTS[request].identifier, why);
        return;
    }
    finish(r);
}

/* A reply was handled: its caller gets it, if it still waits for this call. */
static void answer_caller(robot_t *r, int service, bool is_awaited, const void *message)
{
    if (is_awaited) {
        r->calls[service].is_awaited = false;
        require(r, r->callbacks.answer(r->callbacks.context, SERVICES[service].communication,
                                       r->calls[service].caller_id, message));
    }
}
#endif

#if ROBOT_ACTION_COUNT > 0
static int send_goal(robot_t *r, int request, uint32_t caller_id, const void *message)
{
    const robot_callbacks_t *callbacks = &r->callbacks;
    const robot_communication_t action = REQUESTS[request].communication;
    robot_goal_t *goal = open_goal(r, REQUESTS[request].action);
    goal->is_cancelled_by_caller = false;
    goal->caller_id = caller_id;
    if (!callbacks->send_goal(callbacks->context, goal->id, action, message)) {
        set_open(r, REQUESTS[request].action, false);
        return failed(r);
    }
    if (!callbacks->accept_goal(callbacks->context, action, caller_id)) {
        return failed(r);
    }
    goal->is_awaited = true;
    return LET_THROUGH;
}

/* The caller sent a goal: it is one of this action, unless `why` says otherwise. */
static void let_goal_through(robot_t *r, int request, int why, uint32_t caller_id,
                             const robot_sent_t *sent_by_caller)
{
    const robot_callbacks_t *callbacks = &r->callbacks;
    if (why == LET_THROUGH && r->goals[REQUESTS[request].action].is_open) {
        why = (int)ROBOT_REFUSAL_STILL_RUNNING;
    }
    if (why == LET_THROUGH) {
        why = take_request(r, request, sent_by_caller);
    }
    if (why == LET_THROUGH) {
        why = send_goal(r, request, caller_id, sent_by_caller->message);
    }
    if (why != LET_THROUGH) {
        require(r, callbacks->reject_goal(callbacks->context, REQUESTS[request].communication, caller_id));
        hold_back(r, REQUESTS[request].identifier, why);
        return;
    }
    finish(r);
}

/* The caller cancels a goal. */
static void cancel_for_caller(robot_t *r, uint64_t now_us, int action, uint32_t caller_id)
{
    robot_goal_t *goal = &r->goals[action];
    look_at_clock(r, now_us);
    if (!goal->is_awaited || goal->caller_id != caller_id) {
        unexpected(r, ROBOT_NO_EVENT);
    } else {
        goal->is_cancelled_by_caller = true;
        begin_cancel(r, action, ROBOT_CANCEL_CALLER);
        guard(r, request_cancel(r, action));
    }
    finish(r);
}

/* Feedback was handled: its caller gets it. */
static void pass_feedback(robot_t *r, int action, const void *message)
{
    if (r->goals[action].is_awaited) {
        require(r, r->callbacks.pass_feedback(r->callbacks.context, ACTIONS[action].communication,
                                              r->goals[action].caller_id, message));
    }
}
#endif
