/* Elementary functions without calls or branches, so that a loop over lanes becomes vectors, and so
 * that every platform and every number of lanes gives the same bits.  Part of stage.c.
 *
 * Polynomials by pairs of terms (Estrin): a chain from the highest term down takes three times as
 * long, and the next speed waits for it.  Reduction and coefficients as in fdlibm (Sun Microsystems,
 * 1993); 1 ulp or so for |angle| < 1e6. */

INLINE double larger(double a, double b) { return a > b ? a : b; }
INLINE double smaller(double a, double b) { return a < b ? a : b; }

/* adding and taking away 1.5 * 2^52 rounds to the nearest integer, which the low bits then hold */
static const double ROUNDER = 6755399441055744.0;

INLINE uint64_t bits_of(double x) { uint64_t b; memcpy(&b, &x, sizeof b); return b; }
INLINE double from_bits(uint64_t b) { double x; memcpy(&x, &b, sizeof x); return x; }

/* one of two values; both are always read, for masked loads and stores cost dozens of cycles with AVX2 */
INLINE double pick(int condition, double one, double other)
{
#if LANES > 1
    const uint64_t mask = condition ? ~(uint64_t)0 : 0;
    return from_bits((bits_of(one) & mask) | (bits_of(other) & ~mask));
#else
    return condition ? one : other;
#endif
}

/* e^x; below -708 the smallest normal numbers stand for zero */
INLINE double exponential(double x)
{
    const double y = smaller(larger(x, -708.0), 709.0);
    const double shifted = y * 1.4426950408889634 + ROUNDER, n = shifted - ROUNDER;
    const double r = (y - n * 6.93147180369123816490e-01) - n * 1.90821492927058770002e-10;
    const double r2 = r * r, r4 = r2 * r2, r8 = r4 * r4;
    const double low = (0.5 + r * (1.0 / 6.0)) + r2 * (1.0 / 24.0 + r * (1.0 / 120.0));
    const double middle = (1.0 / 720.0 + r * (1.0 / 5040.0)) + r2 * (1.0 / 40320.0 + r * (1.0 / 362880.0));
    const double high = (1.0 / 3628800.0 + r * (1.0 / 39916800.0))
        + r2 * (1.0 / 479001600.0 + r * (1.0 / 6227020800.0));
    const double p = (r2 * ((low + r4 * middle) + r8 * high) + r) + 1.0;
    return from_bits(bits_of(p) + (bits_of(shifted) << 52));
}

/* sine of x + quarter * pi / 2 */
INLINE double turned_sine(double x, uint64_t quarter)
{
    const double shifted = x * 6.36619772367581382433e-01 + ROUNDER, n = shifted - ROUNDER;
    const double r = ((x - n * 1.57079632673412561417e+00) - n * 6.07710050630396597660e-11)
        - n * 2.02226624879595063154e-21;
    const double z = r * r, z2 = z * z, z4 = z2 * z2;
    const double odd = (-1.66666666666666324348e-01 + z * 8.33333333332248946124e-03)
        + z2 * (-1.98412698298579493134e-04 + z * 2.75573137070700676789e-06)
        + z4 * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10);
    const double even = (4.16666666666666019037e-02 + z * -1.38888888888741095749e-03)
        + z2 * (2.48015872894767294178e-05 + z * -2.75573143513906633035e-07)
        + z4 * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11);
    const double s = r + r * z * odd, c = (1.0 - 0.5 * z) + z2 * even;
    const uint64_t turn = bits_of(shifted) + quarter;
    const double value = turn & 1 ? c : s;
    return turn & 2 ? -value : value;
}

INLINE double sine(double x) { return turned_sine(x, 0); }
INLINE double cosine(double x) { return turned_sine(x, 1); }
