// math/sampling_steps.h: inner steps of the maps of math/sampling.h, for loops over many points:
// Owen-scrambled Sobol points, and sines. Others call math/sampling.h.
#pragma once

#include <cmath>
#include <cstdint>

namespace vitrine {

inline std::uint32_t reverse_bits(std::uint32_t v) {
    v = (v << 16) | (v >> 16);
    v = ((v & 0x00ff00ffu) << 8) | ((v & 0xff00ff00u) >> 8);
    v = ((v & 0x0f0f0f0fu) << 4) | ((v & 0xf0f0f0f0u) >> 4);
    v = ((v & 0x33333333u) << 2) | ((v & 0xccccccccu) >> 2);
    return ((v & 0x55555555u) << 1) | ((v & 0xaaaaaaaau) >> 1);
}

/// Laine-Karras style permutation of bits that are reversed already; constants of Burley 2020,
/// listing 2.
inline std::uint32_t scramble_reversed(std::uint32_t v, std::uint32_t seed) {
    v += seed;
    v ^= v * 0x6c50b47cu;
    v ^= v * 0xb82f1e52u;
    v ^= v * 0xc7afe638u;
    v ^= v * 0x8d22f6e6u;
    return v;
}

inline std::uint32_t owen_scramble(std::uint32_t v, std::uint32_t seed) {
    return reverse_bits(scramble_reversed(reverse_bits(v), seed));
}

inline std::uint32_t hash_combine(std::uint32_t seed, std::uint32_t v) {
    return seed ^ (v + 0x9e3779b9u + (seed << 6) + (seed >> 2));
}

/// The two coordinates as 32 bits each, the first of which counts most.
struct SobolBits {
    std::uint32_t x, y;
};
inline SobolBits scrambled_sobol_bits(std::uint32_t index, std::uint32_t seed) {
    const std::uint32_t i = owen_scramble(index, seed);
    // The first dimension is the index with its bits reversed, so reversed again it is the index.
    const std::uint32_t x = reverse_bits(scramble_reversed(i, hash_combine(seed, 0)));
    // Of the second, reversed again, Pascal's triangle modulo 2 is the matrix, which comes apart
    // into five shifts (Ahmed 2024).
    std::uint32_t v = i;
    v ^= (v >> 16);
    v ^= (v & 0xff00ff00u) >> 8;
    v ^= (v & 0xf0f0f0f0u) >> 4;
    v ^= (v & 0xccccccccu) >> 2;
    v ^= (v & 0xaaaaaaaau) >> 1;
    return {x, reverse_bits(scramble_reversed(v, hash_combine(seed, 1)))};
}

// Taylor series in the square of an angle of at most pi / 4; both are right to 1e-7.
inline float cosine_below_eighth(float square) {
    return 1.0f +
           square * (-0.5f + square * (0x1.555556p-5f +
                                       square * (-0x1.6c16c2p-10f + square * 0x1.a01a02p-16f)));
}
inline float sinc_below_eighth(float square) {
    return 1.0f + square * (-0x1.555556p-3f +
                            square * (0x1.111112p-7f +
                                      square * (-0x1.a01a02p-13f + square * 0x1.71de3ap-19f)));
}

/// `sample_concentric_disc` without branches.
inline void concentric_disc(float u, float v, float& point_x, float& point_y) {
    const float x = 2.0f * u - 1.0f, y = 2.0f * v - 1.0f;
    const bool is_x_wide = std::abs(x) > std::abs(y);
    const float r = is_x_wide ? x : y, other = is_x_wide ? y : x;
    const float angle = 0x1.921fb6p-1f * (other / (r == 0.0f ? 1.0f : r)), square = angle * angle;
    const float along = r * cosine_below_eighth(square);
    const float across = r * angle * sinc_below_eighth(square);
    point_x = is_x_wide ? along : across;
    point_y = is_x_wide ? across : along;
}

/// Of `turns` in [0, 1) of a whole turn; right to 2e-7.
struct SineCosine {
    float sine, cosine;
};
inline SineCosine sine_cosine_of_turn(float turns) {
    const auto quarter = static_cast<std::int32_t>(4.0f * turns + 0.5f);
    const float angle = 0x1.921fb6p+2f * (turns - 0.25f * static_cast<float>(quarter));
    const float square = angle * angle;
    const float near = cosine_below_eighth(square), across = angle * sinc_below_eighth(square);
    const bool is_odd = (quarter & 1) != 0;
    const float s = is_odd ? near : across, c = is_odd ? across : near;
    return {(quarter & 2) != 0 ? -s : s, ((quarter + 1) & 2) != 0 ? -c : c};
}

}  // namespace vitrine
