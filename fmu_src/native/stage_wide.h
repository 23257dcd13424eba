/* All lanes of a variable in one register, for steps that no hook interrupts.  Part of stage.c.
 *
 * Where eight lanes are one register, and for one lane. */
#if LANES == 8 && defined(__AVX512F__)
#include <immintrin.h>
enum { WIDE_STEPS = 1 };
typedef __m512d wide;
INLINE wide spread(double x) { return _mm512_set1_pd(x); }
INLINE wide halt(wide v, wide c) { return v - _mm512_max_pd(-c, _mm512_min_pd(v, c)); }
#define FENCE __asm__ volatile("" ::: "memory") /* what lies in memory is read again */
#else
#define FENCE
enum { WIDE_STEPS = LANES == 1 };
typedef double wide;
INLINE wide spread(double x) { return x; }
INLINE wide halt(wide v, wide c) { return v - larger(-c, smaller(v, c)); }
#endif
#define WIDE(lane) (*(wide *)(lane))
