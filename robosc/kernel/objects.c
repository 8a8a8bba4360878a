/* Objects that live as long as their process (PEP 683, "Immortal Objects, Using a Fixed Refcount").

   Python counts the references to an object in the object. A forked process that only reads what its parent had made
   would copy each page of it for that; the count of an immortal object is never written. */
#include "kernel.h"

#define IMMORTAL ((Py_ssize_t)UINT32_MAX)
#define FIRST_PLACES 4096

typedef struct {
    PyObject **objects; /* Immortal already, but not what they refer to. */
    size_t count;
    size_t places;
    Py_ssize_t made;
} Found;

/* Other versions keep other things beside the count, or another count. */
static int is_known_layout(void) {
    return sizeof(void *) == 8 && Py_Version >= 0x030C0000 && Py_Version < 0x030E0000;
}

static int keep(PyObject *object, void *argument) {
    Found *found = argument;
    if (object == NULL || (int32_t)object->ob_refcnt < 0) {
        return 0;
    }
    if (found->count == found->places) {
        size_t places = found->places == 0 ? FIRST_PLACES : 2 * found->places;
        PyObject **objects = PyMem_Realloc(found->objects, places * sizeof(PyObject *));
        if (objects == NULL) {
            PyErr_NoMemory();
            return -1;
        }
        found->objects = objects;
        found->places = places;
    }
    object->ob_refcnt = IMMORTAL;
    found->objects[found->count++] = object;
    found->made++;
    return 0;
}

/* The garbage collector knows nothing of what code refers to, since that makes no cycles. */
static int keep_parts_of_code(PyObject *code, Found *found) {
    static const char *const NAMES[] = {
        "co_consts", "co_names", "co_name", "co_qualname", "co_filename", "co_linetable", "co_exceptiontable",
    };
    for (size_t place = 0; place < sizeof NAMES / sizeof *NAMES; place++) {
        PyObject *part = PyObject_GetAttrString(code, NAMES[place]);
        if (part == NULL) {
            return -1;
        }
        int status = keep(part, found);
        Py_DECREF(part);
        if (status < 0) {
            return status;
        }
    }
    return 0;
}

static int keep_parts(PyObject *object, PyTypeObject *code_type, Found *found) {
    PyTypeObject *type = Py_TYPE(object);
    if (type == code_type) {
        return keep_parts_of_code(object, found);
    }
    if (PyDict_Check(object)) {
        /* The garbage collector leaves out keys that are texts. */
        PyObject *key, *value;
        Py_ssize_t place = 0;
        while (PyDict_Next(object, &place, &key, &value)) {
            if (keep(key, found) < 0 || keep(value, found) < 0) {
                return -1;
            }
        }
    }
    /* Types written in C are no business of the garbage collector, and cannot be traversed. */
    if (!PyType_IS_GC(type) || (PyType_Check(object) && !(PyType_GetFlags((PyTypeObject *)object) & Py_TPFLAGS_HEAPTYPE))) {
        return 0;
    }
    void *slot = PyType_GetSlot(type, Py_tp_traverse);
    traverseproc traverse;
    memcpy(&traverse, &slot, sizeof traverse);
    return traverse == NULL ? 0 : traverse(object, keep, found);
}

PyObject *objects_keep(PyObject *module, PyObject *arguments) {
    PyObject *roots, *code_type;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "O!O!", &PyList_Type, &roots, &PyType_Type, &code_type)) {
        return NULL;
    }
    Found found = {NULL, 0, 0, 0};
    int status = 0;
    if (is_known_layout()) {
        for (Py_ssize_t place = 0; status == 0 && place < PyList_Size(roots); place++) {
            status = keep(PyList_GetItem(roots, place), &found);
            while (status == 0 && found.count > 0) {
                status = keep_parts(found.objects[--found.count], (PyTypeObject *)code_type, &found);
            }
        }
    }
    PyMem_Free(found.objects);
    return status < 0 ? NULL : PyLong_FromSsize_t(found.made);
}
