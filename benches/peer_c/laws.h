/* See laws.c. */
#ifndef PEER_LAWS_H
#define PEER_LAWS_H

typedef struct { float error, error_rate, target_velocity, target_acceleration; } peer_tick;
typedef struct { float lowest, highest, on_invalid, decay; } peer_output;
typedef struct { float kp, kd; peer_output output; } peer_pd_law;
typedef struct {
    float gain, kp, kd, inertia, drive_torque, damping, brake_gain;
    float mu_static, mu_dynamic, inverse_velocity;
    peer_output output;
} peer_ctc_law;
typedef struct { float kp, kd, slope, inverse_boundary; peer_output output; } peer_smc_law;

typedef struct {
    float kp, ki_step, kd, newest, tracking, bias, coulomb, velocity, acceleration;
    peer_output output;
} peer_pid_law;
/* Offset of a bumpless start, integral in volts, filtered error rate. */
typedef struct { float offset, integral, rate; } peer_pid_memory;

float peer_pd(const peer_pd_law *l, float *offset, const peer_tick *t);
float peer_ctc(const peer_ctc_law *l, float *offset, const peer_tick *t);
float peer_smc(const peer_smc_law *l, float *offset, const peer_tick *t);
float peer_smc_sign(const peer_smc_law *l, float *offset, const peer_tick *t);
float peer_pid(const peer_pid_law *l, peer_pid_memory *m, const peer_tick *t);

#endif
