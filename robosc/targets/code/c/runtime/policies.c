#if ROBOT_REQUEST_COUNT > 0
/* Policies. Each request has a turn, a number; among several, the one with the least goes first. A request that was
   issued gets the next turn after all others. So the one that goes first is found at once, and there is nothing to be
   sorted; the turns are numbered anew when they are used up. */

enum {
    TURN_COUNT = 2 * ROBOT_REQUEST_COUNT,
    NOBODY = -1 /* instead of a request, or of a turn's owner */
};

/* The request of a communication. */
static int request_of(robot_communication_t communication)
{
    int request = 0;
    while (request < ROBOT_REQUEST_COUNT && REQUESTS[request].communication != communication) {
        request++;
    }
    return request;
}

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

/* One of the turns of some candidates, or NOBODY where there is none. */
static int choose(robot_t *r, const robot_set_t *among)
{
    return r->settings.policy == ROBOT_POLICY_RANDOM ? choose_random(r, among) : choose_turn(r, among);
}

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
