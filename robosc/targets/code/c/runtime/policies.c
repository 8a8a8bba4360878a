#if ROBOT_REQUEST_COUNT > 0
/* Policies. */

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
#endif
