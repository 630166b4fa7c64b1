#include "math/sampling.h"

#include "base/error.h"
#include "math/sampling_steps.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vitrine {
namespace {

constexpr float kOneMinusEpsilon = 0x1.fffffep-1f;

/// Generator matrices, applied byte by byte: table[d][k][b] is the exclusive or of the columns of
/// dimension d that the bits of b pick in byte k.
struct SobolMatrices {
    std::array<std::array<std::array<std::uint32_t, 256>, 4>, 4> table{};
    SobolMatrices() {
        std::array<std::array<std::uint32_t, 32>, 4> column{};
        for (int bit = 0; bit < 32; ++bit) column[0][bit] = 1u << (31 - bit);
        // Joe and Kuo 2008: degree s, coefficients a, initial numbers m of dimensions 2 to 4.
        struct Start {
            int s;
            std::uint32_t a;
            std::array<std::uint32_t, 3> m;
        };
        const std::array<Start, 3> starts = {
            {{1, 0, {1, 0, 0}}, {2, 1, {1, 3, 0}}, {3, 1, {1, 3, 1}}}};
        for (int d = 0; d < 3; ++d) {
            const Start& start = starts[d];
            auto& v = column[d + 1];
            for (int i = 0; i < 32; ++i) {
                if (i < start.s) {
                    v[i] = start.m[i] << (31 - i);
                } else {
                    v[i] = v[i - start.s] ^ (v[i - start.s] >> start.s);
                    for (int k = 1; k < start.s; ++k) {
                        if ((start.a >> (start.s - 1 - k)) & 1u) v[i] ^= v[i - k];
                    }
                }
            }
        }
        for (std::size_t d = 0; d < 4; ++d) {
            for (std::size_t k = 0; k < 4; ++k) {
                for (std::uint32_t b = 0; b < 256; ++b) {
                    for (std::size_t bit = 0; bit < 8; ++bit) {
                        if ((b >> bit) & 1u) table[d][k][b] ^= column[d][8 * k + bit];
                    }
                }
            }
        }
    }
};

const SobolMatrices kSobol;

}  // namespace

Vec2f sample_concentric_disc(const Vec2f& u) {
    const float x = 2.0f * u.x() - 1.0f, y = 2.0f * u.y() - 1.0f;
    if (x == 0.0f && y == 0.0f) return Vec2f::Zero();
    // Picked by index: no branch foretells which of two even chances it will be.
    const float coordinates[2] = {y, x};
    const std::size_t wide = std::abs(x) > std::abs(y) ? 1 : 0;
    const float r = coordinates[wide];
    // Within an eighth of a turn of the nearer axis.
    const float angle = 0.25f * kPif * (coordinates[1 - wide] / r), square = angle * angle;
    float point[2];
    point[1 - wide] = r * cosine_below_eighth(square);
    point[wide] = r * angle * sinc_below_eighth(square);
    return {point[0], point[1]};
}

Vec3f sample_cosine_hemisphere(const Vec2f& u) {
    const Vec2f d = sample_concentric_disc(u);
    return {d.x(), d.y(), std::sqrt(std::max(0.0f, 1.0f - d.squaredNorm()))};
}

Vec3f sample_uniform_sphere(const Vec2f& u) {
    const float z = 1.0f - 2.0f * u.x();
    const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
    const float phi = 2.0f * kPif * u.y();
    return {r * std::cos(phi), r * std::sin(phi), z};
}

Vec3f sample_uniform_cone(const Vec2f& u, float cos_max) {
    // 1 - z rather than z: a narrow cone keeps its resolution.
    const float one_minus_z = u.x() * (1.0f - cos_max);
    const float r = std::sqrt(std::max(0.0f, one_minus_z * (2.0f - one_minus_z)));
    const SineCosine turn = sine_cosine_of_turn(u.y());
    return {r * turn.cosine, r * turn.sine, 1.0f - one_minus_z};
}

double cone_solid_angle(double half_angle_rad) {
    const double s = std::sin(0.5 * half_angle_rad);
    return 4.0 * kPi * s * s;
}

Vec2f sample_triangle(const Vec2f& u) {
    const float root = std::sqrt(u.x());
    return {1.0f - root, u.y() * root};
}

Vec2f r2_point(std::uint64_t index, const Vec2f& offset) {
    // 1/g and 1/g^2 of the plastic number g as 64-bit fixed point: exact for any index.
    const std::uint64_t x = 0xc13fa9a902a6328fULL * index, y = 0x91e10da5c79e7b1cULL * index;
    const float fx = static_cast<float>(x >> 40) * 0x1p-24f + offset.x();
    const float fy = static_cast<float>(y >> 40) * 0x1p-24f + offset.y();
    return {std::min(fx - std::floor(fx), kOneMinusEpsilon),
            std::min(fy - std::floor(fy), kOneMinusEpsilon)};
}

float halton(std::uint64_t index, int dimension) {
    constexpr std::array<std::uint64_t, 8> kPrimes = {2, 3, 5, 7, 11, 13, 17, 19};
    VITRINE_CHECK_LT(static_cast<std::size_t>(dimension), kPrimes.size());
    const std::uint64_t base = kPrimes[static_cast<std::size_t>(dimension)];
    double inverse = 1.0 / static_cast<double>(base), scale = inverse, result = 0.0;
    for (std::uint64_t i = index; i > 0; i /= base) {
        result += static_cast<double>(i % base) * scale;
        scale *= inverse;
    }
    return std::min(static_cast<float>(result), kOneMinusEpsilon);
}

float scrambled_sobol(std::uint32_t index, int dimension, std::uint32_t seed) {
    VITRINE_CHECK_LT(static_cast<std::size_t>(dimension), std::size_t{4});
    const std::uint32_t i = owen_scramble(index, seed);
    const auto& table = kSobol.table[static_cast<std::size_t>(dimension)];
    std::uint32_t bits = table[0][i & 255u] ^ table[1][(i >> 8) & 255u] ^
                         table[2][(i >> 16) & 255u] ^ table[3][i >> 24];
    bits = owen_scramble(bits, hash_combine(seed, static_cast<std::uint32_t>(dimension)));
    return static_cast<float>(bits >> 8) * 0x1p-24f;
}

Vec2f scrambled_sobol_pair(std::uint32_t index, std::uint32_t seed) {
    const SobolBits bits = scrambled_sobol_bits(index, seed);
    return {static_cast<float>(bits.x >> 8) * 0x1p-24f, static_cast<float>(bits.y >> 8) * 0x1p-24f};
}

std::vector<Vec3> fibonacci_sphere(int count) {
    std::vector<Vec3> directions;
    const double golden = kPi * (3.0 - std::sqrt(5.0));
    for (int i = 0; i < count; ++i) {
        const double z = 1.0 - (2.0 * i + 1.0) / count;
        const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
        directions.emplace_back(r * std::cos(golden * i), r * std::sin(golden * i), z);
    }
    return directions;
}

DiscreteDistribution::DiscreteDistribution(std::span<const double> weights) {
    VITRINE_CHECK(!weights.empty());
    cdf_.resize(weights.size() + 1, 0.0);
    for (std::size_t i = 0; i < weights.size(); ++i) {
        VITRINE_CHECK_GE(weights[i], 0.0);
        cdf_[i + 1] = cdf_[i] + weights[i];
    }
    sum_ = cdf_.back();
    for (std::size_t i = 0; i < cdf_.size(); ++i) {
        cdf_[i] = sum_ > 0 ? cdf_[i] / sum_ : static_cast<double>(i) / weights.size();
    }
    guide_.resize(weights.size());
    std::size_t index = 0;
    for (std::size_t k = 0; k < guide_.size(); ++k) {
        // Half a step early, so that rounding never begins too far.
        const double start = (static_cast<double>(k) - 0.5) / static_cast<double>(guide_.size());
        while (index + 1 < guide_.size() && cdf_[index + 1] <= start) ++index;
        guide_[k] = static_cast<std::uint32_t>(index);
    }
}

std::size_t DiscreteDistribution::sample(float& u) const {
    const std::size_t count = guide_.size();
    const auto place = static_cast<std::size_t>(static_cast<double>(u) * double(count));
    std::size_t index = guide_[std::min(place, count - 1)];
    while (index + 1 < count && cdf_[index + 1] <= static_cast<double>(u)) ++index;
    const double width = cdf_[index + 1] - cdf_[index];
    u = width > 0 ? static_cast<float>((u - cdf_[index]) / width) : 0.0f;
    u = std::clamp(u, 0.0f, kOneMinusEpsilon);
    return index;
}

double DiscreteDistribution::probability(std::size_t index) const {
    return cdf_[index + 1] - cdf_[index];
}

}  // namespace vitrine
