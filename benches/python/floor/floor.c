/* The floor of a law's step called from Python: the least cost of CPython's own C API for the same arguments.
 *
 * A C type with a METH_FASTCALL method: a whole number of counts and a target in, PD (4) with (5) and its limits,
 * a float out. No checks beyond those without which it would crash. */

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <structmember.h>

typedef struct {
    PyObject_HEAD
    double position_counts, velocity_rad_s, acceleration_rad_s2;
} Target;

static int Target_init(Target *self, PyObject *args, PyObject *kwargs)
{
    static char *names[] = {"position_counts", "velocity_rad_s", "acceleration_rad_s2", NULL};
    return PyArg_ParseTupleAndKeywords(args, kwargs, "d|dd", names, &self->position_counts,
                                       &self->velocity_rad_s, &self->acceleration_rad_s2) ? 0 : -1;
}

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
    .tp_init = (initproc)Target_init,
    .tp_members = Target_members,
};

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
    if (n != 2 || !Py_IS_TYPE(args[1], &TargetType)) {
        PyErr_SetString(PyExc_TypeError, "step(counts, target)");
        return NULL;
    }
    long counts = PyLong_AsLong(args[0]);
    if (counts == -1 && PyErr_Occurred())
        return NULL;
    const Target *target = (const Target *)args[1];
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

static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, .m_name = "floor", .m_size = -1};

PyMODINIT_FUNC PyInit_floor(void)
{
    PyObject *m = PyModule_Create(&module);
    if (!m || PyModule_AddType(m, &TargetType) < 0 || PyModule_AddType(m, &LawType) < 0)
        return NULL;
    return m;
}
