#if ROBOT_TOPIC_COUNT > 0
/* Messages that keep acting (releases). */

static void forget_acting(robot_t *r, int topic)
{
    r->acting[topic].request = -1;
#if !ROBOT_IS_LAYER
    r->acting[topic].is_waiting = false;
#endif
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

#if !ROBOT_IS_LAYER
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

#endif
/* What allows a message to go on acting, apart from its request: how many conditions that is. */
static int get_held(const robot_t *r, const robot_acting_t *acting, bool *holds)
{
    int count = REQUESTS[acting->request].conjuncts;
    get_conjuncts(&r->state, acting->request, holds);
#if ROBOT_LIMIT_COUNT > 0
    {
        double numbers[ROBOT_NUMBER_COUNT];
        memcpy(numbers, acting->numbers, sizeof numbers);
        holds[count++] = limit_numbers(&r->state, acting->request, numbers) == 0;
    }
#endif
    return count;
}

/* Judge one message in a stable state. */
static void observe_acting(robot_t *r, int topic)
{
    robot_acting_t *acting = &r->acting[topic];
    bool holds[ROBOT_CONJUNCT_COUNT + 1] = {false};
    const int count = get_held(r, acting, holds);
    const bool is_enabled = is_allowed(&r->state, REQUESTS[acting->request].event);
    if (acting->was_enabled && !is_enabled) {
        acting->is_due = true;
    }
    for (int place = 0; place < count; place++) {
        if (acting->held[place] && !holds[place]) {
            acting->is_due = true;
        }
        acting->held[place] = holds[place];
    }
    acting->was_enabled = is_enabled;
}

/* Release what acts on the topics that are marked, in the order in which it was sent. */
static bool release_marked(robot_t *r, bool *is_marked)
{
    for (;;) {
        int first = -1;
        for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
            if (is_marked[topic] && (first < 0 || r->acting[topic].sent < r->acting[first].sent)) {
                first = topic;
            }
        }
        if (first < 0) {
            return true;
        }
        is_marked[first] = false;
        if (!release(r, first)) {
            return false;
        }
    }
}

/* Release what is due in this stable state. */
static bool judge_releases(robot_t *r, int issuing)
{
    bool is_now[ROBOT_TOPIC_COUNT] = {false};
    bool is_any = false;
    for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
        robot_acting_t *acting = &r->acting[topic];
        if (acting->request >= 0) {
#if !ROBOT_IS_LAYER
            acting->is_waiting = false;
#endif
            if (acting->request != issuing) {
                observe_acting(r, topic);
#if ROBOT_IS_LAYER
                is_now[topic] = acting->is_due;
#else
                if (acting->is_due) {
                    acting->is_waiting = another_is_enabled(r, topic);
                    is_now[topic] = !acting->is_waiting;
                }
#endif
                is_any = is_any || is_now[topic];
            }
        }
    }
    return !is_any || release_marked(r, is_now);
}

#if !ROBOT_IS_LAYER
static bool is_any_waiting(const robot_t *r)
{
    for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
        if (r->acting[topic].is_waiting) {
            return true;
        }
    }
    return false;
}

#endif
#if ROBOT_HAS_STRATEGY
/* Release what waits for a message that does not come. */
static bool release_waiting(robot_t *r)
{
    bool is_now[ROBOT_TOPIC_COUNT] = {false};
    for (int topic = 0; topic < ROBOT_TOPIC_COUNT; topic++) {
        is_now[topic] = r->acting[topic].is_waiting;
    }
    return release_marked(r, is_now);
}

#endif
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
#if ROBOT_LIMIT_COUNT > 0
        memcpy(acting->numbers, r->numbers, sizeof acting->numbers);
#endif
        (void)get_held(r, acting, acting->held);
    }
}
#endif
