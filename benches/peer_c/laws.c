/* The laws as somebody writes them in C for one board: no types, no terms for a log, no
 * choice of a friction exponent, an exponential that is as good as single precision needs and that
 * knows nothing of subnormal numbers. Limits and the voltage for a demand that is not a number are
 * there, as in the Rust version, and so is the offset of a bumpless start. */
#include "arithmetic.h"

float peer_pd(const peer_pd_law *l, float *offset, const peer_tick *t)
{
    return pd(l, offset, t);
}

float peer_ctc(const peer_ctc_law *l, float *offset, const peer_tick *t)
{
    return ctc(l, offset, t);
}

float peer_smc(const peer_smc_law *l, float *offset, const peer_tick *t)
{
    return smc(l, offset, t);
}

float peer_smc_sign(const peer_smc_law *l, float *offset, const peer_tick *t)
{
    return smc_sign(l, offset, t);
}

float peer_pid(const peer_pid_law *l, peer_pid_memory *m, const peer_tick *t)
{
    return pid(l, m, t);
}
