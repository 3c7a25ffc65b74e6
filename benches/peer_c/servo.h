/* See servo.c. */
#ifndef PEER_SERVO_H
#define PEER_SERVO_H

#include "laws.h"
#include <stdint.h>

/* Input of a period, from the host: a position in 2^-16 counts, rad/s, rad/s^2. */
typedef struct { int32_t position; float velocity, acceleration; } peer_target;
/* Radians of a part of a count, the two factors of (5), the converter's voltage of code 0, its codes per volt and
 * its highest code. */
typedef struct { float radians, keep, scale, lowest, per_volt; uint32_t top; } peer_channel;
/* Error of the sample before, the error's rate, offset of a bumpless start. */
typedef struct { int32_t error; float rate, offset; } peer_memory;

typedef struct { peer_channel channel; peer_memory memory; peer_target target; peer_pd_law law; } peer_pd_axis;
typedef struct { peer_channel channel; peer_memory memory; peer_target target; peer_ctc_law law; } peer_ctc_axis;
typedef struct { peer_channel channel; peer_memory memory; peer_target target; peer_smc_law law; } peer_smc_axis;
typedef struct { peer_channel channel; peer_memory memory; peer_target target; peer_pid_law law; peer_pid_memory of_law; } peer_pid_axis;

uint16_t peer_servo_pd(peer_pd_axis *a, int32_t counts);
uint16_t peer_servo_ctc(peer_ctc_axis *a, int32_t counts);
uint16_t peer_servo_smc(peer_smc_axis *a, int32_t counts);
uint16_t peer_servo_pid(peer_pid_axis *a, int32_t counts);

#endif
