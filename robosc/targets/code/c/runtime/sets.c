/* Sets of numbers: a bit for each, and a bit for each word of these that is not zero, by which members are found. */

#if ROBOT_SET_COUNT > 0 || defined(ROBOT_AIM_COUNT)
/* Number of the lowest bit that is set; there is one. */
static int lowest_bit(uint32_t bits)
{
#ifdef __GNUC__
    return __builtin_ctzl(bits);
#else
    int number = 0;
    while ((bits >> number & 1U) == 0) {
        number++;
    }
    return number;
#endif
}
#endif

#if ROBOT_SET_COUNT > 0
enum {
    SET_WORDS = (ROBOT_SET_COUNT + 31) / 32,
    SET_PARTS = (SET_WORDS + 31) / 32
};

static void add_to(robot_set_t *set, int number)
{
    const unsigned place = SET_WORDS == 1 ? 0 : (unsigned)number / 32;
    set->bits[place] |= UINT32_C(1) << ((unsigned)number % 32);
    if (SET_WORDS > 1) {
        set->used[place / 32] |= UINT32_C(1) << (place % 32);
    }
}

static void remove_from(robot_set_t *set, int number)
{
    const unsigned place = SET_WORDS == 1 ? 0 : (unsigned)number / 32;
    set->bits[place] &= ~(UINT32_C(1) << ((unsigned)number % 32));
    if (SET_WORDS > 1 && set->bits[place] == 0) {
        set->used[place / 32] &= ~(UINT32_C(1) << (place % 32));
    }
}

/* The least member from a word on, or -1. */
static int first_from(const robot_set_t *set, unsigned word)
{
    uint32_t wanted = UINT32_MAX << (word % 32);
    for (unsigned part = word / 32; part < SET_PARTS; part++) {
        const uint32_t used = set->used[part] & wanted;
        if (used != 0) {
            const int found = 32 * (int)part + lowest_bit(used);
            return 32 * found + lowest_bit(set->bits[found]);
        }
        wanted = UINT32_MAX;
    }
    return -1;
}

/* The least member, or -1. */
static int first_in(const robot_set_t *set)
{
    if (SET_WORDS == 1) {
        return set->bits[0] == 0 ? -1 : lowest_bit(set->bits[0]);
    }
    return first_from(set, 0);
}

/* The next member after another one, or -1. */
static int next_in(const robot_set_t *set, int member)
{
    const unsigned word = SET_WORDS == 1 ? 0 : (unsigned)member / 32;
    const uint32_t bits = set->bits[word] & (UINT32_MAX << 1 << ((unsigned)member % 32));
    if (bits != 0) {
        return 32 * (int)word + lowest_bit(bits);
    }
    return SET_WORDS == 1 ? -1 : first_from(set, word + 1);
}

#if !ROBOT_IS_LAYER
#if ROBOT_REQUEST_COUNT > 0
static bool is_in(const robot_set_t *set, int number)
{
    const unsigned place = SET_WORDS == 1 ? 0 : (unsigned)number / 32;
    return (set->bits[place] >> ((unsigned)number % 32) & 1U) != 0;
}

static void empty(robot_set_t *set)
{
    if (SET_WORDS == 1) {
        set->bits[0] = 0;
    }
    for (int part = 0; part < SET_PARTS; part++) {
        for (; set->used[part] != 0; set->used[part] &= set->used[part] - 1) {
            set->bits[32 * part + lowest_bit(set->used[part])] = 0;
        }
    }
}

#endif
#endif
#endif

/* Whatever is allowed or not may have changed. */
static void all_changed(robot_t *r)
{
    r->is_stable = false;
#if ROBOT_STALE_COUNT > 0
    for (int number = 0; number < ROBOT_STALE_COUNT; number++) {
        add_to(&r->stale, number);
    }
#endif
}
