/* The paper's shaft: a weight drives it forwards, a brake holds it back. For the examples, which have no machine.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#ifndef SHAFT_H
#define SHAFT_H

#include <stdint.h>

typedef struct {
    double angle; /* rad */
    double speed; /* rad/s */
    double volts; /* at the brake */
} shaft_t;

/* At power-up the brake is on. */
#define SHAFT_AT_REST {0.0, 0.0, 4.502}

/* Counts of its encoder. */
static inline int32_t shaft_counts(const shaft_t *shaft, int32_t counts_per_rev)
{
    const double counts = shaft->angle * counts_per_rev / 6.283185307179586;
    return (int32_t)counts - (counts < (double)(int32_t)counts);
}

/* Its converter: 12 bit over +-10 V. */
static inline void shaft_convert(shaft_t *shaft, uint16_t code)
{
    shaft->volts = -10.0 + 20.0 * code / 4096.0;
}

/* A microsecond of its motion: friction holds it, or Coulomb friction brakes it. */
static inline void shaft_move(shaft_t *shaft)
{
    const double push = shaft->volts > 0.0 ? 0.14 * shaft->volts : 0.0;
    const double drive = 0.047088 - 0.001 * shaft->speed;
    const double friction = (shaft->speed > 0.0 ? 0.15 : 0.2) * push;
    if (shaft->speed <= 0.0 && drive <= friction) {
        shaft->speed = 0.0;
        return;
    }
    shaft->speed += 1e-6 * (drive - friction) / 0.0017;
    shaft->angle += 1e-6 * shaft->speed;
}

#endif
