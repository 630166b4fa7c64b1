// render/sampler.h: the random numbers of one camera sample or one photon path.
//
// The first dimensions, which carry most of the variance, come as well spread pairs (Owen-scrambled
// Sobol points, Burley 2020); the rest from a stream keyed by the same numbers. A vertex draws from
// its own dimensions, so that two paths which agree up to a vertex go on with the same numbers.
#pragma once

#include "base/rng.h"
#include "math/sampling.h"

namespace vitrine {

/// Point `index` of a (0, 2)-sequence, scrambled by `seed`: any 2^k points from 0 are stratified.
inline Vec2f sobol_pair(std::uint32_t index, std::uint32_t seed) {
    return scrambled_sobol_pair(index, seed);
}

class PathSampler {
  public:
    PathSampler() = default;
    /// @param stream key of the pixel or photon set; @param index of the sample within it
    PathSampler(std::uint64_t stream, std::uint32_t index)
        : mixed_stream_(mix_bits(stream)), index_(index) {}

    /// Of another sample of the same stream.
    PathSampler at(std::uint32_t index) const {
        PathSampler other = *this;
        other.index_ = index;
        return other;
    }
    /// Pair for use `purpose` at vertex `depth`; stratified over `index` for the first vertices.
    Vec2f pair(int depth, int purpose) const {
        const std::uint64_t key = key_of(depth, purpose);
        if (depth <= kStratifiedDepth) return sobol_pair(index_, static_cast<std::uint32_t>(key));
        return unstratified(key, index_);
    }
    /// Two more dimensions of the same points, stratified together with `pair`: for quantities that
    /// only act together, such as the place on a lamp and the direction from there. First vertex.
    Vec2f further_pair(int purpose) const {
        const auto key = static_cast<std::uint32_t>(key_of(0, purpose));
        return {scrambled_sobol(index_, 2, key), scrambled_sobol(index_, 3, key)};
    }
    /// Pair `k` of `count` that this sample takes instead of one: all samples that take as many go
    /// through the sequence together.
    Vec2f pair(int depth, int purpose, int count, int k) const {
        return at(index_ * static_cast<std::uint32_t>(count) + static_cast<std::uint32_t>(k))
            .pair(depth, purpose);
    }
    /// The first of the pair.
    float number(int depth, int purpose) const {
        const std::uint64_t key = key_of(depth, purpose);
        if (depth <= kStratifiedDepth) {
            return scrambled_sobol(index_, 0, static_cast<std::uint32_t>(key));
        }
        return static_cast<float>(bits_of(key, index_) >> 40) * 0x1p-24f;
    }

    // For loops over the samples of many paths, which do what `pair` does; see plain_lanes.h.
    std::uint64_t mixed_stream() const { return mixed_stream_; }
    std::uint32_t index() const { return index_; }
    /// Beyond the second diffuse bounce stratification buys nothing measurable.
    static constexpr int kStratifiedDepth = 3;
    /// Beyond it, of the key of a use: the upper 24 bits are the first number, the 24 bits that
    /// end 16 from below the second.
    static std::uint64_t bits_of(std::uint64_t key, std::uint32_t index) {
        return mix_bits(key ^ (std::uint64_t{index} << 32 | index));
    }

  private:
    static Vec2f unstratified(std::uint64_t key, std::uint32_t index) {
        const std::uint64_t bits = bits_of(key, index);
        return {static_cast<float>(bits >> 40) * 0x1p-24f,
                static_cast<float>((bits >> 16) & 0xffffffu) * 0x1p-24f};
    }
    std::uint64_t key_of(int depth,
                         int purpose) const {  // = stream_key(stream, 16 depth + purpose)
        return mix_bits(mixed_stream_ ^
                        (static_cast<std::uint64_t>(depth) * 16u + unsigned(purpose)));
    }

    std::uint64_t mixed_stream_ = 0;
    std::uint32_t index_ = 0;
};

}  // namespace vitrine
