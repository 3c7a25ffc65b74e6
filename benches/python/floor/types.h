/* What both floors give Python: a target, and a servo's parameters. Python.h comes before. */

#include "servo.h"

typedef struct {
    PyObject_HEAD
    double position_counts, velocity_rad_s, acceleration_rad_s2;
} Target;

static int Target_init(PyObject *of, PyObject *args, PyObject *kwargs)
{
    static char *names[] = {"position_counts", "velocity_rad_s", "acceleration_rad_s2", NULL};
    Target *self = (Target *)of;
    return PyArg_ParseTupleAndKeywords(args, kwargs, "d|dd", names, &self->position_counts,
                                       &self->velocity_rad_s, &self->acceleration_rad_s2) ? 0 : -1;
}

typedef struct {
    PyObject_HEAD
    servo servo;
} Servo;

static int Servo_init(PyObject *of, PyObject *args, PyObject *kwargs)
{
    static char *names[] = {"kp", "kd", "smoothing", "period", "radians_per_count", "lowest", "highest", NULL};
    double kp, kd, smoothing, period, radians_per_count, lowest, highest;
    if (!PyArg_ParseTupleAndKeywords(args, kwargs, "ddddddd", names, &kp, &kd, &smoothing, &period, &radians_per_count,
                                     &lowest, &highest))
        return -1;
    ((Servo *)of)->servo = servo_of(kp, kd, smoothing, period, radians_per_count, lowest, highest);
    return 0;
}
