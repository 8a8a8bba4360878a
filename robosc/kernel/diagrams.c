/* Decision diagrams of CUDD: saturation and restriction, without Python in between.
 *
 * Each function here is the twin of one in robosc/synthesis, operation by operation: `closure` of saturation.py,
 * `restrict` of nodes.py. CUDD is the one inside dd.cudd, found when this module is connected with it, so that a diagram of dd is one
 * of this module. Python's lock is held all the time: whatever frees a predicate of the same manager waits.
 *
 * A node is passed as its address, 0 where there is none. Functions that return a node own one reference of it, unless
 * they say that it is borrowed; NULL is a failure, with Python's exception set or of CUDD itself.
 */
#include "kernel.h"

#include <dlfcn.h>
#include <limits.h>

/* Steps between two questions of whether to go on. */
enum { PAUSE = 16 };

typedef struct DdManager DdManager;
typedef struct DdNode DdNode;

/* The beginning of dd.cudd.BDD as Cython lays it out; the size of the whole is checked where this is connected. */
typedef struct {
    PyObject_HEAD
    void *methods;
    DdManager *manager;
} Bdd;

static struct {
    void (*ref)(DdNode *);
    void (*deref)(DdManager *, DdNode *);
    DdNode *(*and)(DdManager *, DdNode *, DdNode *);
    DdNode *(*ite)(DdManager *, DdNode *, DdNode *, DdNode *);
    DdNode *(*and_exist)(DdManager *, DdNode *, DdNode *, DdNode *);
    DdNode *(*compose)(DdManager *, DdNode *, DdNode **);
    DdNode *(*cofactor)(DdManager *, DdNode *, DdNode *);
    int (*leq)(DdManager *, DdNode *, DdNode *);
    unsigned int (*index)(DdNode *);
    int (*level)(DdManager *, int);
    int (*index_at)(DdManager *, int);
    DdNode *(*high)(DdNode *);
    DdNode *(*low)(DdNode *);
    DdNode *(*one)(DdManager *);
    DdNode *(*variable)(DdManager *, int);
    int (*size)(DdManager *);
} cudd;

static const struct {
    const char *name;
    void *place;
} NEEDED[] = {
    {"Cudd_Ref", &cudd.ref},
    {"Cudd_RecursiveDeref", &cudd.deref},
    {"Cudd_bddAnd", &cudd.and},
    {"Cudd_bddIte", &cudd.ite},
    {"Cudd_bddAndAbstract", &cudd.and_exist},
    {"Cudd_bddVectorCompose", &cudd.compose},
    {"Cudd_Cofactor", &cudd.cofactor},
    {"Cudd_bddLeq", &cudd.leq},
    {"Cudd_NodeReadIndex", &cudd.index},
    {"Cudd_ReadPerm", &cudd.level},
    {"Cudd_ReadInvPerm", &cudd.index_at},
    {"Cudd_T", &cudd.high},
    {"Cudd_E", &cudd.low},
    {"Cudd_ReadOne", &cudd.one},
    {"Cudd_bddIthVar", &cudd.variable},
    {"Cudd_ReadSize", &cudd.size},
};

/* Nodes */

static DdNode *negation(DdNode *f) { return f == NULL ? NULL : (DdNode *)((uintptr_t)f ^ 1); }

static DdNode *regular(DdNode *f) { return (DdNode *)((uintptr_t)f & ~(uintptr_t)1); }

static DdNode *owned(DdNode *f) {
    if (f != NULL) {
        cudd.ref(f);
    }
    return f;
}

static void drop(DdManager *manager, DdNode *f) {
    if (f != NULL) {
        cudd.deref(manager, f);
    }
}

static DdNode *conjunction(DdManager *manager, DdNode *f, DdNode *g) { return owned(cudd.and(manager, f, g)); }

static DdNode *disjunction(DdManager *manager, DdNode *f, DdNode *g) {
    return owned(negation(cudd.and(manager, negation(f), negation(g))));
}

/* The level of a node's variable; constants stand below all of them. */
static int level_of(DdManager *manager, DdNode *f) {
    DdNode *node = regular(f);
    return node == cudd.one(manager) ? INT_MAX : cudd.level(manager, (int)cudd.index(node));
}

/* The cofactors of a predicate by the variable of a level, borrowed. None of its own variables stands above it. */
static void split(DdManager *manager, DdNode *f, int level, DdNode **low, DdNode **high) {
    DdNode *node = regular(f);
    if (level_of(manager, f) != level) {
        *low = *high = f;
    } else if (node == f) {
        *low = cudd.low(node);
        *high = cudd.high(node);
    } else {
        *low = negation(cudd.low(node));
        *high = negation(cudd.high(node));
    }
}

/* If-then-else by the variable of a level; it drops both branches, and fails if one of them has failed. */
static DdNode *joined(DdManager *manager, int level, DdNode *low, DdNode *high) {
    DdNode *found = NULL;
    if (low != NULL && high != NULL) {
        DdNode *variable = cudd.variable(manager, cudd.index_at(manager, level));
        found = variable == NULL ? NULL : owned(cudd.ite(manager, variable, high, low));
    }
    drop(manager, low);
    drop(manager, high);
    return found;
}

/* Tables: what was found for two nodes and a number; all three nodes of an entry are owned. */

typedef struct {
    DdNode *first, *second, *found;
    int number;
} Entry;

typedef struct {
    Entry *entries;
    size_t size, count;
} Table;

static Entry *entry_of(const Table *table, DdNode *first, DdNode *second, int number) {
    uint64_t hash = ((uint64_t)(uintptr_t)first * 0x9E3779B97F4A7C15u) ^ ((uint64_t)(uintptr_t)second * 0xC2B2AE3D27D4EB4Fu);
    hash ^= (uint64_t)number * 0x165667B19E3779F9u;
    size_t place = (size_t)((hash ^ (hash >> 29)) * 0xBF58476D1CE4E5B9u >> 20) & (table->size - 1);
    while (table->entries[place].found != NULL) {
        Entry *entry = &table->entries[place];
        if (entry->first == first && entry->second == second && entry->number == number) {
            return entry;
        }
        place = (place + 1) & (table->size - 1);
    }
    return &table->entries[place];
}

static int make_table(Table *table, size_t size) {
    table->entries = PyMem_Calloc(size, sizeof(Entry));
    table->size = size;
    table->count = 0;
    if (table->entries == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    return 1;
}

/* Remember what was found, which stays its owner's, too. */
static int remember(Table *table, DdNode *first, DdNode *second, int number, DdNode *found) {
    if (3 * (table->count + 1) > 2 * table->size) {
        Table larger;
        if (!make_table(&larger, 2 * table->size)) {
            return 0;
        }
        for (size_t place = 0; place < table->size; place++) {
            Entry *entry = &table->entries[place];
            if (entry->found != NULL) {
                *entry_of(&larger, entry->first, entry->second, entry->number) = *entry;
            }
        }
        larger.count = table->count;
        PyMem_Free(table->entries);
        *table = larger;
    }
    *entry_of(table, first, second, number) = (Entry){owned(first), owned(second), owned(found), number};
    table->count++;
    return 1;
}

static void free_table(DdManager *manager, Table *table) {
    for (size_t place = 0; table->entries != NULL && place < table->size; place++) {
        Entry *entry = &table->entries[place];
        if (entry->found != NULL) {
            drop(manager, entry->first);
            drop(manager, entry->second);
            drop(manager, entry->found);
        }
    }
    PyMem_Free(table->entries);
}

/* Steps */

typedef struct {
    int index;
    DdNode *function;
} Substitution;

typedef struct {
    Substitution *items;
    Py_ssize_t count;
} Substitutions;

/* What an event makes of a set of states: see image.py. What a step has not is NULL. */
typedef struct {
    DdNode *inside, *needed, *constants, *relation, *hidden, *outside, *room;
    Substitutions functions, names;
} Step;

typedef struct {
    int top;
    Step *steps;
    Py_ssize_t count;
} Group;

typedef struct {
    DdManager *manager;
    DdNode *zero, *until;
    DdNode **identity;
    Group *groups;
    Py_ssize_t group_count, step_count;
    Table known;
    PyObject *pause, *tell;
    long long taken, told, asked;
} Closure;

static DdNode *composed(Closure *closure, DdNode *f, const Substitutions *substitutions) {
    for (Py_ssize_t place = 0; place < substitutions->count; place++) {
        Substitution *item = &substitutions->items[place];
        closure->identity[item->index] = item->function;
    }
    DdNode *found = owned(cudd.compose(closure->manager, f, closure->identity));
    for (Py_ssize_t place = 0; place < substitutions->count; place++) {
        int index = substitutions->items[place].index;
        closure->identity[index] = cudd.variable(closure->manager, index);
    }
    return found;
}

/* One predicate in place of another, which is dropped. */
static DdNode *instead(DdManager *manager, DdNode *old, DdNode *new) {
    drop(manager, old);
    return new;
}

static DdNode *image(Closure *closure, const Step *step, DdNode *states) {
    DdManager *manager = closure->manager;
    DdNode *found = owned(states);
    if (step->inside != NULL) {
        found = instead(manager, found, conjunction(manager, found, step->inside));
    }
    if (found != NULL && step->needed != NULL && cudd.leq(manager, found, negation(step->needed))) {
        return instead(manager, found, owned(closure->zero));
    }
    if (found != NULL && step->constants != NULL) {
        found = instead(manager, found, owned(cudd.cofactor(manager, found, step->constants)));
    }
    if (found != NULL && step->functions.count > 0) {
        found = instead(manager, found, composed(closure, found, &step->functions));
    }
    if (found != NULL && step->hidden != NULL) {
        found = instead(manager, found, owned(cudd.and_exist(manager, found, step->relation, step->hidden)));
    } else if (found != NULL) {
        found = instead(manager, found, conjunction(manager, found, step->relation));
    }
    if (found != NULL && step->names.count > 0) {
        found = instead(manager, found, composed(closure, found, &step->names));
    }
    if (found != NULL && step->outside != NULL) {
        found = instead(manager, found, conjunction(manager, found, step->outside));
    }
    return found;
}

/* Saturation */

static int answered(PyObject *answer) {
    Py_XDECREF(answer);
    return answer != NULL;
}

static int told_of(Closure *closure, DdNode *states) {
    closure->told++;
    return answered(PyObject_CallFunction(closure->tell, "LK", closure->told, (unsigned long long)(uintptr_t)states));
}

/* Whether to go on, asked with the number of steps since it was asked last. */
static int may_go_on(Closure *closure) {
    long long steps = closure->taken - closure->asked;
    closure->asked = closure->taken;
    return answered(PyObject_CallFunction(closure->pause, "L", steps));
}

/* States and what a step adds to them of those within a predicate, led from new ones. */
static DdNode *grown(Closure *closure, DdNode *states, DdNode *within, const Step *step, DdNode *new) {
    DdManager *manager = closure->manager;
    if (closure->taken % PAUSE == 0 && !may_go_on(closure)) {
        return NULL;
    }
    closure->taken++;
    if (closure->taken >= (closure->told + 1) * closure->step_count && !told_of(closure, states)) {
        return NULL;
    }
    if (new == closure->zero) {
        return owned(states);
    }
    if (step->room != NULL) {
        DdNode *room = conjunction(manager, within, step->room);
        if (room == NULL) {
            return NULL;
        }
        int is_full = cudd.leq(manager, room, states);
        drop(manager, room);
        if (is_full) {
            return owned(states);
        }
    }
    DdNode *added = image(closure, step, new);
    if (added != NULL) {
        added = instead(manager, added, conjunction(manager, added, within));
    }
    return added == NULL ? NULL : instead(manager, added, disjunction(manager, states, added));
}

static DdNode *saturated(Closure *closure, DdNode *states, DdNode *within, int number);

/* A set, dropped, closed under the steps of one group and of those below it. */
static DdNode *closed_under(Closure *closure, DdNode *states, DdNode *within, int number, DdNode **seen) {
    DdManager *manager = closure->manager;
    const Group *group = &closure->groups[number];
    Py_ssize_t vain = 0, place = 0;
    while (vain < group->count) {
        DdNode *new = conjunction(manager, states, negation(seen[place]));
        if (new == NULL) {
            return instead(manager, states, NULL);
        }
        DdNode *more = grown(closure, states, within, &group->steps[place], new);
        drop(manager, new);
        seen[place] = instead(manager, seen[place], owned(states));
        place = (place + 1) % group->count;
        vain++;
        if (more == NULL) {
            return instead(manager, states, NULL);
        }
        if (more == states) {
            drop(manager, more);
            continue;
        }
        states = instead(manager, states, saturated(closure, more, within, number + 1));
        drop(manager, more);
        if (states == NULL) {
            return NULL;
        }
        vain = 0;
    }
    return states;
}

static DdNode *worked_out(Closure *closure, DdNode *states, DdNode *within, int number) {
    DdManager *manager = closure->manager;
    const Group *group = &closure->groups[number];
    int level = level_of(manager, states), other = level_of(manager, within);
    level = level < other ? level : other;
    if (level < group->top) {
        DdNode *low, *high, *inside_low, *inside_high;
        split(manager, states, level, &low, &high);
        split(manager, within, level, &inside_low, &inside_high);
        low = saturated(closure, low, inside_low, number);
        high = low == NULL ? NULL : saturated(closure, high, inside_high, number);
        return joined(manager, level, low, high);
    }
    states = saturated(closure, states, within, number + 1);
    if (states == NULL) {
        return NULL;
    }
    DdNode **seen = PyMem_Malloc((size_t)group->count * sizeof(DdNode *));
    if (seen == NULL) {
        PyErr_NoMemory();
        return instead(manager, states, NULL);
    }
    for (Py_ssize_t place = 0; place < group->count; place++) {
        seen[place] = owned(closure->zero);
    }
    states = closed_under(closure, states, within, number, seen);
    for (Py_ssize_t place = 0; place < group->count; place++) {
        drop(manager, seen[place]);
    }
    PyMem_Free(seen);
    return states;
}

static DdNode *saturated(Closure *closure, DdNode *states, DdNode *within, int number) {
    if (number == closure->group_count || states == within || states == closure->zero) {
        return owned(states);
    }
    Entry *entry = entry_of(&closure->known, states, within, number);
    if (entry->found != NULL) {
        return owned(entry->found);
    }
    DdNode *found = worked_out(closure, states, within, number);
    if (found != NULL && !remember(&closure->known, states, within, number, found)) {
        return instead(closure->manager, found, NULL);
    }
    return found;
}

static int is_done(Closure *closure, DdNode *states) {
    return closure->until != NULL && cudd.leq(closure->manager, closure->until, states);
}

/* The closure of a whole set, dropped: the topmost steps are taken in turns with all that is below. */
static DdNode *of_whole(Closure *closure, DdNode *states, DdNode *within) {
    DdManager *manager = closure->manager;
    const Group *topmost = &closure->groups[0];
    while (states != NULL && !is_done(closure, states)) {
        states = instead(manager, states, saturated(closure, states, within, 1));
        DdNode *before = owned(states);
        int is_enough = 0;
        for (Py_ssize_t place = 0; states != NULL && place < topmost->count && !is_enough; place++) {
            is_enough = is_done(closure, states);
            if (!is_enough) {
                states = instead(manager, states, grown(closure, states, within, &topmost->steps[place], states));
            }
        }
        is_enough = is_enough || states == before;
        drop(manager, before);
        if (is_enough) {
            break;
        }
    }
    return states;
}

/* What Python passes */

static DdManager *manager_of(PyObject *bdd) { return ((Bdd *)bdd)->manager; }

static int read_substitutions(Closure *closure, PyObject *pairs, Substitutions *substitutions) {
    Py_ssize_t count = PyTuple_Size(pairs);
    if (count < 0) {
        return 0;
    }
    substitutions->items = PyMem_Calloc((size_t)count + 1, sizeof(Substitution));
    if (substitutions->items == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    substitutions->count = count;
    for (Py_ssize_t place = 0; place < count; place++) {
        Substitution *item = &substitutions->items[place];
        PyObject *pair = PyTuple_GetItem(pairs, place);
        unsigned long long variable, function;
        if (pair == NULL || !PyArg_ParseTuple(pair, "KK", &variable, &function)) {
            return 0;
        }
        item->index = (int)cudd.index(regular((DdNode *)(uintptr_t)variable));
        item->function = (DdNode *)(uintptr_t)function;
        if (item->index >= cudd.size(closure->manager)) {
            PyErr_SetString(PyExc_ValueError, "a constant is no variable");
            return 0;
        }
    }
    return 1;
}

static int read_step(Closure *closure, PyObject *tuple, Step *step) {
    unsigned long long inside, needed, constants, relation, hidden, outside, room;
    PyObject *functions, *names;
    if (!PyArg_ParseTuple(tuple, "KKKOKKOKK", &inside, &needed, &constants, &functions, &relation, &hidden, &names,
                          &outside, &room)) {
        return 0;
    }
    step->inside = (DdNode *)(uintptr_t)inside;
    step->needed = (DdNode *)(uintptr_t)needed;
    step->constants = (DdNode *)(uintptr_t)constants;
    step->relation = (DdNode *)(uintptr_t)relation;
    step->hidden = (DdNode *)(uintptr_t)hidden;
    step->outside = (DdNode *)(uintptr_t)outside;
    step->room = (DdNode *)(uintptr_t)room;
    return read_substitutions(closure, functions, &step->functions) && read_substitutions(closure, names, &step->names);
}

static int read_groups(Closure *closure, PyObject *groups) {
    Py_ssize_t count = PyTuple_Size(groups);
    if (count < 1) {
        PyErr_SetString(PyExc_ValueError, "there is no step");
        return 0;
    }
    closure->groups = PyMem_Calloc((size_t)count, sizeof(Group));
    if (closure->groups == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    closure->group_count = count;
    for (Py_ssize_t number = 0; number < count; number++) {
        Group *group = &closure->groups[number];
        PyObject *steps, *pair = PyTuple_GetItem(groups, number);
        if (pair == NULL || !PyArg_ParseTuple(pair, "iO!", &group->top, &PyTuple_Type, &steps)) {
            return 0;
        }
        group->steps = PyMem_Calloc((size_t)PyTuple_Size(steps) + 1, sizeof(Step));
        if (group->steps == NULL) {
            PyErr_NoMemory();
            return 0;
        }
        group->count = PyTuple_Size(steps);
        closure->step_count += group->count;
        for (Py_ssize_t place = 0; place < group->count; place++) {
            if (!read_step(closure, PyTuple_GetItem(steps, place), &group->steps[place])) {
                return 0;
            }
        }
    }
    return 1;
}

static int read_identity(Closure *closure) {
    int size = cudd.size(closure->manager);
    closure->identity = PyMem_Calloc((size_t)size + 1, sizeof(DdNode *));
    if (closure->identity == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    for (int index = 0; index < size; index++) {
        closure->identity[index] = cudd.variable(closure->manager, index);
    }
    return 1;
}

static void free_closure(Closure *closure) {
    for (Py_ssize_t number = 0; closure->groups != NULL && number < closure->group_count; number++) {
        Group *group = &closure->groups[number];
        for (Py_ssize_t place = 0; group->steps != NULL && place < group->count; place++) {
            PyMem_Free(group->steps[place].functions.items);
            PyMem_Free(group->steps[place].names.items);
        }
        PyMem_Free(group->steps);
    }
    PyMem_Free(closure->groups);
    PyMem_Free(closure->identity);
    free_table(closure->manager, &closure->known);
}

/* A found node for Python, with the reference that it still owns. */
static PyObject *passed(DdNode *found) {
    if (found != NULL) {
        return PyLong_FromUnsignedLongLong((unsigned long long)(uintptr_t)found);
    }
    if (!PyErr_Occurred()) {
        /* As dd says it: an operation that CUDD gave up. */
        PyErr_SetString(PyExc_ValueError, "NULL reference");
    }
    return NULL;
}

PyObject *diagram_closure(PyObject *module, PyObject *arguments) {
    (void)module;
    Closure closure = {0};
    PyObject *bdd, *groups;
    unsigned long long states, within, until;
    if (!PyArg_ParseTuple(arguments, "OKKO!KOO", &bdd, &states, &within, &PyTuple_Type, &groups, &until,
                          &closure.pause, &closure.tell)) {
        return NULL;
    }
    closure.manager = manager_of(bdd);
    closure.zero = negation(cudd.one(closure.manager));
    closure.until = (DdNode *)(uintptr_t)until;
    DdNode *found = NULL;
    if (read_groups(&closure, groups) && read_identity(&closure) && make_table(&closure.known, 1024)) {
        found = of_whole(&closure, owned((DdNode *)(uintptr_t)states), (DdNode *)(uintptr_t)within);
    }
    if (found != NULL && !may_go_on(&closure)) {
        found = instead(closure.manager, found, NULL);
    }
    free_closure(&closure);
    return passed(found);
}

/* Restriction */

static DdNode *restricted(DdManager *manager, Table *known, DdNode *f, DdNode *care) {
    DdNode *one = cudd.one(manager);
    if (regular(f) == one || regular(care) == one) {
        return owned(f);
    }
    Entry *entry = entry_of(known, f, care, 0);
    if (entry->found != NULL) {
        return owned(entry->found);
    }
    int here = level_of(manager, f), level = level_of(manager, care);
    DdNode *low, *high, *care_low, *care_high, *found;
    split(manager, care, level < here ? level : here, &care_low, &care_high);
    if (level < here) {
        DdNode *either = disjunction(manager, care_low, care_high);
        found = either == NULL ? NULL : restricted(manager, known, f, either);
        drop(manager, either);
    } else {
        split(manager, f, here, &low, &high);
        if (care_low == negation(one)) {
            found = restricted(manager, known, high, care_high);
        } else if (care_high == negation(one)) {
            found = restricted(manager, known, low, care_low);
        } else {
            low = restricted(manager, known, low, care_low);
            high = low == NULL ? NULL : restricted(manager, known, high, care_high);
            found = joined(manager, here, low, high);
        }
    }
    if (found != NULL && !remember(known, f, care, 0, found)) {
        return instead(manager, found, NULL);
    }
    return found;
}

PyObject *diagram_restrict(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *bdd;
    unsigned long long f, care;
    Table known;
    if (!PyArg_ParseTuple(arguments, "OKK", &bdd, &f, &care) || !make_table(&known, 256)) {
        return NULL;
    }
    DdManager *manager = manager_of(bdd);
    DdNode *found = restricted(manager, &known, (DdNode *)(uintptr_t)f, (DdNode *)(uintptr_t)care);
    free_table(manager, &known);
    return passed(found);
}

PyObject *diagram_release(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *bdd;
    unsigned long long f;
    if (!PyArg_ParseTuple(arguments, "OK", &bdd, &f)) {
        return NULL;
    }
    drop(manager_of(bdd), (DdNode *)(uintptr_t)f);
    Py_RETURN_NONE;
}

PyObject *diagram_connect(PyObject *module, PyObject *arguments) {
    (void)module;
    const char *path;
    if (!PyArg_ParseTuple(arguments, "s", &path)) {
        return NULL;
    }
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        PyErr_Format(PyExc_ImportError, "%s cannot be opened: %s", path, dlerror());
        return NULL;
    }
    for (size_t place = 0; place < sizeof NEEDED / sizeof NEEDED[0]; place++) {
        void *found = dlsym(library, NEEDED[place].name);
        if (found == NULL) {
            PyErr_Format(PyExc_ImportError, "%s has no %s", path, NEEDED[place].name);
            return NULL;
        }
        memcpy(NEEDED[place].place, &found, sizeof found);
    }
    Py_RETURN_NONE;
}
