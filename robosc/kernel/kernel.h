/* Parts of the kernel: functions of one module of Python. */
#ifndef ROBOSC_KERNEL_H
#define ROBOSC_KERNEL_H

#define Py_LIMITED_API 0x030C0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <stdint.h>
#include <string.h>

/* Decision diagrams of CUDD: diagrams.c */
PyObject *diagram_connect(PyObject *module, PyObject *arguments);
PyObject *diagram_closure(PyObject *module, PyObject *arguments);
PyObject *diagram_restrict(PyObject *module, PyObject *arguments);
PyObject *diagram_implies(PyObject *module, PyObject *arguments);
PyObject *diagram_without(PyObject *module, PyObject *arguments);
PyObject *diagram_separated(PyObject *module, PyObject *arguments);
PyObject *diagram_extract(PyObject *module, PyObject *arguments);
PyObject *diagram_release(PyObject *module, PyObject *arguments);
PyObject *diagram_manager(PyObject *module, PyObject *arguments);
PyObject *diagram_look(PyObject *module, PyObject *arguments);

/* Memory that may not be there: layout.c */
PyObject *layout_bytes_at(PyObject *module, PyObject *arguments);

/* Decision diagrams over many values: spaces.c */
PyObject *space_make_store(PyObject *module, PyObject *arguments);
PyObject *space_make(PyObject *module, PyObject *arguments);
PyObject *space_apply(PyObject *module, PyObject *arguments);
PyObject *space_meets(PyObject *module, PyObject *arguments);
PyObject *space_meeting(PyObject *module, PyObject *arguments);
PyObject *space_shortest_path(PyObject *module, PyObject *arguments);
PyObject *space_nodes(PyObject *module, PyObject *arguments);

/* Objects that live as long as their process: objects.c */
PyObject *objects_keep(PyObject *module, PyObject *arguments);

#endif
