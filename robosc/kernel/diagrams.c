/* Decision diagrams of CUDD: saturation, restriction and extraction, without calls of Python functions in between.
 *
 * Each function here does the same operations as its twin in robosc/synthesis: `closure` of saturation.py, `restrict`,
 * `without` and `separated` of nodes.py, `extract` of diagrams.py. They use the CUDD inside dd.cudd, which `connect`
 * finds, so that diagrams of dd and of this module are the same. Python's lock is held all the time, so that no other
 * thread frees a predicate of the same manager meanwhile.
 *
 * A node is passed as its address, or 0 for no node. A function that returns a node gives the caller one reference,
 * unless its comment says that the node is borrowed. NULL is a failure of CUDD, or of Python with its exception set.
 */
#include "kernel.h"

#include <dlfcn.h>
#include <limits.h>

/* The twins of constants in saturation.py and in nodes.py. */
enum { PAUSE = 16, MATES = 8 };

typedef struct DdManager DdManager;
typedef struct DdNode DdNode;

/* The first fields of dd.cudd.BDD, as Cython lays them out; Python checks the size of the whole before it connects. */
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
    DdNode *(*compose_one)(DdManager *, DdNode *, DdNode *, int);
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
    int (*dag_size)(DdNode *);
} cudd;

static const struct {
    const char *name;
    void *place;
} NEEDED[] = {
    {"Cudd_Ref", &cudd.ref},
    {"Cudd_DelayedDerefBdd", &cudd.deref},
    {"Cudd_bddAnd", &cudd.and},
    {"Cudd_bddIte", &cudd.ite},
    {"Cudd_bddAndAbstract", &cudd.and_exist},
    {"Cudd_bddVectorCompose", &cudd.compose},
    {"Cudd_bddCompose", &cudd.compose_one},
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
    {"Cudd_DagSize", &cudd.dag_size},
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

/* Give up a reference. What it alone has held is dead a little later: most of it is found again before. */
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

/* The cofactors of a predicate by the variable of a level, borrowed. The predicate has no variable above that level. */
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

/* Return if-then-else by the variable of a level; it drops both branches, and fails if one of them has failed. */
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

/* Tables: results, a node or a value, by two nodes and a number; an entry owns its three nodes. */

typedef struct {
    DdNode *first, *second, *found;
    int number, value;
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

/* Put a found node into a table; the caller keeps its own reference. */
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
    *entry_of(table, first, second, number) = (Entry){owned(first), owned(second), owned(found), number, 0};
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

/* Sets of nodes; they own none. */

typedef struct {
    DdNode **nodes;
    size_t size, count;
} Set;

static int make_set(Set *set, size_t size) {
    *set = (Set){PyMem_Calloc(size, sizeof(DdNode *)), size, 0};
    if (set->nodes == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    return 1;
}

/* Put a node into a set: 1 if it was not there, 0 if it was, -1 if there is no memory. */
static int include(Set *set, DdNode *node) {
    if (2 * set->count >= set->size) {
        Set larger;
        if (!make_set(&larger, 4 * set->size)) {
            return -1;
        }
        for (size_t place = 0; place < set->size; place++) {
            if (set->nodes[place] != NULL) {
                include(&larger, set->nodes[place]);
            }
        }
        PyMem_Free(set->nodes);
        *set = larger;
    }
    uint64_t hash = (uint64_t)(uintptr_t)node * 0x9E3779B97F4A7C15u;
    size_t place = (size_t)(hash >> 20) & (set->size - 1);
    while (set->nodes[place] != NULL) {
        if (set->nodes[place] == node) {
            return 0;
        }
        place = (place + 1) & (set->size - 1);
    }
    set->nodes[place] = node;
    set->count++;
    return 1;
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

/* The image of a set of states under an event: see image.py. Parts that a step does not have are NULL. */
typedef struct {
    DdNode *inside, *needed, *constants, *relation, *hidden, *outside, *room, *touched;
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
    PyObject *pause, *report;
    /* Steps taken in all, and at the last call of `pause`; nodes that the first step after that made. */
    long long taken, reported, asked, made;
} Closure;

static DdNode *composed(Closure *closure, DdNode *f, const Substitutions *substitutions) {
    if (substitutions->count == 1) {
        /* CUDD finds in its cache what it has composed before, which it does not for several at once. */
        const Substitution *only = substitutions->items;
        return owned(cudd.compose_one(closure->manager, f, only->function, only->index));
    }
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

/* Drop one predicate and return another in its place. */
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

/* Report progress; false if Python raised an exception. */
static int report_round(Closure *closure, DdNode *states) {
    unsigned long long address = (unsigned long long)(uintptr_t)states;
    closure->reported++;
    return answered(PyObject_CallFunction(closure->report, "LK", closure->reported, address));
}

/* Call `pause` with the number of steps since its last call and of the nodes that one of them made; false if it raised
   an exception. */
static int may_go_on(Closure *closure) {
    long long steps = closure->taken - closure->asked;
    closure->asked = closure->taken;
    return answered(PyObject_CallFunction(closure->pause, "LL", steps, closure->made));
}

/* The states within a predicate that a step reaches from some states; these if they are all there is. */
static DdNode *added_by(Closure *closure, DdNode *states, DdNode *within, const Step *step) {
    DdManager *manager = closure->manager;
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
    DdNode *added = image(closure, step, states);
    return added == NULL ? NULL : instead(manager, added, conjunction(manager, added, within));
}

/* Nodes known before a step that may stand where one does after it: as many as fit. */
typedef struct {
    DdNode *nodes[MATES];
    int count;
} Mates;

static void add_mate(Mates *mates, DdNode *node) {
    node = regular(node);
    for (int place = 0; place < mates->count; place++) {
        if (mates->nodes[place] == node) {
            return;
        }
    }
    if (mates->count < MATES) {
        mates->nodes[mates->count++] = node;
    }
}

/* Put the nodes that a step has made into a set, as far as `nodes_made` of nodes.py finds them; `touched` are variables
   of the step. It returns false if there is no memory. */
static int gather_made(DdManager *manager, DdNode *f, Mates mates, DdNode *touched, Set *made) {
    DdNode *node = regular(f);
    int level = level_of(manager, node);
    for (int place = 0; place < mates.count; place++) {
        while (level_of(manager, mates.nodes[place]) < level) {
            DdNode *above = mates.nodes[place];
            mates.nodes[place] = regular(cudd.low(above));
            add_mate(&mates, cudd.high(above));
        }
        if (mates.nodes[place] == node) {
            return 1;
        }
    }
    int is_new = level == INT_MAX ? 0 : include(made, node);
    if (is_new <= 0) {
        return is_new == 0;
    }
    while (level_of(manager, touched) < level) {
        touched = cudd.high(touched);
    }
    int is_touched = level_of(manager, touched) == level;
    for (int branch = 0; branch < 2; branch++) {
        Mates below = {.count = 0};
        for (int other = 0; other <= is_touched; other++) {
            for (int place = 0; place < mates.count; place++) {
                DdNode *mate = mates.nodes[place];
                if (level_of(manager, mate) > level) {
                    add_mate(&below, mate);
                } else {
                    add_mate(&below, branch ^ other ? cudd.high(mate) : cudd.low(mate));
                }
            }
        }
        if (!gather_made(manager, branch ? cudd.high(node) : cudd.low(node), below, touched, made)) {
            return 0;
        }
    }
    return 1;
}

/* Count the nodes that a step has made: what this takes grows with them, and not with the predicate. */
static int look_at(Closure *closure, DdNode *states, DdNode *found, const Step *step) {
    Set made;
    Mates known = {{regular(states)}, 1};
    int is_done = make_set(&made, 1024) && gather_made(closure->manager, found, known, step->touched, &made);
    closure->made = (long long)made.count;
    PyMem_Free(made.nodes);
    return is_done;
}

/* States, and the states within a predicate that a step reaches from them. */
static DdNode *grown(Closure *closure, DdNode *states, DdNode *within, const Step *step) {
    DdManager *manager = closure->manager;
    int is_looked_at = closure->taken % PAUSE == 0;
    if (is_looked_at && !may_go_on(closure)) {
        return NULL;
    }
    if (closure->taken + 1 >= (closure->reported + 1) * closure->step_count && !report_round(closure, states)) {
        return NULL;
    }
    DdNode *added = added_by(closure, states, within, step);
    DdNode *found = added == NULL ? NULL : disjunction(manager, states, added);
    if (found != NULL && is_looked_at && !look_at(closure, states, found, step)) {
        found = instead(manager, found, NULL);
    }
    closure->taken++;
    drop(manager, added);
    return found;
}

static DdNode *saturated(Closure *closure, DdNode *states, DdNode *within, int number);

/* The closure of a set under the steps of one group and of the groups below it; the set is dropped. */
static DdNode *closed_under(Closure *closure, DdNode *states, DdNode *within, int number) {
    DdManager *manager = closure->manager;
    const Group *group = &closure->groups[number];
    Py_ssize_t vain = 0, place = 0;
    while (vain < group->count) {
        DdNode *more = grown(closure, states, within, &group->steps[place]);
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
    return states == NULL ? NULL : closed_under(closure, states, within, number);
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

/* The closure of a whole set, which is dropped: topmost steps and saturation below them take turns. */
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
                states = instead(manager, states, grown(closure, states, within, &topmost->steps[place]));
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

/* Arguments from Python */

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
    unsigned long long inside, needed, constants, relation, hidden, outside, room, touched;
    PyObject *functions, *names;
    if (!PyArg_ParseTuple(tuple, "KKKOKKOKKK", &inside, &needed, &constants, &functions, &relation, &hidden, &names,
                          &outside, &room, &touched)) {
        return 0;
    }
    step->inside = (DdNode *)(uintptr_t)inside;
    step->needed = (DdNode *)(uintptr_t)needed;
    step->constants = (DdNode *)(uintptr_t)constants;
    step->relation = (DdNode *)(uintptr_t)relation;
    step->hidden = (DdNode *)(uintptr_t)hidden;
    step->outside = (DdNode *)(uintptr_t)outside;
    step->room = (DdNode *)(uintptr_t)room;
    step->touched = (DdNode *)(uintptr_t)touched;
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

/* The address of a found node for Python, which gets its reference; without a node an exception. */
static PyObject *passed(DdNode *found) {
    if (found != NULL) {
        return PyLong_FromUnsignedLongLong((unsigned long long)(uintptr_t)found);
    }
    if (!PyErr_Occurred()) {
        /* dd raises the same error when CUDD gives an operation up. */
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
                          &closure.pause, &closure.report)) {
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

/* Find the lowest level of a predicate's variables; false if there is no memory. */
static int find_lowest(DdManager *manager, DdNode *f, Set *seen, int *lowest) {
    DdNode *node = regular(f);
    int level = level_of(manager, node);
    int is_new = level == INT_MAX ? 0 : include(seen, node);
    if (is_new <= 0) {
        return is_new == 0;
    }
    *lowest = level > *lowest ? level : *lowest;
    return find_lowest(manager, cudd.low(node), seen, lowest) && find_lowest(manager, cudd.high(node), seen, lowest);
}

/* What matters of `care` to a predicate: no variable above all of its own, or below them. Restricting would leave these
   out, too, one after the other, and the sets in between are large. */
static DdNode *relevant(DdManager *manager, DdNode *f, DdNode *care) {
    Set seen;
    int highest = level_of(manager, f), lowest = -1;
    int is_found = make_set(&seen, 256) && find_lowest(manager, f, &seen, &lowest);
    PyMem_Free(seen.nodes);
    DdNode *cube = is_found ? owned(cudd.one(manager)) : NULL;
    for (int level = cudd.size(manager) - 1; cube != NULL && level >= 0; level--) {
        if (level < highest || level > lowest) {
            DdNode *variable = cudd.variable(manager, cudd.index_at(manager, level));
            cube = instead(manager, cube, conjunction(manager, cube, variable));
        }
    }
    DdNode *found = cube == NULL ? NULL : owned(cudd.and_exist(manager, care, cudd.one(manager), cube));
    drop(manager, cube);
    return found;
}

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
    DdNode *matters = relevant(manager, (DdNode *)(uintptr_t)f, (DdNode *)(uintptr_t)care);
    DdNode *found = matters == NULL ? NULL : restricted(manager, &known, (DdNode *)(uintptr_t)f, matters);
    drop(manager, matters);
    free_table(manager, &known);
    return passed(found);
}

/* Places that are not needed to distinguish two sets */

static DdNode *without(DdManager *manager, DdNode *f, DdNode *cube) {
    return owned(cudd.and_exist(manager, f, cudd.one(manager), cube));
}

/* The product of the variables of the places from `first` to before `end`. It is built by halves: one by one would take
 * a quadratic number of steps.
 */
static DdNode *product(DdManager *manager, DdNode **cubes, Py_ssize_t first, Py_ssize_t end) {
    if (end - first < 2) {
        return owned(end == first ? cudd.one(manager) : cubes[first]);
    }
    Py_ssize_t middle = first + (end - first) / 2;
    DdNode *left = product(manager, cubes, first, middle);
    DdNode *right = left == NULL ? NULL : product(manager, cubes, middle, end);
    DdNode *found = right == NULL ? NULL : conjunction(manager, left, right);
    drop(manager, left);
    drop(manager, right);
    return found;
}

/* Leave out the places from `first` to before `end` without which two disjoint sets stay disjoint, earlier ones first.
 * If all of them together can be left out, they are; else they are tried by halves. Only the set `left` is quantified
 * and replaced. The other set, `whole`, stays as it is: both quantified sets share a state exactly if `whole` and the
 * quantified `left` do. The product of the places left out is added to `gone`.
 */
static int leave_out(DdManager *manager, DdNode *whole, DdNode **left, DdNode **gone, DdNode **cubes, Py_ssize_t first,
                     Py_ssize_t end) {
    DdNode *cube = product(manager, cubes, first, end);
    DdNode *fewer = cube == NULL ? NULL : without(manager, *left, cube);
    if (fewer == NULL) {
        drop(manager, cube);
        return 0;
    }
    if (cudd.leq(manager, whole, negation(fewer))) {
        *left = instead(manager, *left, fewer);
        *gone = instead(manager, *gone, conjunction(manager, *gone, cube));
        drop(manager, cube);
        return *gone != NULL;
    }
    drop(manager, cube);
    drop(manager, fewer);
    if (end - first < 2) {
        return 1;
    }
    Py_ssize_t middle = first + (end - first) / 2;
    return leave_out(manager, whole, left, gone, cubes, first, middle) &&
           leave_out(manager, whole, left, gone, cubes, middle, end);
}

/* The cubes of a tuple, one for the variables of each place, borrowed. */
static DdNode **read_cubes(PyObject *places, Py_ssize_t *count) {
    *count = PyTuple_Size(places);
    DdNode **cubes = *count < 0 ? NULL : PyMem_Calloc((size_t)*count + 1, sizeof(DdNode *));
    if (cubes == NULL) {
        return PyErr_Occurred() ? NULL : (DdNode **)PyErr_NoMemory();
    }
    for (Py_ssize_t place = 0; place < *count; place++) {
        cubes[place] = (DdNode *)(uintptr_t)PyLong_AsUnsignedLongLong(PyTuple_GetItem(places, place));
    }
    if (PyErr_Occurred()) {
        PyMem_Free(cubes);
        return NULL;
    }
    return cubes;
}

PyObject *diagram_without(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *bdd, *places;
    unsigned long long f;
    Py_ssize_t count;
    if (!PyArg_ParseTuple(arguments, "OKO", &bdd, &f, &places)) {
        return NULL;
    }
    DdNode **cubes = read_cubes(places, &count);
    if (cubes == NULL) {
        return NULL;
    }
    DdManager *manager = manager_of(bdd);
    DdNode *cube = product(manager, cubes, 0, count);
    DdNode *found = cube == NULL ? NULL : without(manager, (DdNode *)(uintptr_t)f, cube);
    drop(manager, cube);
    PyMem_Free(cubes);
    return passed(found);
}

PyObject *diagram_separated(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *bdd, *places;
    unsigned long long one, other;
    Py_ssize_t count;
    if (!PyArg_ParseTuple(arguments, "OKKO", &bdd, &one, &other, &places)) {
        return NULL;
    }
    DdNode **cubes = read_cubes(places, &count);
    if (cubes == NULL) {
        return NULL;
    }
    DdManager *manager = manager_of(bdd);
    DdNode *sets[2] = {(DdNode *)(uintptr_t)one, (DdNode *)(uintptr_t)other};
    int smaller = cudd.dag_size(sets[1]) <= cudd.dag_size(sets[0]);
    DdNode *left = owned(sets[smaller]), *gone = owned(cudd.one(manager)), *rest = NULL;
    if (count == 0 || leave_out(manager, sets[1 - smaller], &left, &gone, cubes, 0, count)) {
        rest = without(manager, sets[1 - smaller], gone);
    }
    PyMem_Free(cubes);
    drop(manager, gone);
    if (rest == NULL) {
        drop(manager, left);
        return passed(NULL);
    }
    sets[smaller] = left;
    sets[1 - smaller] = rest;
    return Py_BuildValue("KK", (unsigned long long)(uintptr_t)sets[0], (unsigned long long)(uintptr_t)sets[1]);
}

/* Extraction */

/* A place of the state: the levels of its bits, most significant first, and how many values it can hold. */
typedef struct {
    int *levels;
    int bits;
    int end; /* The first place after its block. */
    long long size;
} Place;

/* A first index and the predicate, owned, that holds from this index on. */
typedef struct {
    long long start;
    DdNode *function;
} Run;

typedef struct {
    Run *items;
    size_t count, room;
} Runs;

/* Reasons for which an extraction is refused: too many ranges of one place, or in all. */
enum { NONE, BRANCHES, TOTAL };

typedef struct {
    DdManager *manager;
    Place *places;
    int place_count;
    int *home; /* For each level the first place of its block. */
    int level_count;
    long long branches, left;
    int refused, at;
    Table known;
    PyObject *numbers; /* A dictionary from nodes to their numbers, in ascending order. */
} Extraction;

static void forget(const Extraction *extraction, Runs *runs) {
    for (size_t place = 0; place < runs->count; place++) {
        drop(extraction->manager, runs->items[place].function);
    }
    PyMem_Free(runs->items);
}

static int append(Runs *runs, long long start, DdNode *function) {
    if (runs->count == runs->room) {
        size_t room = runs->room ? 2 * runs->room : 8;
        Run *items = PyMem_Realloc(runs->items, room * sizeof *items);
        if (items == NULL) {
            PyErr_NoMemory();
            return 0;
        }
        runs->items = items;
        runs->room = room;
    }
    runs->items[runs->count++] = (Run){start, owned(function)};
    return 1;
}

/* The cofactors of a predicate by the variable of a level, owned; the predicate may have variables above that level. */
static int split_at(DdManager *manager, DdNode *f, int level, DdNode **low, DdNode **high) {
    if (level_of(manager, f) >= level) {
        split(manager, f, level, low, high);
        owned(*low);
        owned(*high);
        return 1;
    }
    DdNode *variable = cudd.variable(manager, cudd.index_at(manager, level));
    *low = owned(cudd.cofactor(manager, f, negation(variable)));
    *high = *low == NULL ? NULL : owned(cudd.cofactor(manager, f, variable));
    return *high != NULL;
}

/* Add the cofactor of a predicate for each value of a place's bits from `bit` on; equal neighbours are merged. */
static int collect(Extraction *extraction, int number, int bit, DdNode *f, long long start, Runs *runs) {
    DdManager *manager = extraction->manager;
    const Place *place = &extraction->places[number];
    if (bit == place->bits || level_of(manager, f) > place->levels[place->bits - 1]) {
        return append(runs, start, f);
    }
    size_t begin = runs->count;
    long long half = (long long)1 << (place->bits - bit - 1);
    DdNode *low, *high;
    int is_done = split_at(manager, f, place->levels[bit], &low, &high) &&
                  collect(extraction, number, bit + 1, low, start, runs);
    size_t middle = runs->count;
    if (is_done && low == high) {
        /* The bit does not matter: both halves look alike. */
        for (size_t item = begin; is_done && item < middle; item++) {
            is_done = append(runs, runs->items[item].start + half, runs->items[item].function);
        }
    } else if (is_done) {
        is_done = collect(extraction, number, bit + 1, high, start + half, runs);
    }
    drop(manager, low);
    drop(manager, high);
    if (!is_done) {
        return 0;
    }
    Run *later = &runs->items[middle];
    if (later->function == later[-1].function) {
        drop(manager, later->function);
        memmove(later, later + 1, (--runs->count - middle) * sizeof *later);
    }
    if ((long long)(runs->count - begin) > extraction->branches) {
        extraction->refused = BRANCHES;
        extraction->at = number;
        return 0;
    }
    return 1;
}

static PyObject *tuple_of(const long long *values, size_t count) {
    PyObject *tuple = PyTuple_New((Py_ssize_t)count);
    for (size_t place = 0; tuple != NULL && place < count; place++) {
        PyObject *value = PyLong_FromLongLong(values[place]);
        if (value == NULL || PyTuple_SetItem(tuple, (Py_ssize_t)place, value) < 0) {
            Py_CLEAR(tuple);
        }
    }
    return tuple;
}

/* The number of a node with branches, from 2 on. */
static int node_number(Extraction *extraction, int place, const long long *starts, const long long *children,
                       size_t count) {
    PyObject *of_starts = tuple_of(starts, count), *of_children = tuple_of(children, count);
    PyObject *node = NULL, *number = NULL;
    int found = -1;
    if (of_starts != NULL && of_children != NULL) {
        node = Py_BuildValue("iOO", place, of_starts, of_children);
    }
    PyObject *known = node == NULL ? NULL : PyDict_GetItemWithError(extraction->numbers, node);
    if (known != NULL) {
        found = (int)PyLong_AsLong(known);
    } else if (node != NULL && !PyErr_Occurred()) {
        Py_ssize_t next = PyDict_Size(extraction->numbers) + 2;
        number = PyLong_FromSsize_t(next);
        if (number != NULL && PyDict_SetItem(extraction->numbers, node, number) == 0) {
            found = (int)next;
        }
    }
    Py_XDECREF(of_starts);
    Py_XDECREF(of_children);
    Py_XDECREF(node);
    Py_XDECREF(number);
    return found;
}

static int number_of(Extraction *extraction, DdNode *f, int first);

static int home_of(const Extraction *extraction, DdNode *f) {
    int level = level_of(extraction->manager, f);
    return level < extraction->level_count ? extraction->home[level] : -1;
}

/* The number of the node that tests a place, by the place's cofactors. */
static int branched(Extraction *extraction, int number, const Runs *runs) {
    const Place *place = &extraction->places[number];
    long long *starts = PyMem_Malloc(2 * runs->count * sizeof *starts), *children;
    size_t count = 0;
    int found = -1;
    if (starts == NULL) {
        PyErr_NoMemory();
        return found;
    }
    children = starts + runs->count;
    /* Codes from the size on stand for no value: the predicate is ignored there. */
    for (size_t item = 0; item < runs->count && runs->items[item].start < place->size; item++) {
        DdNode *below = runs->items[item].function;
        int home = home_of(extraction, below);
        int is_same = home >= 0 && extraction->places[home].end == place->end;
        found = number_of(extraction, below, is_same ? number + 1 : home);
        if (found < 0) {
            PyMem_Free(starts);
            return found;
        }
        if (count == 0 || children[count - 1] != found) {
            starts[count] = runs->items[item].start;
            children[count++] = found;
        }
    }
    found = count == 1 ? (int)children[0] : node_number(extraction, number, starts, children, count);
    PyMem_Free(starts);
    return found;
}

static int new_number(Extraction *extraction, DdNode *f, int first) {
    for (int number = first; number >= 0 && number < extraction->places[first].end; number++) {
        Runs runs = {0};
        int found = -1, is_done = collect(extraction, number, 0, f, 0, &runs);
        int is_tested = is_done && runs.count > 1;
        if (is_tested) {
            extraction->left -= (long long)runs.count;
            if (extraction->left < 0) {
                extraction->refused = TOTAL;
                extraction->at = number;
            } else {
                found = branched(extraction, number, &runs);
            }
        }
        forget(extraction, &runs);
        if (is_tested || !is_done) {
            return found;
        }
    }
    PyErr_SetString(PyExc_ValueError, "a predicate depends on none of the places that its topmost variable stands for");
    return -1;
}

/* The number of a predicate: 0 false, 1 true, from 2 on nodes; -1 is a failure. The predicate depends on no place of its
 * block before `first`.
 */
static int number_of(Extraction *extraction, DdNode *f, int first) {
    if (regular(f) == cudd.one(extraction->manager)) {
        return f == cudd.one(extraction->manager);
    }
    Entry *entry = entry_of(&extraction->known, f, NULL, first);
    if (entry->found != NULL) {
        return entry->value;
    }
    int found = new_number(extraction, f, first);
    if (found >= 0) {
        if (!remember(&extraction->known, f, NULL, first, f)) {
            return -1;
        }
        entry_of(&extraction->known, f, NULL, first)->value = found;
    }
    return found;
}

static int read_place(PyObject *pair, Place *place) {
    PyObject *levels;
    if (pair == NULL || !PyArg_ParseTuple(pair, "LO!", &place->size, &PyTuple_Type, &levels)) {
        return 0;
    }
    place->bits = (int)PyTuple_Size(levels);
    place->levels = PyMem_Calloc((size_t)place->bits + 1, sizeof *place->levels);
    if (place->levels == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    for (int bit = 0; bit < place->bits; bit++) {
        place->levels[bit] = (int)PyLong_AsLong(PyTuple_GetItem(levels, bit));
    }
    return !PyErr_Occurred();
}

static int read_home(Extraction *extraction, int first, int end) {
    for (int number = first; number < end; number++) {
        Place *place = &extraction->places[number];
        place->end = end;
        for (int bit = 0; bit < place->bits; bit++) {
            if (place->levels[bit] < 0 || place->levels[bit] >= extraction->level_count) {
                PyErr_SetString(PyExc_ValueError, "there is no such level");
                return 0;
            }
            extraction->home[place->levels[bit]] = first;
        }
    }
    return 1;
}

static int read_places(Extraction *extraction, PyObject *blocks) {
    int count = 0;
    for (Py_ssize_t block = 0; block < PyTuple_Size(blocks); block++) {
        count += (int)PyTuple_Size(PyTuple_GetItem(blocks, block));
    }
    if (PyErr_Occurred()) {
        return 0;
    }
    extraction->places = PyMem_Calloc((size_t)count + 1, sizeof(Place));
    extraction->level_count = cudd.size(extraction->manager);
    extraction->home = PyMem_Calloc((size_t)extraction->level_count + 1, sizeof(int));
    extraction->numbers = PyDict_New();
    if (extraction->places == NULL || extraction->home == NULL || extraction->numbers == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    for (int level = 0; level < extraction->level_count; level++) {
        extraction->home[level] = -1;
    }
    extraction->place_count = count;
    int number = 0;
    for (Py_ssize_t block = 0; block < PyTuple_Size(blocks); block++) {
        PyObject *places = PyTuple_GetItem(blocks, block);
        int first = number;
        for (Py_ssize_t item = 0; item < PyTuple_Size(places); item++) {
            if (!read_place(PyTuple_GetItem(places, item), &extraction->places[number++])) {
                return 0;
            }
        }
        if (!read_home(extraction, first, number)) {
            return 0;
        }
    }
    return 1;
}

PyObject *diagram_extract(PyObject *module, PyObject *arguments) {
    (void)module;
    Extraction extraction = {0};
    PyObject *bdd, *blocks, *result = NULL;
    unsigned long long f;
    if (!PyArg_ParseTuple(arguments, "OKO!LL", &bdd, &f, &PyTuple_Type, &blocks, &extraction.branches,
                          &extraction.left)) {
        return NULL;
    }
    extraction.manager = manager_of(bdd);
    DdNode *predicate = (DdNode *)(uintptr_t)f;
    int found = -1;
    if (read_places(&extraction, blocks) && make_table(&extraction.known, 256)) {
        found = number_of(&extraction, predicate, home_of(&extraction, predicate));
    }
    if (extraction.refused && !PyErr_Occurred()) {
        result = Py_BuildValue("iOi", extraction.refused, Py_None, extraction.at);
    } else if (found < 0) {
        result = passed(NULL);
    } else {
        result = Py_BuildValue("iNi", NONE, PyDict_Keys(extraction.numbers), found);
    }
    free_table(extraction.manager, &extraction.known);
    for (int number = 0; extraction.places != NULL && number < extraction.place_count; number++) {
        PyMem_Free(extraction.places[number].levels);
    }
    PyMem_Free(extraction.places);
    PyMem_Free(extraction.home);
    Py_XDECREF(extraction.numbers);
    return result;
}

PyObject *diagram_implies(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *bdd;
    unsigned long long f, g;
    if (!PyArg_ParseTuple(arguments, "OKK", &bdd, &f, &g)) {
        return NULL;
    }
    return PyBool_FromLong(cudd.leq(manager_of(bdd), (DdNode *)(uintptr_t)f, (DdNode *)(uintptr_t)g));
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

/* Layout: what robosc/synthesis/layout.py compares with dd */

PyObject *diagram_manager(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *bdd;
    if (!PyArg_ParseTuple(arguments, "O", &bdd)) {
        return NULL;
    }
    return PyLong_FromUnsignedLongLong((unsigned long long)(uintptr_t)manager_of(bdd));
}

PyObject *diagram_look(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *bdd;
    unsigned long long f;
    if (!PyArg_ParseTuple(arguments, "OK", &bdd, &f)) {
        return NULL;
    }
    DdManager *manager = manager_of(bdd);
    DdNode *node = (DdNode *)(uintptr_t)f, *low, *high;
    int level = level_of(manager, node);
    if (level == INT_MAX) {
        return Py_BuildValue("iKK", -1, 0ULL, 0ULL);
    }
    split(manager, node, level, &low, &high);
    return Py_BuildValue("iKK", level, (unsigned long long)(uintptr_t)low, (unsigned long long)(uintptr_t)high);
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
