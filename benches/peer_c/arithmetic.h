/* The laws' arithmetic; see laws.c. */
#ifndef PEER_ARITHMETIC_H
#define PEER_ARITHMETIC_H

#include "laws.h"

static inline float output(const peer_output *o, float *offset, float demand)
{
    demand += *offset;
    *offset *= o->decay;
    if (demand >= o->lowest)
        return demand <= o->highest ? demand : o->highest;
    return demand < o->lowest ? o->lowest : o->on_invalid;
}

static inline float sat(float x)
{
    if (x > -1.0f)
        return x < 1.0f ? x : 1.0f;
    return x <= -1.0f ? -1.0f : 0.0f;
}

static inline float sgn(float x)
{
    return x > 0.0f ? 1.0f : x < 0.0f ? -1.0f : 0.0f;
}

/* e to the power of x, for x up to 0: 2^n times a polynomial for |r| <= ln 2 / 2; 0 below -87. */
static inline float exp_negative(float x)
{
    if (!(x > -87.0f))
        return 0.0f;
    int n = (int)(x * 1.44269504f - 0.5f);
    float r = x - (float)n * 0.693147181f;
    float p = 1.0f + r * (1.0f + r * (0.5f + r * (0.166666667f + r * (0.0416666667f + r * 0.00833333333f))));
    union { int i; float f; } scale = { (n + 127) << 23 };
    return p * scale.f;
}

static inline float pd(const peer_pd_law *l, float *offset, const peer_tick *t)
{
    return output(&l->output, offset, -(l->kp * t->error) - l->kd * t->error_rate);
}

static inline float ctc(const peer_ctc_law *l, float *offset, const peer_tick *t)
{
    float velocity = t->target_velocity - t->error_rate;
    float speed = velocity < 0.0f ? -velocity : velocity;
    float mu = l->mu_dynamic + (l->mu_static - l->mu_dynamic) * exp_negative(-(speed * l->inverse_velocity));
    float tau = -(l->gain * (l->kp * t->error + l->kd * t->error_rate));
    float torque = l->drive_torque - l->inertia * (t->target_acceleration - tau) - l->damping * velocity;
    return output(&l->output, offset, torque / (mu * l->brake_gain));
}

static inline float smc(const peer_smc_law *l, float *offset, const peer_tick *t)
{
    float surface = l->slope * t->error + t->error_rate;
    float across = surface * t->error_rate;
    float hold = l->kp * sat(surface * l->inverse_boundary);
    float damp = l->kd * sat(across * l->inverse_boundary) * t->error_rate;
    return output(&l->output, offset, -hold - damp);
}

static inline float smc_sign(const peer_smc_law *l, float *offset, const peer_tick *t)
{
    float surface = l->slope * t->error + t->error_rate;
    float across = surface * t->error_rate;
    return output(&l->output, offset, -(l->kp * sgn(surface)) - l->kd * sgn(across) * t->error_rate);
}

/* The integral follows a limit, and keeps within what the output can answer. A demand that is no number leaves it as it is. */
static inline float pid(const peer_pid_law *l, peer_pid_memory *m, const peer_tick *t)
{
    float forward = l->bias - l->coulomb * sgn(t->target_velocity) - l->velocity * t->target_velocity
        - l->acceleration * t->target_acceleration;
    float rate = m->rate + l->newest * (t->error_rate - m->rate);
    float integral = m->integral - l->ki_step * t->error;
    float demand = integral - l->kp * t->error - l->kd * rate + forward;
    float volts = output(&l->output, &m->offset, demand);
    if (volts <= l->output.lowest || volts >= l->output.highest)
        integral += l->tracking * (volts - demand);
    float low = l->output.lowest - forward, high = l->output.highest - forward;
    if (integral >= low && integral <= high)
        m->integral = integral;
    else if (integral < low && integral >= -1e30f)
        m->integral = low;
    else if (integral > high && integral <= 1e30f)
        m->integral = high;
    m->rate = rate >= -1e3f && rate <= 1e3f ? rate : 0.0f;
    return volts;
}

#endif
