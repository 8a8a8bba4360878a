/* Memory that may not be there: how robosc/synthesis/layout.py looks at what another build of dd could lay out otherwise.
 *
 * The system reads an address that is none without ending the process: it refuses to write such bytes to a pipe.
 */
#include "kernel.h"

#include <unistd.h>

/* Bytes that a pipe takes at once in every system (POSIX, "limits.h": _POSIX_PIPE_BUF). */
enum { MOST_BYTES = 512 };

PyObject *layout_bytes_at(PyObject *module, PyObject *arguments) {
    (void)module;
    unsigned long long address;
    Py_ssize_t size;
    if (!PyArg_ParseTuple(arguments, "Kn", &address, &size)) {
        return NULL;
    }
    if (size < 0 || size > MOST_BYTES) {
        return PyErr_Format(PyExc_ValueError, "%zd bytes: there can be 0 to %d", size, (int)MOST_BYTES);
    }
    int ends[2];
    if (pipe(ends) < 0) {
        return PyErr_SetFromErrno(PyExc_OSError);
    }
    char bytes[MOST_BYTES];
    int is_there = write(ends[1], (const void *)(uintptr_t)address, (size_t)size) == size &&
                   read(ends[0], bytes, (size_t)size) == size;
    close(ends[0]);
    close(ends[1]);
    if (!is_there) {
        Py_RETURN_NONE;
    }
    return PyBytes_FromStringAndSize(bytes, size);
}
