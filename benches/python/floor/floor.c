/* The floor of a law's step called from Python: the least cost of CPython's own C API for the same arguments.
 *
 * C types with a METH_FASTCALL method: a whole number of counts and a target in, a float out. `Law` is PD (4) with (5)
 * and its limits alone, `Servo` all of servo.h. No checks beyond those without which it would crash. */

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <structmember.h>

#include "types.h"

static PyMemberDef Target_members[] = {
    {"position_counts", T_DOUBLE, offsetof(Target, position_counts), READONLY, NULL},
    {"velocity_rad_s", T_DOUBLE, offsetof(Target, velocity_rad_s), READONLY, NULL},
    {"acceleration_rad_s2", T_DOUBLE, offsetof(Target, acceleration_rad_s2), READONLY, NULL},
    {NULL},
};

static PyTypeObject TargetType = {
    PyVarObject_HEAD_INIT(NULL, 0)
    .tp_name = "floor.Target",
    .tp_basicsize = sizeof(Target),
    .tp_flags = Py_TPFLAGS_DEFAULT,
    .tp_new = PyType_GenericNew,
    .tp_init = Target_init,
    .tp_members = Target_members,
};

/* The arguments of a step; NULL, with an exception, if they are others. */
static inline const Target *arguments(PyObject *const *args, Py_ssize_t n, long *counts)
{
    if (n != 2 || !Py_IS_TYPE(args[1], &TargetType)) {
        PyErr_SetString(PyExc_TypeError, "step(counts, target)");
        return NULL;
    }
    *counts = PyLong_AsLong(args[0]);
    return *counts == -1 && PyErr_Occurred() ? NULL : (const Target *)args[1];
}

typedef struct {
    PyObject_HEAD
    double kp, kd, smoothing, period, radians_per_count, lowest, highest;
    double last, rate;
} Law;

static int Law_init(Law *self, PyObject *args, PyObject *kwargs)
{
    static char *names[] = {"kp", "kd", "smoothing", "period", "radians_per_count", "lowest", "highest", NULL};
    self->last = self->rate = 0.0;
    return PyArg_ParseTupleAndKeywords(args, kwargs, "ddddddd", names, &self->kp, &self->kd, &self->smoothing,
                                       &self->period, &self->radians_per_count, &self->lowest,
                                       &self->highest) ? 0 : -1;
}

static PyObject *Law_step(Law *self, PyObject *const *args, Py_ssize_t n)
{
    long counts;
    const Target *target = arguments(args, n, &counts);
    if (!target)
        return NULL;
    double error = (target->position_counts - (double)counts) * self->radians_per_count;
    self->rate = (1.0 - self->smoothing) * self->rate + self->smoothing * (error - self->last) / self->period;
    self->last = error;
    double volts = -(self->kp * error + self->kd * self->rate);
    volts = volts < self->lowest ? self->lowest : volts > self->highest ? self->highest : volts;
    return PyFloat_FromDouble(volts);
}

static PyMethodDef Law_methods[] = {
    {"step", (PyCFunction)(void (*)(void))Law_step, METH_FASTCALL, NULL},
    {NULL},
};

static PyTypeObject LawType = {
    PyVarObject_HEAD_INIT(NULL, 0)
    .tp_name = "floor.Law",
    .tp_basicsize = sizeof(Law),
    .tp_flags = Py_TPFLAGS_DEFAULT,
    .tp_new = PyType_GenericNew,
    .tp_init = (initproc)Law_init,
    .tp_methods = Law_methods,
};

static PyObject *Servo_step(Servo *self, PyObject *const *args, Py_ssize_t n)
{
    long counts;
    const Target *target = arguments(args, n, &counts);
    return target ? PyFloat_FromDouble(servo_step(&self->servo, (int32_t)counts, target->position_counts)) : NULL;
}

static PyMethodDef Servo_methods[] = {
    {"step", (PyCFunction)(void (*)(void))Servo_step, METH_FASTCALL, NULL},
    {NULL},
};

static PyTypeObject ServoType = {
    PyVarObject_HEAD_INIT(NULL, 0)
    .tp_name = "floor.Servo",
    .tp_basicsize = sizeof(Servo),
    .tp_flags = Py_TPFLAGS_DEFAULT,
    .tp_new = PyType_GenericNew,
    .tp_init = Servo_init,
    .tp_methods = Servo_methods,
};

static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, .m_name = "floor", .m_size = -1};

PyMODINIT_FUNC PyInit_floor(void)
{
    PyObject *m = PyModule_Create(&module);
    if (!m || PyModule_AddType(m, &TargetType) < 0 || PyModule_AddType(m, &LawType) < 0
        || PyModule_AddType(m, &ServoType) < 0)
        return NULL;
    return m;
}
