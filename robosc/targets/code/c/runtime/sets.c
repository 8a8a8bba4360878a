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
    const unsigned place = (unsigned)number;
    set->bits[place / 32] |= UINT32_C(1) << (place % 32);
    set->used[place / 1024] |= UINT32_C(1) << (place / 32 % 32);
}

static void remove_from(robot_set_t *set, int number)
{
    const unsigned place = (unsigned)number;
    set->bits[place / 32] &= ~(UINT32_C(1) << (place % 32));
    if (set->bits[place / 32] == 0) {
        set->used[place / 1024] &= ~(UINT32_C(1) << (place / 32 % 32));
    }
}

/* The least member, or -1. */
static int first_in(const robot_set_t *set)
{
    for (int part = 0; part < SET_PARTS; part++) {
        if (set->used[part] != 0) {
            const int word = 32 * part + lowest_bit(set->used[part]);
            return 32 * word + lowest_bit(set->bits[word]);
        }
    }
    return -1;
}

/* The next member after another one, or -1. */
static int next_in(const robot_set_t *set, int member)
{
    const unsigned next = (unsigned)member + 1;
    unsigned word = next / 32;
    uint32_t found = next % 32 == 0 ? 0 : set->bits[word] & (UINT32_MAX << (next % 32));
    if (found == 0) {
        uint32_t wanted = 0;
        word += next % 32 == 0 ? 0 : 1;
        wanted = UINT32_MAX << (word % 32);
        for (unsigned part = word / 32; part < SET_PARTS; part++) {
            if ((set->used[part] & wanted) != 0) {
                word = 32 * part + (unsigned)lowest_bit(set->used[part] & wanted);
                found = set->bits[word];
                break;
            }
            wanted = UINT32_MAX;
        }
    }
    return found == 0 ? -1 : (int)(32 * word) + lowest_bit(found);
}

#if !ROBOT_IS_LAYER
#if ROBOT_REQUEST_COUNT > 0
static bool is_in(const robot_set_t *set, int number)
{
    const unsigned place = (unsigned)number;
    return (set->bits[place / 32] >> (place % 32) & 1U) != 0;
}

static void empty(robot_set_t *set)
{
    for (int part = 0; part < SET_PARTS; part++) {
        for (; set->used[part] != 0; set->used[part] &= set->used[part] - 1) {
            set->bits[32 * part + lowest_bit(set->used[part])] = 0;
        }
    }
}

#endif
#endif
#endif

#if ROBOT_STALE_COUNT > 0
/* Whatever is allowed or not may have changed. */
static void all_changed(robot_t *r)
{
    for (int number = 0; number < ROBOT_STALE_COUNT; number++) {
        add_to(&r->stale, number);
    }
}
#endif
