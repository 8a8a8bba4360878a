#if ROBOT_IS_LAYER
/* The layer: batches, silent steps, requests of the caller, releases, calls, goals, sensors, safe stop. Nothing in this
   part depends on the model but through the tables and functions above it. A function that may find a fault says by
   false, with the reason in `why`. */
#else
/* The executor: batches, silent steps, decisions, releases, calls, goals, sensors, safe stop. Nothing in this part
   depends on the model but through the tables and functions above it. A function that may find a fault says by
   false, with the reason in `why`. */
#endif

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

#if ROBOT_LIMIT_COUNT > 0
/* Numbers of a request that goes out were moved, as `moved` says. */
static void limited(robot_t *r, int request)
{
    if (r->moved > 0) {
        r->counters.limited += (uint32_t)r->moved;
        note(r, ROBOT_LOG_LIMITED, (int)REQUESTS[request].event);
    }
}
#endif

static uint64_t later(uint64_t now_us, uint64_t span_us)
{
    return span_us > FOREVER - now_us ? FOREVER : now_us + span_us;
}

#if ROBOT_TIMES > 0
/* Look at the time at that moment at the latest. */
static void wake_at(robot_t *r, uint64_t due_us)
{
    if (due_us < r->deadline_us) {
        r->deadline_us = due_us;
    }
}
#endif

#if ROBOT_UNCONTROLLABLE_DATA > 0
/* Return true if what came counts as having come, although something in it is unknown. */
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
    const int skipped = take_event(r, event);
    if (skipped == REFUSED) {
        return fault(r, ROBOT_FAULT_REFUSED);
    }
    happened(r, event, skipped);
    return true;
}
#endif
