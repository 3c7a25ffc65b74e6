/* What both peers in C share: vectors as wide as the processor has them, AVX-512 or AVX2, and the numbers of the job. */

#include <immintrin.h>
#include <math.h>
#include <stdint.h>

#if defined(__AVX512F__)
enum { WIDTH = 8 };
typedef __m512d vector;
typedef __m512i integers;
typedef __mmask8 mask;
#define FEW(name) _mm512_##name
static inline mask less(vector a, vector b) { return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ); }
static inline vector chosen(mask m, vector a, vector b) { return _mm512_mask_blend_pd(m, b, a); }
static inline vector floored(vector x) { return _mm512_roundscale_pd(x, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC); }
static inline mask both(mask a, mask b) { return a & b; }
static inline mask without(mask a, mask b) { return a & (mask)~b; }
static inline mask either(mask a, mask b) { return a | b; }
static inline int any(mask m) { return m != 0; }
static inline mask all(void) { return 0xff; }
#elif defined(__AVX2__)
enum { WIDTH = 4 };
typedef __m256d vector;
typedef __m256i integers;
typedef __m256d mask;
#define FEW(name) _mm256_##name
static inline mask less(vector a, vector b) { return _mm256_cmp_pd(a, b, _CMP_LT_OQ); }
static inline vector chosen(mask m, vector a, vector b) { return _mm256_blendv_pd(b, a, m); }
static inline vector floored(vector x) { return _mm256_floor_pd(x); }
static inline mask both(mask a, mask b) { return _mm256_and_pd(a, b); }
static inline mask without(mask a, mask b) { return _mm256_andnot_pd(b, a); }
static inline mask either(mask a, mask b) { return _mm256_or_pd(a, b); }
static inline int any(mask m) { return _mm256_movemask_pd(m) != 0; }
static inline mask all(void) { return _mm256_cmp_pd(_mm256_setzero_pd(), _mm256_setzero_pd(), _CMP_EQ_OQ); }
#else
#error "for AVX2 or AVX-512"
#endif

/* Numbers of the job: see job.py. */
typedef struct {
    double inertia, drive, damping, gain, mu_s, mu_d, v_s;
    double smoothing, counts_per_radian, lowest, highest, period, rate;
    int64_t ticks, settled;
} job;

static inline vector splat(double x) { return FEW(set1_pd)(x); }
static inline vector magnitude(vector x) { return FEW(max_pd)(x, -x); }
