#if ROBOT_TOPIC_COUNT > 0
/* Messages that keep acting (releases). */

#if !ROBOT_IS_LAYER
/* Note whether a release waits for another message on a topic. */
static void set_waiting(robot_t *r, int topic, bool is_waiting)
{
    r->waiting_count += (is_waiting ? 1 : 0) - (r->acting[topic].is_waiting ? 1 : 0);
    r->acting[topic].is_waiting = is_waiting;
}

#endif
static void forget_acting(robot_t *r, int topic)
{
    r->acting[topic].request = -1;
    remove_from(&r->acting_topics, topic);
#if !ROBOT_IS_LAYER
    set_waiting(r, topic, false);
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
    const int sender = r->acting[topic].request;
    int request = REQUESTS[sender].next;
    while (request != sender && !is_allowed(&r->state, REQUESTS[request].event)) {
        request = REQUESTS[request].next;
    }
    return request != sender;
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

/* Release what acts on some topics, in the order in which it was sent. */
static bool release_all(robot_t *r, robot_set_t *topics)
{
    for (;;) {
        int first = first_in(topics);
        if (first < 0) {
            return true;
        }
        for (int topic = next_in(topics, first); topic >= 0; topic = next_in(topics, topic)) {
            first = r->acting[topic].sent < r->acting[first].sent ? topic : first;
        }
        remove_from(topics, first);
        if (!release(r, first)) {
            return false;
        }
    }
}

/* Release what is due in this stable state. */
static bool judge_releases(robot_t *r, int issuing)
{
    robot_set_t due;
    int topic = first_in(&r->acting_topics);
    if (topic < 0) {
        return true;
    }
    memset(&due, 0, sizeof due);
    for (; topic >= 0; topic = next_in(&r->acting_topics, topic)) {
        const robot_acting_t *acting = &r->acting[topic];
#if ROBOT_IS_LAYER
        if (acting->request != issuing) {
            observe_acting(r, topic);
            if (acting->is_due) {
                add_to(&due, topic);
            }
        }
#else
        bool is_waiting = false;
        if (acting->request != issuing) {
            observe_acting(r, topic);
            is_waiting = acting->is_due && another_is_enabled(r, topic);
            if (acting->is_due && !is_waiting) {
                add_to(&due, topic);
            }
        }
        set_waiting(r, topic, is_waiting);
#endif
    }
    return release_all(r, &due);
}

#if ROBOT_HAS_STRATEGY
/* Release what waits for a message that does not come. */
static bool release_waiting(robot_t *r)
{
    robot_set_t waiting = r->acting_topics;
    for (int topic = first_in(&waiting); topic >= 0; topic = next_in(&waiting, topic)) {
        if (!r->acting[topic].is_waiting) {
            remove_from(&waiting, topic);
        }
    }
    return release_all(r, &waiting);
}

#endif
static void sent(robot_t *r, int request, bool is_default)
{
    const int topic = REQUESTS[request].topic;
    robot_acting_t *acting = &r->acting[topic];
    forget_acting(r, topic);
    if (!is_default) {
        acting->request = request;
        add_to(&r->acting_topics, topic);
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
