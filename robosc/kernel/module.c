/* The kernel as a module of Python. */
#include "kernel.h"

#ifndef SOURCE_CHECKSUM
#define SOURCE_CHECKSUM 0
#endif

static PyMethodDef FUNCTIONS[] = {
    {"connect", diagram_connect, METH_VARARGS, "Find the functions of CUDD in a library, given by its path."},
    {"closure", diagram_closure, METH_VARARGS, "Return a set of states closed under steps: see synthesis/saturation.py."},
    {"restrict", diagram_restrict, METH_VARARGS, "Return a predicate that equals another where a third is true."},
    {"implies", diagram_implies, METH_VARARGS, "Return whether a predicate is true only where another one is."},
    {"without", diagram_without, METH_VARARGS, "Return a set of states with some places quantified."},
    {"separated", diagram_separated, METH_VARARGS, "Return two disjoint sets without places that are not needed for it."},
    {"extract", diagram_extract, METH_VARARGS, "Return a predicate as nodes over places: see synthesis/diagrams.py."},
    {"release", diagram_release, METH_VARARGS, "Give back the reference of a node that was returned."},
    {"manager", diagram_manager, METH_VARARGS, "Return the address of CUDD's manager in a manager of dd."},
    {"look", diagram_look, METH_VARARGS, "Return the level and the cofactors of a node; level -1: it is a constant."},
    {"bytes_at", layout_bytes_at, METH_VARARGS, "Return the bytes at an address, or None if there is no memory."},
    {"space", space_make_store, METH_VARARGS, "Return an empty store, for places with so many classes."},
    {"space_make", space_make, METH_VARARGS, "Return the node with some children, and the steps it took."},
    {"space_apply", space_apply, METH_VARARGS, "Return the result of an operation on two nodes, and the steps it took."},
    {"space_meets", space_meets, METH_VARARGS, "Return whether a node meets a cube, and the steps it took."},
    {"space_meeting", space_meeting, METH_VARARGS, "Return the classes with which a node meets a cube, and the steps."},
    {"space_shortest_path", space_shortest_path, METH_VARARGS, "Return the shortest path to true, and the steps it took."},
    {"space_nodes", space_nodes, METH_VARARGS, "Return the nodes from a number on."},
    {"keep", objects_keep, METH_VARARGS, "Make objects immortal, and all that they refer to; return the number."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef MODULE = {
    PyModuleDef_HEAD_INIT, "_kernel", "Inner loops of synthesis and of its conditions.", -1, FUNCTIONS,
    NULL, NULL, NULL, NULL,
};

PyMODINIT_FUNC PyInit__kernel(void);

PyMODINIT_FUNC PyInit__kernel(void) {
    PyObject *module = PyModule_Create(&MODULE);
    PyObject *checksum = PyLong_FromUnsignedLong(SOURCE_CHECKSUM);
    if (module != NULL && PyModule_AddObjectRef(module, "SOURCE_CHECKSUM", checksum) < 0) {
        Py_CLEAR(module);
    }
    Py_XDECREF(checksum);
    return module;
}
