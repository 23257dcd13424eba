/* All of a micro-step in registers, for steps that no hook interrupts.  Part of stage.c.
 *
 * With eight lanes a variable is one register where there are such; with one lane a register holds
 * two variables (see kernel/pair_code.py) or one. */
#if defined(__SSE2__) && defined(__GNUC__)
#include <immintrin.h>
#endif
#ifdef __GNUC__
#define FENCE __asm__ volatile("" ::: "memory") /* what lies in memory is read again */
#else
#define FENCE
#endif

#if LANES == 8 && defined(__AVX512F__)
enum { WIDE_STEPS = 1 };
typedef __m512d wide;
INLINE wide spread(double x) { return _mm512_set1_pd(x); }
#ifdef __AVX512DQ__
INLINE wide halt(wide v, wide c) { return v - _mm512_range_pd(v, c, 2); } /* the smaller size, v's sign */
#else
INLINE wide halt(wide v, wide c) { return v - _mm512_max_pd(-c, _mm512_min_pd(v, c)); }
#endif
INLINE wide least(wide a, wide b) { return _mm512_min_pd(a, b); }
INLINE wide sized(wide v) { return _mm512_abs_pd(v); }
/* the size of one with the sign of the other; sizes have none */
INLINE wide signed_as(wide size, wide v)
{
    const __m512i sign = _mm512_and_si512(_mm512_castpd_si512(v), _mm512_set1_epi64(INT64_MIN));
    return _mm512_castsi512_pd(_mm512_or_si512(_mm512_castpd_si512(size), sign));
}
#else
enum { WIDE_STEPS = LANES == 1 };
typedef double wide;
INLINE wide spread(double x) { return x; }
INLINE wide halt(wide v, wide c) { return v - larger(-c, smaller(v, c)); }
INLINE wide least(wide a, wide b) { return smaller(a, b); }
INLINE wide sized(wide v) { return fabs(v); }
INLINE wide signed_as(wide size, wide v) { return copysign(size, v); }
#endif
/* `slide` of stage_friction.h */
INLINE wide slid(wide v, wide c, wide gain0, wide gain1, wide lift1, wide gain2, wide lift2)
{
    const wide size = sized(v), slow = least(gain0 * size, c);
    const wide fast = least(gain1 * size + lift1, gain2 * size + lift2);
    return v - signed_as(least(slow, fast), v);
}
#define WIDE(lane) (*(wide *)(lane))

#if LANES == 1 && defined(__SSE2__) && defined(__GNUC__)
#define PAIRS 1
typedef __m128d pair;
INLINE pair twice(double x) { return _mm_set1_pd(x); }
INLINE pair both(const double *a, const double *b) { return _mm_set_pd(*b, *a); }
INLINE pair next_to(const double *a) { return _mm_loadu_pd(a); }
INLINE void beside(pair x, double *a) { _mm_storeu_pd(a, x); }
INLINE void part(pair x, double *a, double *b) { _mm_storel_pd(a, x); _mm_storeh_pd(b, x); }
INLINE pair low(pair a, pair b) { return _mm_unpacklo_pd(a, b); }
INLINE pair high(pair a, pair b) { return _mm_unpackhi_pd(a, b); }
/* signs turned where the others are -0.0 */
INLINE pair turned(pair x, double a, double b) { return _mm_xor_pd(x, _mm_set_pd(b, a)); }
/* the second one negative, zero without a sign */
INLINE pair negated(pair x) { return turned(x, 0.0, -0.0) + twice(0.0); }
#if defined(__AVX512VL__) && defined(__AVX512DQ__)
INLINE pair halt_pair(pair v, pair c) { return v - _mm_range_pd(v, c, 2); }
#else
INLINE pair halt_pair(pair v, pair c) { return v - _mm_max_pd(-c, _mm_min_pd(v, c)); }
#endif
#else
#define PAIRS 0
#endif
