/* Decision diagrams over finitely many values: the operations of conditions/multivalued.py that take most of its time.
 *
 * Each operation takes the same steps in the same order as its twin in Python, and makes the same nodes with the same
 * numbers. Steps are counted: an operation gets the number of steps that are left, and returns the number that it took.
 * It fails when it needs more.
 */
#include "kernel.h"

static const char NAME[] = "robosc.kernel.space";

enum { BOTH, EITHER, WITHOUT };

typedef struct {
    uint32_t variable;
    uint32_t first; /* Its children in the pool: as many as its variable has classes. */
} Node;

typedef struct {
    uint32_t operation, a, b, found; /* Free where a is 0: no operation that is looked up has false first. */
} Applied;

typedef struct {
    uint32_t variables;
    uint32_t *classes;
    Node *nodes;
    size_t node_count, node_room;
    uint32_t *pool;
    size_t pool_count, pool_room;
    uint32_t *numbers; /* Hash table of nodes; 0 is a free place. */
    size_t number_room;
    Applied *applied;
    size_t applied_count, applied_room;
    uint32_t *seen, *known; /* For each node the last round in which it was met. */
    uint32_t *value;
    uint32_t round;
    size_t mark_room;
    uint64_t *cube;
    long long left, spent;
} Space;

static const uint32_t FAILED = UINT32_MAX;

/* Count some steps; false, without an exception, if more steps were taken than were left. */
static int spend(Space *space, long long steps) {
    space->spent += steps;
    return space->spent <= space->left;
}

static int grow(void **items, size_t *room, size_t needed, size_t size) {
    if (needed <= *room) {
        return 1;
    }
    size_t larger = *room;
    while (larger < needed) {
        larger = larger ? 2 * larger : 256;
    }
    void *found = PyMem_Realloc(*items, larger * size);
    if (found == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    *items = found;
    *room = larger;
    return 1;
}

static const uint32_t *children_of(const Space *space, uint32_t node) { return space->pool + space->nodes[node].first; }

static uint32_t variable_of(const Space *space, uint32_t node) { return space->nodes[node].variable; }

static uint64_t hash_of(const Space *space, uint32_t variable, const uint32_t *children) {
    uint64_t hash = variable * 0x9E3779B97F4A7C15u;
    for (uint32_t place = 0; place < space->classes[variable]; place++) {
        hash = (hash ^ children[place]) * 0xC2B2AE3D27D4EB4Fu;
        hash ^= hash >> 31;
    }
    return hash;
}

/* The place of a node in the hash table, or where it would be. */
static size_t place_of(const Space *space, uint32_t variable, const uint32_t *children) {
    size_t place = (size_t)hash_of(space, variable, children) & (space->number_room - 1);
    while (space->numbers[place] != 0) {
        uint32_t other = space->numbers[place];
        if (variable_of(space, other) == variable &&
            memcmp(children_of(space, other), children, space->classes[variable] * sizeof *children) == 0) {
            break;
        }
        place = (place + 1) & (space->number_room - 1);
    }
    return place;
}

static int enlarge_numbers(Space *space) {
    if (3 * (space->node_count + 1) <= 2 * space->number_room) {
        return 1;
    }
    uint32_t *numbers = PyMem_Calloc(2 * space->number_room, sizeof *numbers);
    if (numbers == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    PyMem_Free(space->numbers);
    space->numbers = numbers;
    space->number_room *= 2;
    for (size_t node = 2; node < space->node_count; node++) {
        space->numbers[place_of(space, space->nodes[node].variable, children_of(space, (uint32_t)node))] = (uint32_t)node;
    }
    return 1;
}

/* The node with the children on top of the pool, from `first` on; they are removed from the pool unless it is new. */
static uint32_t make(Space *space, uint32_t variable, size_t first) {
    if (!spend(space, 1)) {
        return FAILED;
    }
    const uint32_t *children = space->pool + first;
    uint32_t count = space->classes[variable], place = 1;
    while (place < count && children[place] == children[0]) {
        place++;
    }
    if (place == count) {
        space->pool_count = first;
        return children[0];
    }
    if (!enlarge_numbers(space)) {
        return FAILED;
    }
    size_t home = place_of(space, variable, children);
    if (space->numbers[home] != 0) {
        space->pool_count = first;
        return space->numbers[home];
    }
    if (!grow((void **)&space->nodes, &space->node_room, space->node_count + 1, sizeof *space->nodes)) {
        return FAILED;
    }
    uint32_t number = (uint32_t)space->node_count++;
    space->nodes[number] = (Node){variable, (uint32_t)first};
    space->numbers[home] = number;
    return number;
}

/* Operations */

static Applied *applied_at(const Space *space, uint32_t operation, uint32_t a, uint32_t b) {
    uint64_t hash = (((uint64_t)a << 32) | b) * 0x9E3779B97F4A7C15u + operation * 0xC2B2AE3D27D4EB4Fu;
    size_t place = (size_t)(hash >> 17) & (space->applied_room - 1);
    while (space->applied[place].a != 0) {
        Applied *item = &space->applied[place];
        if (item->operation == operation && item->a == a && item->b == b) {
            break;
        }
        place = (place + 1) & (space->applied_room - 1);
    }
    return &space->applied[place];
}

static int enlarge_applied(Space *space) {
    if (3 * (space->applied_count + 1) <= 2 * space->applied_room) {
        return 1;
    }
    Applied *before = space->applied;
    size_t room = space->applied_room;
    space->applied = PyMem_Calloc(2 * room, sizeof *before);
    if (space->applied == NULL) {
        space->applied = before;
        PyErr_NoMemory();
        return 0;
    }
    space->applied_room = 2 * room;
    for (size_t place = 0; place < room; place++) {
        if (before[place].a != 0) {
            *applied_at(space, before[place].operation, before[place].a, before[place].b) = before[place];
        }
    }
    PyMem_Free(before);
    return 1;
}

static uint32_t apply(Space *space, uint32_t operation, uint32_t a, uint32_t b);

static uint32_t applied(Space *space, uint32_t operation, uint32_t a, uint32_t b) {
    Applied *known = applied_at(space, operation, a, b);
    if (known->a != 0) {
        return known->found;
    }
    if (!spend(space, 1)) {
        return FAILED;
    }
    uint32_t of_a = variable_of(space, a), of_b = variable_of(space, b), variable = of_a < of_b ? of_a : of_b;
    uint32_t count = space->classes[variable];
    uint32_t found[64];
    for (uint32_t place = 0; place < count; place++) {
        uint32_t first = of_a == variable ? children_of(space, a)[place] : a;
        uint32_t second = of_b == variable ? children_of(space, b)[place] : b;
        found[place] = apply(space, operation, first, second);
        if (found[place] == FAILED) {
            return FAILED;
        }
    }
    size_t first = space->pool_count;
    if (!grow((void **)&space->pool, &space->pool_room, first + count, sizeof *space->pool)) {
        return FAILED;
    }
    memcpy(space->pool + first, found, count * sizeof *found);
    space->pool_count = first + count;
    uint32_t node = make(space, variable, first);
    if (node == FAILED || !enlarge_applied(space)) {
        return FAILED;
    }
    *applied_at(space, operation, a, b) = (Applied){operation, a, b, node};
    space->applied_count++;
    return node;
}

static uint32_t apply(Space *space, uint32_t operation, uint32_t a, uint32_t b) {
    switch (operation) {
    case BOTH:
        if (a == b || b == 1) {
            return a;
        }
        if (a == 0 || b == 0) {
            return 0;
        }
        if (a == 1) {
            return b;
        }
        return a < b ? applied(space, BOTH, a, b) : applied(space, BOTH, b, a);
    case EITHER:
        if (a == b || b == 0) {
            return a;
        }
        if (a == 1 || b == 1) {
            return 1;
        }
        if (a == 0) {
            return b;
        }
        return a < b ? applied(space, EITHER, a, b) : applied(space, EITHER, b, a);
    default:
        if (a == b || a == 0 || b == 1) {
            return 0;
        }
        return b == 0 ? a : applied(space, WITHOUT, a, b);
    }
}

/* Searches */

/* Begin a round of marks: no node has been met in it. */
static int begin_round(Space *space) {
    if (space->mark_room < space->node_count || space->round == UINT32_MAX) {
        size_t room = space->node_room;
        uint32_t *seen = PyMem_Calloc(room, sizeof *seen), *known = PyMem_Calloc(room, sizeof *known);
        uint32_t *value = PyMem_Calloc(room, sizeof *value);
        if (seen == NULL || known == NULL || value == NULL) {
            PyMem_Free(seen);
            PyMem_Free(known);
            PyMem_Free(value);
            PyErr_NoMemory();
            return 0;
        }
        PyMem_Free(space->seen);
        PyMem_Free(space->known);
        PyMem_Free(space->value);
        space->seen = seen;
        space->known = known;
        space->value = value;
        space->mark_room = room;
        space->round = 0;
    }
    space->round++;
    return 1;
}

static int is_in_cube(const Space *space, uint32_t variable, uint32_t place) {
    return (int)(space->cube[variable] >> place & 1);
}

/* Return 1 if a node is true somewhere in the cube, otherwise 0, or -1 for a failure. */
static int meets(Space *space, uint32_t node) {
    if (node < 2) {
        return (int)node;
    }
    if (!begin_round(space)) {
        return -1;
    }
    uint32_t *stack = PyMem_Malloc(space->node_count * sizeof *stack);
    if (stack == NULL) {
        PyErr_NoMemory();
        return -1;
    }
    size_t count = 0;
    long long met = 1;
    int found = 0;
    stack[count++] = node;
    space->seen[node] = space->round;
    while (count > 0 && !found) {
        uint32_t item = stack[--count], variable = variable_of(space, item);
        const uint32_t *children = children_of(space, item);
        for (uint32_t place = 0; place < space->classes[variable]; place++) {
            uint32_t child = children[place];
            if (child == 0 || !is_in_cube(space, variable, place) || space->seen[child] == space->round) {
                continue;
            }
            if (child == 1) {
                found = 1;
                break;
            }
            space->seen[child] = space->round;
            stack[count++] = child;
            met++;
        }
    }
    PyMem_Free(stack);
    spend(space, met);
    return found;
}

/* Return 1 if a node is true somewhere in the cube. The result is kept for the round; `count` counts the kept results.
   */
static uint32_t leads(Space *space, uint32_t node, long long *count) {
    if (node < 2) {
        return node;
    }
    if (space->known[node] == space->round) {
        return space->value[node];
    }
    uint32_t variable = variable_of(space, node), found = 0;
    for (uint32_t place = 0; place < space->classes[variable] && !found; place++) {
        if (is_in_cube(space, variable, place)) {
            found = leads(space, children_of(space, node)[place], count);
        }
    }
    space->known[node] = space->round;
    space->value[node] = found;
    ++*count;
    return found;
}

/* The classes of a variable, as bits, with which a node is true somewhere in the cube; fails with an exception. */
static uint64_t meeting(Space *space, uint32_t node, uint32_t variable, uint64_t full) {
    if (node == 0) {
        spend(space, 1);
        return 0;
    }
    uint32_t *stack = PyMem_Malloc(space->node_count * sizeof *stack);
    if (stack == NULL || !begin_round(space)) {
        PyMem_Free(stack);
        PyErr_NoMemory();
        return 0;
    }
    size_t count = 0;
    long long met = 1, remembered = 0;
    uint64_t found = 0;
    stack[count++] = node;
    space->seen[node] = space->round;
    while (count > 0 && found != full) {
        uint32_t item = stack[--count], here = variable_of(space, item);
        if (here > variable) {
            found = leads(space, item, &remembered) ? full : found;
            continue;
        }
        const uint32_t *children = children_of(space, item);
        for (uint32_t place = 0; place < space->classes[here]; place++) {
            uint32_t child = children[place];
            if (child == 0) {
                continue;
            }
            if (here == variable) {
                if (!(found >> place & 1) && leads(space, child, &remembered)) {
                    found |= (uint64_t)1 << place;
                }
            } else if (is_in_cube(space, here, place) && space->seen[child] != space->round) {
                space->seen[child] = space->round;
                stack[count++] = child;
                met++;
            }
        }
    }
    PyMem_Free(stack);
    spend(space, met + remembered);
    return found;
}

/* Steps from a node, which is not false, to true: at least as many as the shortest path has. */
static uint32_t length(Space *space, uint32_t node) {
    if (node == 1) {
        return 0;
    }
    if (space->known[node] == space->round) {
        return space->value[node];
    }
    if (!spend(space, 1)) {
        return FAILED;
    }
    uint32_t least = FAILED;
    for (uint32_t place = 0; place < space->classes[variable_of(space, node)]; place++) {
        uint32_t child = children_of(space, node)[place];
        if (child == 0) {
            continue;
        }
        uint32_t below = length(space, child);
        if (below == FAILED) {
            return FAILED;
        }
        least = below < least ? below : least;
    }
    space->known[node] = space->round;
    space->value[node] = least + 1;
    return least + 1;
}

/* Arguments from Python */

static void free_space(PyObject *capsule) {
    Space *space = PyCapsule_GetPointer(capsule, NAME);
    PyMem_Free(space->classes);
    PyMem_Free(space->nodes);
    PyMem_Free(space->pool);
    PyMem_Free(space->numbers);
    PyMem_Free(space->applied);
    PyMem_Free(space->seen);
    PyMem_Free(space->known);
    PyMem_Free(space->value);
    PyMem_Free(space->cube);
    PyMem_Free(space);
}

static Space *space_of(PyObject *capsule, long long left) {
    Space *space = PyCapsule_GetPointer(capsule, NAME);
    if (space != NULL) {
        space->left = left;
        space->spent = 0;
    }
    return space;
}

static int is_node(const Space *space, unsigned int node) {
    if (node < space->node_count) {
        return 1;
    }
    PyErr_Format(PyExc_IndexError, "there is no node %u", node);
    return 0;
}

static int read_cube(Space *space, PyObject *cube) {
    if (PyTuple_Size(cube) != (Py_ssize_t)space->variables) {
        PyErr_SetString(PyExc_ValueError, "a cube has a set for each place");
        return 0;
    }
    for (uint32_t variable = 0; variable < space->variables; variable++) {
        space->cube[variable] = PyLong_AsUnsignedLongLong(PyTuple_GetItem(cube, variable));
        if (PyErr_Occurred()) {
            return 0;
        }
    }
    return 1;
}

/* A result and its number of steps. Without an exception, the result FAILED means too many steps. */
static PyObject *with_steps(const Space *space, unsigned long long found) {
    return PyErr_Occurred() ? NULL : Py_BuildValue("KL", found, space->spent);
}

PyObject *space_make_store(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *counts;
    if (!PyArg_ParseTuple(arguments, "O!", &PyTuple_Type, &counts)) {
        return NULL;
    }
    Space *space = PyMem_Calloc(1, sizeof *space);
    PyObject *capsule = space == NULL ? PyErr_NoMemory() : PyCapsule_New(space, NAME, free_space);
    if (capsule == NULL) {
        PyMem_Free(space);
        return NULL;
    }
    space->variables = (uint32_t)PyTuple_Size(counts);
    space->number_room = 1024;
    space->applied_room = 1024;
    space->classes = PyMem_Calloc(space->variables + 1, sizeof *space->classes);
    space->cube = PyMem_Calloc(space->variables + 1, sizeof *space->cube);
    space->numbers = PyMem_Calloc(space->number_room, sizeof *space->numbers);
    space->applied = PyMem_Calloc(space->applied_room, sizeof *space->applied);
    if (space->classes == NULL || space->cube == NULL || space->numbers == NULL || space->applied == NULL ||
        !grow((void **)&space->nodes, &space->node_room, 2, sizeof *space->nodes)) {
        Py_DECREF(capsule);
        return PyErr_NoMemory();
    }
    for (uint32_t variable = 0; variable < space->variables; variable++) {
        unsigned long count = PyLong_AsUnsignedLong(PyTuple_GetItem(counts, variable));
        if (count < 1 || count > 64) {
            Py_DECREF(capsule);
            PyErr_SetString(PyExc_ValueError, "a place has 1 to 64 classes");
            return NULL;
        }
        space->classes[variable] = (uint32_t)count;
    }
    /* The constants are tested below everything, and have no children. */
    space->nodes[0] = space->nodes[1] = (Node){space->variables, 0};
    space->node_count = 2;
    return capsule;
}

PyObject *space_make(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *capsule, *children;
    unsigned int variable;
    long long left;
    if (!PyArg_ParseTuple(arguments, "OIO!L", &capsule, &variable, &PyTuple_Type, &children, &left)) {
        return NULL;
    }
    Space *space = space_of(capsule, left);
    if (space == NULL) {
        return NULL;
    }
    if (variable >= space->variables || PyTuple_Size(children) != (Py_ssize_t)space->classes[variable]) {
        PyErr_SetString(PyExc_ValueError, "a node has a child for each class of its place");
        return NULL;
    }
    uint32_t count = space->classes[variable];
    size_t first = space->pool_count;
    if (!grow((void **)&space->pool, &space->pool_room, first + count, sizeof *space->pool)) {
        return NULL;
    }
    for (uint32_t place = 0; place < count; place++) {
        unsigned long child = PyLong_AsUnsignedLong(PyTuple_GetItem(children, place));
        if (PyErr_Occurred() || !is_node(space, (unsigned int)child)) {
            return NULL;
        }
        space->pool[first + place] = (uint32_t)child;
    }
    space->pool_count = first + count;
    return with_steps(space, make(space, variable, first));
}

PyObject *space_apply(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *capsule;
    unsigned int operation, a, b;
    long long left;
    if (!PyArg_ParseTuple(arguments, "OIIIL", &capsule, &operation, &a, &b, &left)) {
        return NULL;
    }
    Space *space = space_of(capsule, left);
    if (space == NULL || !is_node(space, a) || !is_node(space, b)) {
        return NULL;
    }
    return with_steps(space, apply(space, operation, a, b));
}

PyObject *space_meets(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *capsule, *cube;
    unsigned int node;
    if (!PyArg_ParseTuple(arguments, "OIO!", &capsule, &node, &PyTuple_Type, &cube)) {
        return NULL;
    }
    Space *space = space_of(capsule, 0);
    if (space == NULL || !is_node(space, node) || !read_cube(space, cube)) {
        return NULL;
    }
    return with_steps(space, (unsigned long long)meets(space, node));
}

PyObject *space_meeting(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *capsule, *cube;
    unsigned int node, variable;
    if (!PyArg_ParseTuple(arguments, "OIO!I", &capsule, &node, &PyTuple_Type, &cube, &variable)) {
        return NULL;
    }
    Space *space = space_of(capsule, 0);
    if (space == NULL || !is_node(space, node) || !read_cube(space, cube)) {
        return NULL;
    }
    if (variable >= space->variables) {
        PyErr_Format(PyExc_IndexError, "there is no place %u", variable);
        return NULL;
    }
    uint64_t full = UINT64_MAX >> (64 - space->classes[variable]);
    return with_steps(space, meeting(space, node, variable, full));
}

PyObject *space_shortest_path(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *capsule;
    unsigned int node;
    long long left;
    if (!PyArg_ParseTuple(arguments, "OIL", &capsule, &node, &left)) {
        return NULL;
    }
    Space *space = space_of(capsule, left);
    if (space == NULL || !is_node(space, node) || !begin_round(space)) {
        return NULL;
    }
    PyObject *path = PyList_New(0);
    int is_over = 0;
    while (path != NULL && node > 1) {
        uint32_t variable = variable_of(space, node), best = 0, least = FAILED;
        const uint32_t *children = children_of(space, node);
        for (uint32_t place = 0; place < space->classes[variable] && !is_over; place++) {
            if (children[place] != 0) {
                uint32_t below = length(space, children[place]);
                is_over = below == FAILED;
                if (below < least) {
                    least = below;
                    best = children[place];
                }
            }
        }
        if (is_over) {
            break;
        }
        uint64_t mask = 0;
        for (uint32_t place = 0; place < space->classes[variable]; place++) {
            mask |= (uint64_t)(children[place] == best) << place;
        }
        PyObject *pair = Py_BuildValue("IK", variable, (unsigned long long)mask);
        if (pair == NULL || PyList_Append(path, pair) < 0) {
            Py_CLEAR(path);
        }
        Py_XDECREF(pair);
        node = best;
    }
    return path == NULL ? NULL : Py_BuildValue("NL", path, space->spent);
}

PyObject *space_nodes(PyObject *module, PyObject *arguments) {
    (void)module;
    PyObject *capsule;
    unsigned int first;
    if (!PyArg_ParseTuple(arguments, "OI", &capsule, &first)) {
        return NULL;
    }
    Space *space = space_of(capsule, 0);
    PyObject *found = space == NULL ? NULL : PyList_New(0);
    for (size_t node = first; found != NULL && node < space->node_count; node++) {
        uint32_t variable = space->nodes[node].variable;
        uint32_t count = node < 2 ? 0 : space->classes[variable];
        PyObject *children = PyTuple_New(count);
        for (uint32_t place = 0; children != NULL && place < count; place++) {
            PyObject *child = PyLong_FromUnsignedLong(children_of(space, (uint32_t)node)[place]);
            if (child == NULL || PyTuple_SetItem(children, place, child) < 0) {
                Py_CLEAR(children);
            }
        }
        PyObject *pair = children == NULL ? NULL : Py_BuildValue("IN", variable, children);
        if (pair == NULL || PyList_Append(found, pair) < 0) {
            Py_CLEAR(found);
        }
        Py_XDECREF(pair);
    }
    return found;
}
