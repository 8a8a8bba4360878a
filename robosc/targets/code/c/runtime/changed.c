#if ROBOT_IS_SMALL
/* A part of the state has another value now: some silent steps and requests read it. */
static void changed(robot_t *r, uint32_t readers)
{
    r->is_stable = false;
#if ROBOT_STALE_COUNT > 0
    r->stale |= readers;
#else
    (void)readers;
#endif
}
#else
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
#endif
