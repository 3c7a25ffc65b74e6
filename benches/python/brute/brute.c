/* The job by brute force, as somebody writes it in C for speed: many gains side by side in vectors, RK4 with ten steps a
 * sample, no branch but where all runs of a group go one way. Compiled where it runs, for AVX-512 or AVX2. */

#include "../vectors.h"

/* Vectors of a group, whose steps hide each other's latency. */
enum { GROUP = 2, SIDE = GROUP * WIDTH, STEPS = 10 };

/* e to the power of x, for x up to 0; 0 below -700. */
static inline vector falling(vector x)
{
    x = FEW(max_pd)(x, splat(-700.0));
    const vector magic = splat(6755399441055744.0); /* 1.5 * 2^52 */
    vector shifted = x * splat(1.4426950408889634) + magic;
    vector r = x - (shifted - magic) * splat(0.6931471805599453);
    vector p = splat(1.0 / 3628800.0);
    p = p * r + splat(1.0 / 362880.0);
    p = p * r + splat(1.0 / 40320.0);
    p = p * r + splat(1.0 / 5040.0);
    p = p * r + splat(1.0 / 720.0);
    p = p * r + splat(1.0 / 120.0);
    p = p * r + splat(1.0 / 24.0);
    p = p * r + splat(1.0 / 6.0);
    p = p * r + splat(0.5);
    p = p * r + splat(1.0);
    p = p * r + splat(1.0);
    return (vector)FEW(add_epi64)((integers)p, FEW(slli_epi64)((integers)shifted, 52));
}

static inline vector acceleration(const job *j, vector w, vector brake)
{
    vector falls = falling(magnitude(w) * splat(-1.0 / j->v_s));
    vector friction = (splat(j->mu_d) + splat(j->mu_s - j->mu_d) * falls) * brake;
    return (splat(j->drive) - friction - splat(j->damping) * w) * splat(1.0 / j->inertia);
}

/* State and figures of the runs in a vector. */
typedef struct {
    vector kp, kd, position, velocity, last, error_rate, brake;
    vector squares, worst, sticks;
    mask stuck, holds, moves;
} runs;

static inline void sample(const job *j, runs *r, double now, int counts)
{
    const vector target = splat(now);
    if (counts) {
        vector e = target - r->position;
        r->squares += e * e;
        r->worst = FEW(max_pd)(r->worst, magnitude(e));
    }
    vector error = target - floored(r->position * splat(j->counts_per_radian)) * splat(1.0 / j->counts_per_radian);
    r->error_rate = splat(1.0 - j->smoothing) * r->error_rate + splat(j->smoothing / j->period) * (error - r->last);
    r->last = error;
    vector volts = -(r->kp * error + r->kd * r->error_rate);
    volts = FEW(min_pd)(FEW(max_pd)(volts, splat(j->lowest)), splat(j->highest));
    r->brake = splat(j->gain) * volts;
    r->holds = without(all(), less(splat(j->mu_s) * r->brake, splat(j->drive)));
    r->stuck = both(r->stuck, r->holds);
    r->moves = without(all(), r->stuck);
}

static inline void step(const job *j, runs *r, int counts)
{
    const double h = j->period / STEPS;
    vector w = r->velocity;
    vector a1 = acceleration(j, w, r->brake);
    vector w2 = w + splat(0.5 * h) * a1;
    vector a2 = acceleration(j, w2, r->brake);
    vector w3 = w + splat(0.5 * h) * a2;
    vector a3 = acceleration(j, w3, r->brake);
    vector w4 = w + splat(h) * a3;
    vector a4 = acceleration(j, w4, r->brake);
    vector after = w + splat(h / 6.0) * (a1 + splat(2.0) * (a2 + a3) + a4);
    vector way = splat(h / 6.0) * (w + splat(2.0) * (w2 + w3) + w4);
    mask stops = both(less(after, splat(0.0)), r->moves);
    if (any(stops)) {
        /* The instant by a straight line, the way up to it by the mean. */
        way = chosen(stops, splat(0.5 * h) * w * w / (w - after), way);
        after = chosen(stops, splat(0.0), after);
    }
    r->position = chosen(r->moves, r->position + way, r->position);
    r->velocity = chosen(r->moves, after, w);
    mask sticking = both(stops, r->holds);
    if (counts)
        r->sticks += chosen(sticking, splat(1.0), splat(0.0));
    r->stuck = either(r->stuck, sticking);
    r->moves = without(r->moves, sticking);
}

/* n pairs of gains, a multiple of SIDE; root mean square, largest and sticks of each go to out. */
void sweep(const job *on, int64_t n, const double *kp, const double *kd, double *out)
{
    const job copy = *on, *j = &copy; /* nothing that is written lies in it */
    for (int64_t i = 0; i < n; i += SIDE) {
        runs all_runs[GROUP] = {0};
        for (int g = 0; g < GROUP; g++) {
            all_runs[g].kp = FEW(loadu_pd)(kp + i + g * WIDTH);
            all_runs[g].kd = FEW(loadu_pd)(kd + i + g * WIDTH);
            all_runs[g].stuck = all();
        }
        for (int64_t k = 0; k < j->ticks; k++) {
            const double now = j->rate * ((double)k * j->period);
            const int counts = k >= j->settled;
            for (int g = 0; g < GROUP; g++)
                sample(j, &all_runs[g], now, counts);
            for (int s = 0; s < STEPS; s++)
                for (int g = 0; g < GROUP; g++)
                    if (any(all_runs[g].moves))
                        step(j, &all_runs[g], counts);
        }
        for (int g = 0; g < GROUP; g++)
            for (int l = 0; l < WIDTH; l++) {
                double *of = out + 3 * (i + g * WIDTH + l);
                of[0] = sqrt(all_runs[g].squares[l] / (double)(j->ticks - j->settled));
                of[1] = all_runs[g].worst[l];
                of[2] = all_runs[g].sticks[l];
            }
    }
}
