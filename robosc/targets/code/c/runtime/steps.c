/* Silent steps. */

/* Take one silent step, resets first, then taus; `has_stepped` says whether there was one. Goals that turn against
   their requirements are cancelled before it. */
static bool silent_step(robot_t *r, bool *has_stepped)
{
    (void)r;
    *has_stepped = true;
#if ROBOT_ACTION_COUNT > 0
    if (!cancel_turned(r)) {
        return false;
    }
#endif
#if ROBOT_SILENT_COUNT > 0
    for (int place = first_in(&r->stale); place >= 0 && place < ROBOT_SILENT_COUNT; place = next_in(&r->stale, place)) {
        if (is_allowed(&r->state, SILENT[place])) {
            return take(r, SILENT[place]);
        }
        remove_from(&r->stale, place);
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

/* Silent steps to the end; then releases and running goals are judged, if the stable state may be another one. */
static bool settle(robot_t *r, int issuing, bool *has_changed)
{
    *has_changed = !r->is_stable;
    if (*has_changed) {
        bool has_stepped = false;
#if ROBOT_HAS_STRATEGY
        r->is_choice_known = false;
#endif
#if !ROBOT_IS_LAYER
#if ROBOT_REQUEST_COUNT > 0
        empty(&r->unchanging);
#endif
#endif
        if (!silent_step(r, &has_stepped) || (has_stepped && !run_on(r))) {
            return false;
        }
        r->is_stable = true;
#if ROBOT_HAS_STRATEGY
        observe_progress(r);
#endif
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
