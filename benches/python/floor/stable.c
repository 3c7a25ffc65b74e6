/* The floor of a servo's step under Python's stable ABI, which a wheel for all versions has, with the arguments and the
 * checks of clutch.Servo.step: by place or by name, a number of any kind that is whole and within 32 bits, a target. */

#define Py_LIMITED_API 0x030b0000 /* Python 3.11, as the wheel */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include "types.h"

static PyType_Slot Target_slots[] = {{Py_tp_init, Target_init}, {0, NULL}};
static PyType_Spec Target_spec = {"stable.Target", sizeof(Target), 0, Py_TPFLAGS_DEFAULT, Target_slots};
static PyTypeObject *TargetType;

/* The arguments where some have names; 0, with an exception, if they are others than counts and target. */
static int named(PyObject *const *args, Py_ssize_t n, PyObject *names, PyObject **given)
{
    static const char *const expected[2] = {"counts", "target"};
    Py_ssize_t all = n + (names ? PyTuple_Size(names) : 0);
    for (Py_ssize_t i = 0; i < all && all == 2; i++) {
        Py_ssize_t at = i;
        if (i >= n) {
            PyObject *name = PyTuple_GetItem(names, i - n);
            at = PyUnicode_CompareWithASCIIString(name, expected[0]) == 0   ? 0
                 : PyUnicode_CompareWithASCIIString(name, expected[1]) == 0 ? 1
                                                                            : 2;
        }
        if (at > 1 || given[at])
            break;
        given[at] = args[i];
    }
    if (given[0] && given[1])
        return 1;
    PyErr_SetString(PyExc_TypeError, "step(counts, target)");
    return 0;
}

static PyObject *Servo_step(PyObject *self, PyObject *const *args, Py_ssize_t n, PyObject *names)
{
    PyObject *given[2] = {NULL, NULL};
    if (n == 2 && !names) {
        given[0] = args[0];
        given[1] = args[1];
    } else if (!named(args, n, names, given)) {
        return NULL;
    }
    double counts = Py_IS_TYPE(given[0], &PyLong_Type) ? (double)PyLong_AsLong(given[0]) : PyFloat_AsDouble(given[0]);
    if (counts == -1.0 && PyErr_Occurred())
        return NULL;
    if (!(counts >= INT32_MIN && counts <= INT32_MAX && (double)(int32_t)counts == counts)) {
        PyErr_SetString(PyExc_ValueError, "expected a whole number of counts within 32 bit");
        return NULL;
    }
    if (!Py_IS_TYPE(given[1], TargetType) && !PyType_IsSubtype(Py_TYPE(given[1]), TargetType)) {
        PyErr_SetString(PyExc_TypeError, "expected a Target");
        return NULL;
    }
    double target = ((Target *)given[1])->position_counts;
    return PyFloat_FromDouble(servo_step(&((Servo *)self)->servo, (int32_t)counts, target));
}

static PyMethodDef Servo_methods[] = {
    {"step", (PyCFunction)(void (*)(void))Servo_step, METH_FASTCALL | METH_KEYWORDS, NULL},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot Servo_slots[] = {{Py_tp_init, Servo_init}, {Py_tp_methods, Servo_methods}, {0, NULL}};
static PyType_Spec Servo_spec = {"stable.Servo", sizeof(Servo), 0, Py_TPFLAGS_DEFAULT, Servo_slots};

static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, .m_name = "stable", .m_size = -1};

PyMODINIT_FUNC PyInit_stable(void)
{
    PyObject *m = PyModule_Create(&module);
    TargetType = (PyTypeObject *)PyType_FromSpec(&Target_spec);
    PyTypeObject *servo_type = (PyTypeObject *)PyType_FromSpec(&Servo_spec);
    if (!m || !TargetType || !servo_type || PyModule_AddType(m, TargetType) < 0
        || PyModule_AddType(m, servo_type) < 0)
        return NULL;
    return m;
}
