#if ROBOT_IS_SMALL
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
static void add_to(robot_set_t *set, int number)
{
    *set |= UINT32_C(1) << number;
}

static void remove_from(robot_set_t *set, int number)
{
    *set &= ~(UINT32_C(1) << number);
}

/* The least member, or -1. */
static int first_in(const robot_set_t *set)
{
    return *set == 0 ? -1 : lowest_bit(*set);
}

/* The next member after another one, or -1. */
static int next_in(const robot_set_t *set, int member)
{
    const robot_set_t rest = *set & (UINT32_MAX << 1 << member);
    return first_in(&rest);
}

#if !ROBOT_IS_LAYER
#if ROBOT_REQUEST_COUNT > 0
static bool is_in(const robot_set_t *set, int number)
{
    return (*set >> number & 1U) != 0;
}

static void empty(robot_set_t *set)
{
    *set = 0;
}

#endif
#endif
#endif
#else
/* Number of the lowest bit that is set; there is one. */
static int lowest_bit(robot_word_t bits)
{
#ifdef __GNUC__
    return sizeof bits > sizeof(unsigned long) ? __builtin_ctzll(bits) : __builtin_ctzl((unsigned long)bits);
#else
    int number = 0;
    while ((bits >> number & 1U) == 0) {
        number++;
    }
    return number;
#endif
}

enum {
    SET_WORDS = (ROBOT_SET_COUNT + ROBOT_WORD_BITS - 1) / ROBOT_WORD_BITS,
    SET_PARTS = (SET_WORDS + ROBOT_WORD_BITS - 1) / ROBOT_WORD_BITS
};

static void add_to(robot_set_t *set, int number)
{
    const unsigned place = (unsigned)number / ROBOT_WORD_BITS;
    set->bits[place] |= (robot_word_t)1 << ((unsigned)number % ROBOT_WORD_BITS);
    set->used[place / ROBOT_WORD_BITS] |= (robot_word_t)1 << (place % ROBOT_WORD_BITS);
}

static void remove_from(robot_set_t *set, int number)
{
    const unsigned place = (unsigned)number / ROBOT_WORD_BITS;
    set->bits[place] &= ~((robot_word_t)1 << ((unsigned)number % ROBOT_WORD_BITS));
    if (set->bits[place] == 0) {
        set->used[place / ROBOT_WORD_BITS] &= ~((robot_word_t)1 << (place % ROBOT_WORD_BITS));
    }
}

/* The least member from a word on, or -1. */
static int first_from(const robot_set_t *set, unsigned word)
{
    robot_word_t wanted = (robot_word_t)-1 << (word % ROBOT_WORD_BITS);
    for (unsigned part = word / ROBOT_WORD_BITS; part < SET_PARTS; part++) {
        const robot_word_t used = set->used[part] & wanted;
        if (used != 0) {
            const int found = ROBOT_WORD_BITS * (int)part + lowest_bit(used);
            return ROBOT_WORD_BITS * found + lowest_bit(set->bits[found]);
        }
        wanted = (robot_word_t)-1;
    }
    return -1;
}

/* The least member, or -1. */
static int first_in(const robot_set_t *set)
{
    return first_from(set, 0);
}

/* The next member after another one, or -1. */
static int next_in(const robot_set_t *set, int member)
{
    const unsigned word = (unsigned)member / ROBOT_WORD_BITS;
    const robot_word_t bits = set->bits[word] & ((robot_word_t)-1 << 1 << ((unsigned)member % ROBOT_WORD_BITS));
    return bits != 0 ? ROBOT_WORD_BITS * (int)word + lowest_bit(bits) : first_from(set, word + 1);
}

#if !ROBOT_IS_LAYER
#if ROBOT_REQUEST_COUNT > 0
static bool is_in(const robot_set_t *set, int number)
{
    return (set->bits[number / ROBOT_WORD_BITS] >> (number % ROBOT_WORD_BITS) & 1U) != 0;
}

static void empty(robot_set_t *set)
{
    for (int part = 0; part < SET_PARTS; part++) {
        for (; set->used[part] != 0; set->used[part] &= set->used[part] - 1) {
            set->bits[ROBOT_WORD_BITS * part + lowest_bit(set->used[part])] = 0;
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
