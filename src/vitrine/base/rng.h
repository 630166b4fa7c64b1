// base/rng.h: one random stream per unit of work, keyed by what it is for and not by who runs it.
#pragma once

#include <cstdint>

namespace vitrine {

/// Mixes 64 bits into 64 well scrambled ones (Steele, Lea, Flood 2014, SplitMix64 finaliser).
inline std::uint64_t mix_bits(std::uint64_t v) {
    v += 0x9e3779b97f4a7c15ULL;
    v = (v ^ (v >> 30)) * 0xbf58476d1ce4e5b9ULL;
    v = (v ^ (v >> 27)) * 0x94d049bb133111ebULL;
    return v ^ (v >> 31);
}

/// One key from several numbers, e.g. `stream_key(seed, frame, pixel)`.
template <typename... Rest>
std::uint64_t stream_key(std::uint64_t first, Rest... rest) {
    std::uint64_t key = mix_bits(first);
    ((key = mix_bits(key ^ static_cast<std::uint64_t>(rest))), ...);
    return key;
}

/// PCG32 (O'Neill 2014): 64 bits of state, 32 bits out; copyable, no global state.
class Rng {
  public:
    explicit Rng(std::uint64_t key = 0) : increment_((mix_bits(key ^ 0x5851f42dULL) << 1) | 1u) {
        state_ = 0;
        next_u32();
        state_ += mix_bits(key);
        next_u32();
    }

    std::uint32_t next_u32() {
        const std::uint64_t old = state_;
        state_ = old * 6364136223846793005ULL + increment_;
        const auto shifted = static_cast<std::uint32_t>(((old >> 18u) ^ old) >> 27u);
        const auto rotation = static_cast<std::uint32_t>(old >> 59u);
        return (shifted >> rotation) | (shifted << ((32u - rotation) & 31u));
    }

    /// Uniform in [0, 1).
    float next_float() { return static_cast<float>(next_u32() >> 8) * 0x1p-24f; }
    /// Uniform in [0, 1) with 53 bits.
    double next_double() {
        const std::uint64_t high = next_u32() >> 5;
        const std::uint64_t low = next_u32() >> 6;
        return static_cast<double>(high * 67108864ULL + low) * 0x1p-53;
    }
    /// Uniform in {0, ..., count - 1}; the bias is below 2^-32 * count.
    std::uint32_t next_index(std::uint32_t count) {
        return static_cast<std::uint32_t>((static_cast<std::uint64_t>(next_u32()) * count) >> 32);
    }

  private:
    std::uint64_t state_;
    std::uint64_t increment_;
};

}  // namespace vitrine
