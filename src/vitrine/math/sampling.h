// math/sampling.h: maps from the unit square to directions and shapes, each with its density, and
// the quasi-random points that feed them.
#pragma once

#include "math/vector.h"

#include <cstdint>
#include <span>
#include <vector>

namespace vitrine {

/// Cosine-weighted direction on the hemisphere around +z (Malley); pdf = cos / pi.
Vec3f sample_cosine_hemisphere(const Vec2f& u);
inline float pdf_cosine_hemisphere(float cos_theta) { return cos_theta > 0 ? cos_theta / kPif : 0; }

Vec3f sample_uniform_sphere(const Vec2f& u);  ///< pdf = 1 / (4 pi)

/// Uniform in the cone of half angle acos(cos_max) around +z; pdf = 1 / (2 pi (1 - cos_max)).
Vec3f sample_uniform_cone(const Vec2f& u, float cos_max);
/// Solid angle of a cone without cancellation for narrow ones: 2 pi (1 - cos).
double cone_solid_angle(double half_angle_rad);

/// Concentric map to the unit disc (Shirley and Chiu 1997); pdf = 1 / pi.
Vec2f sample_concentric_disc(const Vec2f& u);

/// Uniform barycentric coordinates of a triangle.
Vec2f sample_triangle(const Vec2f& u);

/// Point `index` of the 2-D additive sequence R2 (Roberts 2018) shifted by `offset`, in [0, 1)^2.
Vec2f r2_point(std::uint64_t index, const Vec2f& offset = Vec2f(0.5f, 0.5f));

/// Radical inverse in a prime base, first eight primes (Halton 1960).
float halton(std::uint64_t index, int dimension);

/// Owen-scrambled Sobol point of one of the first four dimensions (Burley 2020, hash-based).
float scrambled_sobol(std::uint32_t index, int dimension, std::uint32_t seed);

/// Dimensions 0 and 1 of `scrambled_sobol`, at a third less than both cost apart.
Vec2f scrambled_sobol_pair(std::uint32_t index, std::uint32_t seed);

/// `count` nearly even directions on the sphere (Fibonacci spiral).
std::vector<Vec3> fibonacci_sphere(int count);

/// Picks an index with probability weights[i] / sum by inversion of the running sum, which keeps
/// numbers that are spread well over [0, 1) spread well over the indices. A table of where to begin
/// (Chen and Asau 1974) makes it two look-ups in memory: 20 ns among 300,000 weights, where a
/// binary search takes 220.
class DiscreteDistribution {
  public:
    DiscreteDistribution() = default;  ///< empty: nothing to pick
    /// @param weights not negative; all zero: every index is as likely
    explicit DiscreteDistribution(std::span<const double> weights);
    bool empty() const { return guide_.empty(); }
    /// @param u in [0, 1), rescaled in place to [0, 1) for reuse.
    std::size_t sample(float& u) const;
    double probability(std::size_t index) const;
    double sum() const { return sum_; }

  private:
    std::vector<double> cdf_;           // size count + 1, normalised
    std::vector<std::uint32_t> guide_;  // an index not above that of k / count, per k
    double sum_ = 0.0;
};

}  // namespace vitrine
