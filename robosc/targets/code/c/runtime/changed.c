/* A part of the state has another value now: at `place` of READERS stand those that read it. */
static void changed(robot_t *r, int place)
{
    r->is_stable = false;
#if ROBOT_STALE_COUNT > 0
    for (int k = 1; k <= (int)READERS[place]; k++) {
        add_to(&r->stale, (int)READERS[place + k]);
    }
#else
    (void)place;
#endif
}
