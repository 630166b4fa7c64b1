#include "geometry/even_samples.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "geometry/point_grid.h"
#include "math/sampling.h"

#include <numeric>

namespace vitrine {
namespace {

/// Radius of the discs in spacings: a set to which no disc can be added holds one point per 1.7
/// radii squared.
constexpr double kDiscRadius = 0.77;
/// Candidates per point that is kept: enough to leave no hole, and to measure patches to 1 or 2 %.
constexpr double kCandidatesPerPoint = 12;

Vec3f point_on(const Mesh& mesh, int triangle, const Vec2f& b) {
    const Triangle& t = mesh.triangles[static_cast<std::size_t>(triangle)];
    return mesh.vertices[static_cast<std::size_t>(t[0])] * (1 - b.x() - b.y()) +
           mesh.vertices[static_cast<std::size_t>(t[1])] * b.x() +
           mesh.vertices[static_cast<std::size_t>(t[2])] * b.y();
}

EvenSamples draw_candidates(const Mesh& mesh, std::size_t count, Rng& rng) {
    std::vector<double> areas(mesh.triangles.size());
    for (std::size_t i = 0; i < areas.size(); ++i) areas[i] = triangle_area(mesh, i);
    const DiscreteDistribution distribution(areas);
    EvenSamples candidates;
    for (std::size_t i = 0; i < count; ++i) {
        float u = (static_cast<float>(i) + rng.next_float()) / static_cast<float>(count);
        u = std::min(u, 0x1.fffffep-1f);
        const auto triangle = static_cast<int>(distribution.sample(u));
        const Vec2f b = sample_triangle(Vec2f(rng.next_float(), rng.next_float()));
        candidates.triangles.push_back(triangle);
        candidates.barycentric.push_back(b);
        candidates.points.push_back(point_on(mesh, triangle, b));
        candidates.normals.push_back(triangle_normal(mesh, static_cast<std::size_t>(triangle)));
    }
    return candidates;
}

}  // namespace

EvenSamples sample_evenly(const Mesh& mesh, double spacing_m, std::uint64_t seed) {
    EvenSamples samples;
    const double area = surface_area(mesh);
    if (!(area > 0)) return samples;
    Rng rng(stream_key(seed, 0xe7e5u));
    const auto count = static_cast<std::size_t>(
        std::ceil(kCandidatesPerPoint * area / (spacing_m * spacing_m)) + kCandidatesPerPoint);
    const EvenSamples candidates = draw_candidates(mesh, count, rng);
    const auto radius = static_cast<float>(kDiscRadius * spacing_m);
    const PointGrid grid(candidates.points, radius);

    // Darts in random order.
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    for (std::size_t i = count; i > 1; --i) {
        std::swap(order[i - 1], order[rng.next_index(static_cast<std::uint32_t>(i))]);
    }
    constexpr std::int32_t kDropped = -1;
    std::vector<std::int32_t> kept(count, kDropped);
    for (const std::uint32_t i : order) {
        bool is_free = true;
        grid.for_each_near(candidates.points[i], [&](std::uint32_t k) {
            is_free &=
                kept[k] == kDropped ||
                (candidates.points[k] - candidates.points[i]).squaredNorm() >= radius * radius ||
                candidates.normals[k].dot(candidates.normals[i]) <= 0;
        });
        if (!is_free) continue;
        kept[i] = static_cast<std::int32_t>(samples.size());
        samples.points.push_back(candidates.points[i]);
        samples.triangles.push_back(candidates.triangles[i]);
        samples.barycentric.push_back(candidates.barycentric[i]);
        samples.normals.push_back(candidates.normals[i]);
    }

    // Every candidate's share of the surface goes to the nearest kept one.
    std::vector<std::int32_t> owner(count);
    parallel_for(count, 1024, [&](std::size_t i) {
        float best = 1e30f;
        grid.for_each_near(candidates.points[i], [&](std::uint32_t k) {
            if (kept[k] == kDropped) return;
            if (candidates.normals[k].dot(candidates.normals[i]) <= 0) return;
            const float d = (candidates.points[k] - candidates.points[i]).squaredNorm();
            if (d >= best) return;
            best = d;
            owner[i] = kept[k];
        });
    });
    samples.area_m2.assign(samples.size(), 0.0f);
    for (const std::int32_t k : owner) samples.area_m2[static_cast<std::size_t>(k)] += 1.0f;
    const auto share = static_cast<float>(area / static_cast<double>(count));
    for (float& a : samples.area_m2) a *= share;
    return samples;
}

}  // namespace vitrine
