// SIMD lanes: eight numbers side by side, in the vector types of GCC and Clang. One instruction works on eight
// configurations. Lanes never mix, so what a lane holds does not depend on its neighbours.
#pragma once

#include <cmath>
#include <cstdint>

#ifdef __AVX__
#include <immintrin.h>
#endif

namespace plancurate {

constexpr int kLanes = 8;

template <class Real>
struct LaneTypes;

template <>
struct LaneTypes<float> {
    typedef float Lanes __attribute__((vector_size(kLanes * sizeof(float))));
};

template <>
struct LaneTypes<double> {
    typedef double Lanes __attribute__((vector_size(kLanes * sizeof(double))));
};

template <class Real>
using Lanes = typename LaneTypes<Real>::Lanes;
using Floats = Lanes<float>;
using Doubles = Lanes<double>;
typedef std::int32_t Mask __attribute__((vector_size(kLanes * sizeof(std::int32_t))));   // -1 true, 0 false
typedef std::int64_t Longs __attribute__((vector_size(kLanes * sizeof(std::int64_t))));

template <class Real>
Lanes<Real> splat(Real value) {
    return Lanes<Real>{} + value;
}

inline Floats select(Mask chosen, Floats yes, Floats no) { return chosen ? yes : no; }
inline Floats min(Floats a, Floats b) { return a < b ? a : b; }
inline Floats max(Floats a, Floats b) { return a > b ? a : b; }
inline Floats abs(Floats a) { return a < 0.0f ? -a : a; }
inline Floats clamp(Floats a, float limit) { return min(max(a, splat<float>(-limit)), splat<float>(limit)); }

inline Floats sqrt(Floats a) {
    Floats root;
    for (int i = 0; i < kLanes; ++i) root[i] = std::sqrt(a[i]);
    return root;
}

inline bool any(Mask mask) {
#ifdef __AVX__
    return !_mm256_testz_si256(reinterpret_cast<__m256i>(mask), reinterpret_cast<__m256i>(mask));
#else
    std::int32_t bits = 0;
    for (int i = 0; i < kLanes; ++i) bits |= mask[i];
    return bits != 0;
#endif
}

// Lanes of the first count configurations.
inline Mask first_lanes(int count) {
    return Mask{0, 1, 2, 3, 4, 5, 6, 7} < count;
}

template <class L>
L convert(Doubles values) {
    return __builtin_convertvector(values, L);
}

// Sine and cosine to about 1 ulp for |angle| < 1e6: Cody and Waite's reduction to [-pi/4, pi/4], fdlibm's polynomials.
inline void sincos(Doubles angle, Doubles& sine, Doubles& cosine) {
    constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52: adding it leaves the nearest integer in the low bits
    constexpr double kHalfPiHigh = 1.57079632673412561417, kHalfPiLow = 6.07710050650619224932e-11;
    const Doubles shifted = angle * 0.63661977236758134308 + kRound;
    const Doubles turns = shifted - kRound;
    const Longs quarter = reinterpret_cast<Longs>(shifted);
    const Doubles r = (angle - turns * kHalfPiHigh) - turns * kHalfPiLow;
    const Doubles z = r * r;
    const Doubles s = r + r * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 +
        z * (-1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 +
        z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
    const Doubles c = 1.0 - 0.5 * z + z * z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 +
        z * (2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 +
        z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
    const Longs swapped = (quarter & 1) != 0;
    sine = swapped ? c : s;
    cosine = swapped ? s : c;
    sine = (quarter & 2) != 0 ? -sine : sine;
    cosine = ((quarter + 1) & 2) != 0 ? -cosine : cosine;
}

}  // namespace plancurate
