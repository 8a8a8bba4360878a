#if ROBOT_REQUEST_COUNT > 0
#if ROBOT_IS_SMALL
/* Policies. Each request has a turn, a number; among several, the one with the least goes first. It is the number of the
   decision at which the request was issued last. Sets of candidates have the numbers of requests. */

enum { NOBODY = -1 };

static int member_of(const robot_t *r, int request)
{
    (void)r;
    return request;
}

static int request_with(const robot_t *r, int member)
{
    (void)r;
    return member;
}

#else
/* Policies. Each request has a turn, a number; among several, the one with the least goes first. A request that was
   issued gets the next turn after all others. So the one that goes first is found at once, and there is nothing to be
   sorted; the turns are numbered anew when they are used up. Sets of candidates have the turns of requests. */

enum {
    TURN_COUNT = 2 * ROBOT_REQUEST_COUNT,
    NOBODY = -1 /* instead of a request, or of a turn's owner */
};

static int member_of(const robot_t *r, int request)
{
    return r->turns[request];
}

static int request_with(const robot_t *r, int member)
{
    return r->owners[member];
}

#endif
/* The request of a communication. */
static int request_of(robot_communication_t communication)
{
    int request = 0;
    while (request < ROBOT_REQUEST_COUNT && REQUESTS[request].communication != communication) {
        request++;
    }
    return request;
}

#if ROBOT_IS_SMALL
/* In the beginning the list of the policy `priority` comes first, and then all others in source order. */
static void new_policy(robot_t *r)
{
    const int listed_count = r->settings.policy == ROBOT_POLICY_PRIORITY ? r->settings.priority_count : 0;
    r->decision = 0;
    r->random = r->settings.seed;
    empty(&r->candidates);
    empty(&r->fresh);
    empty(&r->withheld);
    empty(&r->unchanging);
    for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
        r->turns[request] = request - ROBOT_REQUEST_COUNT;
        r->favoured[request] = -ROBOT_REQUEST_COUNT;
    }
    for (int place = listed_count - 1; place >= 0; place--) {
        r->turns[request_of(r->settings.priority[place])] = place - 2 * ROBOT_REQUEST_COUNT;
    }
}

static bool is_listed(const robot_t *r, int request)
{
    return r->turns[request] < -ROBOT_REQUEST_COUNT;
}

#else
/* A request gets the next turn after all others. */
static void give_turn(robot_t *r, int request)
{
    r->turns[request] = r->next_turn;
    r->owners[r->next_turn] = request;
    r->next_turn++;
}

/* In the beginning the list of the policy `priority` comes first, and then all others in source order. */
static void new_policy(robot_t *r)
{
    const int listed_count = r->settings.policy == ROBOT_POLICY_PRIORITY ? r->settings.priority_count : 0;
    r->decision = 0;
    r->random = r->settings.seed;
    r->next_turn = 0;
    empty(&r->candidates);
    empty(&r->fresh);
    empty(&r->withheld);
    empty(&r->unchanging);
    for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
        r->turns[request] = NOBODY;
        r->favoured[request] = -ROBOT_REQUEST_COUNT;
    }
    for (int place = 0; place < listed_count; place++) {
        const int request = request_of(r->settings.priority[place]);
        if (r->turns[request] == NOBODY) {
            give_turn(r, request);
        }
    }
    r->listed_count = r->next_turn;
    for (int request = 0; request < ROBOT_REQUEST_COUNT; request++) {
        if (r->turns[request] == NOBODY) {
            give_turn(r, request);
        }
    }
}

/* Number the turns anew, in the same order. Between decisions nothing but `candidates` has any. */
static void renumber_turns(robot_t *r)
{
    r->next_turn = 0;
    for (int turn = 0; turn < TURN_COUNT; turn++) {
        const int request = r->owners[turn];
        if (request != NOBODY) {
            if (is_in(&r->candidates, turn)) {
                remove_from(&r->candidates, turn);
                add_to(&r->candidates, r->next_turn);
            }
            r->owners[turn] = NOBODY;
            give_turn(r, request);
        }
    }
}

#endif
/* The splitmix64 generator (Steele, Lea and Flood, OOPSLA 2014). */
static int next_random(robot_t *r, int count)
{
    uint64_t z = (r->random += UINT64_C(0x9E3779B97F4A7C15));
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    z ^= z >> 31;
    return (int)(((z >> 32) * (uint64_t)count) >> 32);
}

/* Where chance decides, no request ever gets another turn: they are in source order. */
static int choose_random(robot_t *r, const robot_set_t *among)
{
    int left = 0;
    for (int turn = first_in(among); turn >= 0; turn = next_in(among, turn)) {
        left++;
    }
    if (left > 0) {
        int turn = first_in(among);
        for (left = next_random(r, left); left > 0; left--) {
            turn = next_in(among, turn);
        }
        return turn;
    }
    return NOBODY;
}

#if ROBOT_IS_SMALL
/* The one of some requests whose turn comes first, or NOBODY. */
static int first_of(const robot_t *r, robot_set_t among)
{
    int first = first_in(&among);
    for (int request = first; request >= 0; request = next_in(&among, request)) {
        first = r->turns[request] < r->turns[first] ? request : first;
    }
    return first;
}

/* The one of some requests that goes first, or NOBODY. Newly enabled requests are preferred, each at most once in as many
   decisions as there are requests; but those of the list go before. */
static int choose_turn(robot_t *r, const robot_set_t *among)
{
    const int best = first_of(r, *among);
    robot_set_t new = r->fresh & *among;
    for (int request = first_in(&new); request >= 0; request = next_in(&new, request)) {
        if (r->favoured[request] > r->decision - ROBOT_REQUEST_COUNT) {
            remove_from(&new, request);
        }
    }
    r->is_new = new != 0 && !is_listed(r, best);
    return r->is_new ? first_of(r, new) : best;
}

#else
/* The turn that comes first among some, or NOBODY. Newly enabled requests are preferred, each at most once in as many
   decisions as there are requests; but those of the list go before. */
static int choose_turn(robot_t *r, const robot_set_t *among)
{
    const int best = first_in(among);
    r->is_new = false;
    if (best < r->listed_count) {
        return best;
    }
    for (int turn = first_in(&r->fresh); turn >= 0; turn = next_in(&r->fresh, turn)) {
        if (is_in(among, turn) && r->favoured[r->owners[turn]] <= r->decision - ROBOT_REQUEST_COUNT) {
            r->is_new = true;
            return turn;
        }
    }
    return best;
}

#endif
/* One of some candidates, or NOBODY where there is none. */
static int choose(robot_t *r, const robot_set_t *among)
{
    return r->settings.policy == ROBOT_POLICY_RANDOM ? choose_random(r, among) : choose_turn(r, among);
}

#if ROBOT_IS_SMALL
/* A request was issued. It is a candidate until it turns out that it is none any longer. */
static void remember_issued(robot_t *r, int request)
{
    if (!is_listed(r, request)) {
        if (r->is_new) {
            r->favoured[request] = r->decision;
        }
        r->turns[request] = r->decision;
    }
}

static void end_decision(robot_t *r)
{
    r->candidates |= r->withheld;
    empty(&r->withheld);
    empty(&r->fresh);
    r->decision++;
}
#else
/* The request with a turn was issued. It is a candidate until it turns out that it is none any longer. */
static void remember_issued(robot_t *r, int turn)
{
    if (r->settings.policy != ROBOT_POLICY_RANDOM && turn >= r->listed_count) {
        const int request = r->owners[turn];
        if (r->is_new) {
            r->favoured[request] = r->decision;
        }
        remove_from(&r->candidates, turn);
        add_to(&r->candidates, r->next_turn);
        r->owners[turn] = NOBODY;
        give_turn(r, request);
    }
}

static void end_decision(robot_t *r)
{
    for (int turn = first_in(&r->withheld); turn >= 0; turn = next_in(&r->withheld, turn)) {
        add_to(&r->candidates, turn);
    }
    empty(&r->withheld);
    empty(&r->fresh);
    r->decision++;
    if (r->next_turn == TURN_COUNT) {
        renumber_turns(r);
    }
}
#endif
#endif
