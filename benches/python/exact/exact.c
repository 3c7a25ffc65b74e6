/* The job by its exact flow, as somebody writes it in C for speed: many gains side by side in vectors. Compiled where
 * it runs, for AVX-512 or AVX2.
 *
 * Speed s in units of v_s, time in samples, way in both: s' = a - g s - k e^(-s). The equation has one unknown and no
 * time in it, so t = integral of ds/f and way = integral of s ds/f, without a step and without a root: a stop is at
 * s = 0. Three kinds of motion, each in a queue of its own, so that its vectors are full:
 *
 *   sample  far above the layer of Stribeck's term, e^(-s) is nothing and the flow linear: in place
 *   above   a little above it, the term to second order along the linear flow; or down to the layer by this
 *   within  the two integrals by eight Gauss points from s to where the flow with the drag of its start ends, which
 *           the drag's change misses by a little, and that little by a Taylor series. What a bound does not hold of,
 *           is taken in shorter pieces.
 */

#include "../vectors.h"

#include <string.h>

enum { BLOCK = 512, ROOM = BLOCK + WIDTH, POINTS = 8 };

static const double FAR = 28.0;    /* s from which on k e^(-s) is below 1e-10 */
static const double TOP = 5.0;     /* s at which a motion that falls into the layer is taken over */
static const double SPAN = 18.0;   /* change of s that eight points see all of */
static const double LITTLE = 0.01; /* part of e^s that Stribeck's term takes away above the layer, at most */
static const double GIVEN = 1e-5;  /* bound of what eight points leave of s; errors that were found are a fifth of it */

/* Runs side by side. The places past BLOCK are for what fills up a vector. */
typedef struct {
    double kp[ROOM], kd[ROOM], position[ROOM], speed[ROOM], last[ROOM], error_rate[ROOM];
    double squares[ROOM], worst[ROOM], sticks[ROOM];
} block;

/* Motions that wait: from a speed, the numbers of their equation, the time that is left, the way up to now, how far s
 * may change at once, and of which run. */
typedef struct {
    int64_t n;
    double speed[ROOM], a[ROOM], k[ROOM], left[ROOM], way[ROOM], reach[ROOM];
    int64_t run[ROOM];
} queue;

typedef struct {
    vector speed, a, k, left, way, reach;
    integers run;
} motions;

/* The job's numbers in these units. */
typedef struct {
    double g, p, q;      /* drag; the linear flow over a sample: s + p f, way s + q f */
    double drive, slips, sticks; /* a = drive - slips volts, k = sticks volts */
    double unit;         /* rad of a way */
} flow;

#if defined(__AVX512F__)
static inline vector packed(mask m, vector x) { return _mm512_maskz_compress_pd(m, x); }
static inline unsigned bits(mask m) { return m; }
static inline vector gathered(const double *from, integers at) { return _mm512_i64gather_pd(at, from, 8); }
static inline void scatter(double *to, mask m, integers at, vector x) { _mm512_mask_i64scatter_pd(to, m, at, x, 8); }
#else
static inline unsigned bits(mask m) { return (unsigned)_mm256_movemask_pd(m); }
static inline vector packed(mask m, vector x)
{
#define L(i) 2 * i, 2 * i + 1
    static const int32_t order[16][8] = {
        {0}, {L(0)}, {L(1)}, {L(0), L(1)}, {L(2)}, {L(0), L(2)}, {L(1), L(2)}, {L(0), L(1), L(2)},
        {L(3)}, {L(0), L(3)}, {L(1), L(3)}, {L(0), L(1), L(3)}, {L(2), L(3)}, {L(0), L(2), L(3)}, {L(1), L(2), L(3)},
        {L(0), L(1), L(2), L(3)},
    };
#undef L
    __m256i places = _mm256_loadu_si256((const __m256i *)order[bits(m)]);
    return (vector)_mm256_permutevar8x32_epi32((integers)x, places);
}
static inline vector gathered(const double *from, integers at) { return _mm256_i64gather_pd(from, at, 8); }
static inline void scatter(double *to, mask m, integers at, vector x)
{
    for (unsigned b = bits(m); b; b &= b - 1) {
        int l = __builtin_ctz(b);
        to[at[l]] = x[l];
    }
}
#endif

static inline vector load(const double *from) { return FEW(loadu_pd)(from); }
static inline void store(double *to, vector x) { FEW(storeu_pd)(to, x); }
static inline vector most(vector a, vector b) { return FEW(max_pd)(a, b); }
static inline vector least(vector a, vector b) { return FEW(min_pd)(a, b); }

static inline motions taken(const queue *from, int64_t i)
{
    return (motions){load(from->speed + i), load(from->a + i),   load(from->k + i),
                     load(from->left + i),  load(from->way + i), load(from->reach + i),
                     (integers)load((const double *)(from->run + i))};
}

static inline void push(queue *to, mask m, motions of)
{
    int64_t n = to->n;
    store(to->speed + n, packed(m, of.speed));
    store(to->a + n, packed(m, of.a));
    store(to->k + n, packed(m, of.k));
    store(to->left + n, packed(m, of.left));
    store(to->way + n, packed(m, of.way));
    store(to->reach + n, packed(m, of.reach));
    store((double *)(to->run + n), packed(m, (vector)of.run));
    to->n = n + __builtin_popcount(bits(m));
}

/* Fills up the last vector with motions that end nowhere. */
static inline void fill(queue *of)
{
    for (int l = 0; l < WIDTH; l++) {
        int64_t i = of->n + l;
        of->speed[i] = TOP, of->a[i] = 0.0, of->k[i] = 1.0;
        of->left[i] = 1.0, of->way[i] = 0.0, of->reach[i] = SPAN, of->run[i] = BLOCK + l;
    }
}

static const int64_t numbers[8] = {0, 1, 2, 3, 4, 5, 6, 7};

static const double MAGIC = 6755399441055744.0; /* 1.5 * 2^52: a double plus this has its nearest integer in the last bits */

#if defined(__AVX512F__)
/* e to the power of x, to 3e-12 of it: sixteenths of a doubling from a table, the rest by a polynomial. */
static inline vector power(vector x)
{
    /* 2^(i/16), less i sixteenths of a step of the exponent, which come back with the whole number. */
    static const int64_t sixteenth[16] = {
        0x3ff0000000000000, 0x3fefb5586cf9890f, 0x3fef72b83c7d517b, 0x3fef387a6e756238,
        0x3fef06fe0a31b715, 0x3feedea64c123422, 0x3feebfdad5362a27, 0x3feeab07dd485429,
        0x3feea09e667f3bcd, 0x3feea11473eb0187, 0x3feeace5422aa0db, 0x3feec49182a3f090,
        0x3feee89f995ad3ad, 0x3fef199bdd85529c, 0x3fef5818dcfba487, 0x3fefa4afa2a490da,
    };
    const vector low = load((const double *)sixteenth), high = load((const double *)(sixteenth + 8));
    vector shifted = x * splat(16.0 * M_LOG2E) + splat(MAGIC);
    vector r = x - (shifted - splat(MAGIC)) * splat(M_LN2 / 16.0);
    integers n = (integers)shifted;
    vector scale = (vector)((integers)_mm512_permutex2var_pd(low, n, high) + _mm512_slli_epi64(n, 48));
    vector p = splat(0.04166715541181744);
    p = p * r + splat(0.16666959914371368);
    p = p * r + splat(0.5);
    p = p * r + splat(1.0);
    p = p * r + splat(1.0);
    return p * scale;
}

/* 1/x, to 3e-13 of it. */
static inline vector inverse(vector x)
{
    vector r = _mm512_rcp14_pd(x), e = splat(1.0) - x * r;
    return r + r * (e * e + e);
}
#else
static inline vector power(vector x)
{
    vector shifted = x * splat(M_LOG2E) + splat(MAGIC);
    vector r = x - (shifted - splat(MAGIC)) * splat(M_LN2);
    vector p = splat(2.4859578222625295e-05);
    p = p * r + splat(0.0001989927395864936);
    p = p * r + splat(0.001388885404961482);
    p = p * r + splat(0.008333298483754886);
    p = p * r + splat(0.041666666718980845);
    p = p * r + splat(0.16666666718997508);
    p = p * r + splat(0.5);
    p = p * r + splat(1.0);
    p = p * r + splat(1.0);
    return (vector)((integers)p + _mm256_slli_epi64((integers)shifted, 52));
}

static inline vector inverse(vector x) { return splat(1.0) / x; }
#endif

static inline integers whole(int64_t x) { return (integers){0} + x; }

/* log(1 + u), to 1e-10 of it. */
static inline vector logarithm(vector u)
{
    union { double of; int64_t bits; } root = {M_SQRT1_2}, one = {1.0};
    const integers from = whole(root.bits), fraction = whole((INT64_C(1) << 52) - 1);
    integers above_root = (integers)(u + splat(1.0)) - from;
    vector m = (vector)((above_root & fraction) + from);
    integers exponent = FEW(srli_epi64)(above_root + whole(one.bits), 52);
    union { int64_t bits; double of; } two52 = {INT64_C(0x4330000000000000)};
    vector doublings = (vector)(exponent | whole(two52.bits)) - splat(two52.of + 1023.0);
    mask little = both(less(splat(-0.29), u), less(u, splat(0.41)));
    vector r = chosen(little, u, m - splat(1.0));
    vector x = r * inverse(r + splat(2.0)), z = x * x;
    vector p = splat(2.0 / 13.0);
    p = p * z + splat(2.0 / 11.0);
    p = p * z + splat(2.0 / 9.0);
    p = p * z + splat(2.0 / 7.0);
    p = p * z + splat(2.0 / 5.0);
    p = p * z + splat(2.0 / 3.0);
    p = p * z + splat(2.0);
    return p * x + doublings * splat(M_LN2);
}

/* Where a motion is at the end of the sample. */
static inline void put(const flow *c, block *b, mask m, integers run, vector speed, vector way)
{
    scatter(b->position, m, run, gathered(b->position, run) + splat(c->unit) * way);
    scatter(b->speed, m, run, speed);
}

/* Motions above the layer: Stribeck's term along the linear flow, to second order. What is not done goes on `within`. */
static inline void above(const flow *c, block *b, queue *from, queue *to)
{
    fill(from);
    for (int64_t i = 0; i < from->n; i += WIDTH) {
        vector s = load(from->speed + i), a = load(from->a + i), k = load(from->k + i);
        integers run = (integers)load((const double *)(from->run + i));
        vector f = a - splat(c->g) * s;
        mask falls = both(less(s + splat(c->p) * f, splat(TOP)), less(splat(TOP), s));
        vector h = chosen(falls, (splat(TOP) - s) / f, splat(1.0));
        vector x = splat(c->g) * h;
        vector even = h * (splat(1.0) - x * (splat(0.5) - x * splat(1.0 / 6.0)));
        vector change = f * even;
        vector way = h * (s + f * h * (splat(0.5) - x * (splat(1.0 / 6.0) - x * splat(1.0 / 24.0))));
        /* The means are as good at a change of 1e-5 as at less, where they lose their digits. */
        vector d = chosen(less(magnitude(change), splat(1e-5)), splat(1e-5), change);
        vector e = inverse(d), y = power(-s), y1 = power(-s - d), mean = (y - y1) * e;
        vector taken = k * even * (mean + splat(c->g) * even * (mean - y1) * e);
        vector part = k * h * e, lost = part * h * (y - mean
                      + splat(0.5) * part * (y * (y - splat(2.0) * mean) + splat(0.5) * mean * (y + y1)));
        vector after = s + change + splat(c->g) * lost
                       - taken * (splat(1.0) + taken * (splat(0.5) + taken * (splat(1.0 / 3.0) + taken * splat(0.25))));
        way -= lost;
        mask small = less(taken, splat(LITTLE)), done = without(small, falls), brought = both(small, falls);
        put(c, b, done, run, after, way);
        mask goes = without(all(), done);
        if (any(goes)) {
            motions rest = {chosen(brought, after, s), a, k, chosen(brought, splat(1.0) - h, splat(1.0)),
                            chosen(brought, way, splat(0.0)), splat(SPAN), run};
            push(to, goes, rest);
        }
    }
}

/* Motions through the layer. What is not done yet waits `again`. */
static inline void within(const flow *c, block *b, queue *from, queue *again, int counts)
{
    static const double at[POINTS] = {
        0.019855071751231884, 0.10166676129318664, 0.2372337950418355, 0.4082826787521751,
        0.591717321247825, 0.7627662049581645, 0.8983332387068134, 0.9801449282487681,
    }, weight[POINTS] = {
        0.05061426814518813, 0.11119051722668724, 0.15685332293894363, 0.181341891689181,
        0.181341891689181, 0.15685332293894363, 0.11119051722668724, 0.05061426814518813,
    }, seventh[POINTS] = {
        -0.11769245644771356, 0.3778969370845921, -0.6317745531190048, 0.7849065579218132,
        -0.7849065579218132, 0.6317745531190048, -0.3778969370845921, 0.11769245644771356,
    };
    fill(from);
    for (int64_t i = 0; i < from->n; i += WIDTH) {
        motions m = taken(from, i);
        vector s = m.speed, a = m.a, k = m.k, left = m.left;
        vector y = power(-s), linear = a - splat(c->g) * s, f = linear - k * y;
        /* Where the flow ends, with the drag of its start, which is never behind: a stop is not missed. */
        vector x = linear * left;
        x = chosen(less(magnitude(x), splat(1e-4)), splat(1e-4), x);
        vector u = (power(x) - splat(1.0)) * f * left * inverse(x);
        mask stops = without(all(), less(y, u + splat(1.0)));
        vector wanted = chosen(stops, -s, logarithm(u));
        vector change = most(least(wanted, m.reach), -m.reach);
        stops = without(stops, either(less(wanted, change), less(change, wanted)));
        /* Where the balance, which no motion passes, is near, its pole of 1/f is taken off and integrated by itself. */
        vector ratio = k * inverse(a);
        vector pole = logarithm(most(ratio, splat(1e-9)) - splat(1.0));
        pole += splat(c->g) * pole * inverse(a);
        vector ye = k * power(-pole), by = inverse(ye - splat(c->g)), off = (a - splat(c->g) * pole - ye) * by;
        pole -= off * (splat(1.0) - splat(0.5) * off);
        mask has = both(less(splat(0.0), a), less(magnitude(s - pole), splat(3.0)));
        vector strength = chosen(has, inverse(a - splat(c->g) * (pole + splat(1.0))), splat(0.0));
        pole = chosen(has, pole, splat(-10.0));
        vector time = splat(0.0), way = splat(0.0), tail = splat(0.0);
#pragma GCC unroll 8
        for (int j = 0; j < POINTS; j++) {
            vector v = s + splat(at[j]) * change, from_pole = v - pole;
            vector rate = a - splat(c->g) * v - k * power(-v);
            vector part = (from_pole - strength * rate) * inverse(rate * from_pole);
            time += splat(weight[j]) * part;
            way += splat(weight[j]) * part * v;
            tail += splat(seventh[j]) * part;
        }
        vector alone = strength * logarithm(change * inverse(s - pole));
        time = time * change + alone;
        way = m.way + (way + strength) * change + pole * alone;
        tail *= change;
        vector end = s + change, ky = k * power(-end), f1 = a - splat(c->g) * end - ky, slope = ky - splat(c->g);
        vector rest = left - time;
        mask good = less(magnitude(f1) * tail * tail, splat(GIVEN) * time);
        mask stopped = without(stops, less(rest, splat(0.0)));
        mask near = less(most(magnitude(f1), magnitude(slope)) * magnitude(rest), splat(0.03));
        mask done = both(good, either(stopped, near));
        vector second = f1 * slope, third = second * slope - ky * f1 * f1;
        vector after = end + rest * (f1 + rest * (splat(0.5) * second + rest * splat(1.0 / 6.0) * third));
        vector last = rest * (end + rest * (splat(0.5) * f1
                      + rest * (splat(1.0 / 6.0) * second + rest * splat(1.0 / 24.0) * third)));
        stopped = either(stopped, less(after, splat(0.0)));
        put(c, b, done, m.run, chosen(stopped, splat(0.0), after), way + chosen(stopped, splat(0.0), last));
        if (counts)
            for (unsigned s = bits(both(done, stopped)); s; s &= s - 1)
                b->sticks[from->run[i + __builtin_ctz(s)]] += 1.0;
        mask goes = without(all(), done);
        if (any(goes)) {
            mask went = both(good, less(splat(0.0), rest));
            motions then = {chosen(went, end, s), a, k, chosen(went, rest, left), chosen(went, way, m.way),
                            chosen(went, splat(SPAN), splat(0.3) * magnitude(change)), m.run};
            push(again, goes, then);
        }
    }
}

static inline void sample(const job *j, const flow *c, block *b, double now, int counts, queue *near)
{
    const vector target = splat(now);
    int64_t n = 0;
    for (int64_t i = 0; i < BLOCK; i += WIDTH) {
        vector position = load(b->position + i), s = load(b->speed + i), last = load(b->last + i);
        if (counts) {
            vector e = target - position;
            store(b->squares + i, load(b->squares + i) + e * e);
            store(b->worst + i, most(load(b->worst + i), magnitude(e)));
        }
        vector error = target - floored(position * splat(j->counts_per_radian)) * splat(1.0 / j->counts_per_radian);
        vector error_rate = splat(1.0 - j->smoothing) * load(b->error_rate + i)
                            + splat(j->smoothing / j->period) * (error - last);
        store(b->error_rate + i, error_rate);
        store(b->last + i, error);
        vector volts = -(load(b->kp + i) * error + load(b->kd + i) * error_rate);
        volts = least(most(volts, splat(j->lowest)), splat(j->highest));
        mask moves = either(less(splat(0.0), s), less(splat(j->mu_s * j->gain) * volts, splat(j->drive)));
        vector a = splat(c->drive) - splat(c->slips) * volts;
        vector f = a - splat(c->g) * s, after = s + splat(c->p) * f, way = s + splat(c->q) * f;
        mask low = both(moves, less(least(s, after), splat(FAR))), high = without(moves, low);
        store(b->position + i, chosen(high, position + splat(c->unit) * way, position));
        store(b->speed + i, chosen(high, after, s));
        if (any(low)) {
            integers run = FEW(add_epi64)(whole(i), (integers)load((const double *)numbers));
            store(near->speed + n, packed(low, s));
            store(near->a + n, packed(low, a));
            store(near->k + n, packed(low, splat(c->sticks) * volts));
            store((double *)(near->run + n), packed(low, (vector)run));
            n += __builtin_popcount(bits(low));
        }
    }
    near->n = n;
}

/* The runs; the position of the first at each sample goes to path, if there is one. */
static void runs(const job *on, int64_t n, const double *kp, const double *kd, double *out, double *path)
{
    const job copy = *on, *j = &copy; /* nothing that is written lies in it */
    const double per = j->period / (j->inertia * j->v_s), g = j->damping * j->period / j->inertia;
    const double p = -expm1(-g) / g;
    const flow c = {g, p, (1.0 - p) / g, per * j->drive, per * j->gain * j->mu_d,
                    per * j->gain * (j->mu_s - j->mu_d), j->v_s * j->period};
    block b;
    queue near, layer[2];
    for (int64_t i = 0; i < n; i += BLOCK) {
        memset(&b, 0, sizeof b);
        for (int64_t l = 0; l < BLOCK; l++) {
            int64_t of = i + l < n ? i + l : n - 1; /* the last run fills up the last block */
            b.kp[l] = kp[of], b.kd[l] = kd[of];
        }
        for (int64_t t = 0; t < j->ticks; t++) {
            const int counts = t >= j->settled;
            if (path && i == 0)
                path[t] = b.position[0];
            layer[0].n = 0;
            sample(j, &c, &b, j->rate * ((double)t * j->period), counts, &near);
            above(&c, &b, &near, &layer[0]);
            /* A piece that would not end is one of an excess below the last digit of a voltage. */
            for (int round = 0; layer[round % 2].n > 0 && round < 100; round++) {
                layer[(round + 1) % 2].n = 0;
                within(&c, &b, &layer[round % 2], &layer[(round + 1) % 2], counts);
            }
        }
        for (int64_t l = 0; l < BLOCK && i + l < n; l++) {
            double *of = out + 3 * (i + l);
            of[0] = sqrt(b.squares[l] / (double)(j->ticks - j->settled));
            of[1] = b.worst[l];
            of[2] = b.sticks[l];
        }
    }
}

/* n pairs of gains; root mean square, largest and sticks of each go to out. */
void sweep(const job *on, int64_t n, const double *kp, const double *kd, double *out) { runs(on, n, kp, kd, out, NULL); }

/* One run, of which the position at each sample is wanted. */
void path(const job *on, double kp, double kd, double *positions)
{
    double figures[3];
    runs(on, 1, &kp, &kd, figures, positions);
}
