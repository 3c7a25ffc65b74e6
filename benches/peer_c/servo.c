/* The servo as somebody writes it in C for one board and one law: encoder counts in, the converter's code out, with
 * the error's rate (5), the law, the limits and the rounding to a code between. The error is a difference of 32 bits
 * in 2^-16 counts, right across the wrap of the counter while the shaft is within 32 767 counts of its path. */
#include "servo.h"
#include "arithmetic.h"

static inline peer_tick measured(const peer_channel *c, peer_memory *m, const peer_target *t, int32_t counts)
{
    int32_t error = (int32_t)((uint32_t)t->position - ((uint32_t)counts << 16));
    int32_t moved = (int32_t)((uint32_t)error - (uint32_t)m->error);
    m->error = error;
    m->rate = c->keep * m->rate + c->scale * (float)moved;
    return (peer_tick){ c->radians * (float)error, m->rate, t->velocity, t->acceleration };
}

/* The limits of the output are within the converter's range, of which the highest code is a step short. */
static inline uint16_t coded(const peer_channel *c, float volts)
{
    uint32_t code = (uint32_t)((volts - c->lowest) * c->per_volt + 0.5f);
    return (uint16_t)(code < c->top ? code : c->top);
}

uint16_t peer_servo_pd(peer_pd_axis *a, int32_t counts)
{
    peer_tick tick = measured(&a->channel, &a->memory, &a->target, counts);
    return coded(&a->channel, pd(&a->law, &a->memory.offset, &tick));
}

uint16_t peer_servo_ctc(peer_ctc_axis *a, int32_t counts)
{
    peer_tick tick = measured(&a->channel, &a->memory, &a->target, counts);
    return coded(&a->channel, ctc(&a->law, &a->memory.offset, &tick));
}

uint16_t peer_servo_smc(peer_smc_axis *a, int32_t counts)
{
    peer_tick tick = measured(&a->channel, &a->memory, &a->target, counts);
    return coded(&a->channel, smc(&a->law, &a->memory.offset, &tick));
}

uint16_t peer_servo_pid(peer_pid_axis *a, int32_t counts)
{
    peer_tick tick = measured(&a->channel, &a->memory, &a->target, counts);
    return coded(&a->channel, pid(&a->law, &a->of_law, &tick));
}
