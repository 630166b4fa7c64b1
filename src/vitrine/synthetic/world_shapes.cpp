#include "synthetic/world_shapes.h"

#include "geometry/primitives.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr float kGap = 5e-4f;  // metres above the table: nothing touches, nothing leaks
constexpr int kWaveCount = 24;

double between(Rng& rng, double low, double high) { return low + (high - low) * rng.next_double(); }

Vec3f random_direction(Rng& rng) {
    const float z = 2.0f * rng.next_float() - 1.0f, phi = 2.0f * kPif * rng.next_float();
    const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
    return {r * std::cos(phi), r * std::sin(phi), z};
}

Mesh rested(Mesh mesh) {
    float lowest = 1e30f;
    for (const Vec3f& v : mesh.vertices) lowest = std::min(lowest, v.z());
    for (Vec3f& v : mesh.vertices) v.z() += kGap - lowest;
    return mesh;
}

/// Points along the profile every `step_m`: errors bend a mesh only where it has vertices.
std::vector<Vec2> densified(const std::vector<Vec2>& profile, double step_m = 0.003) {
    std::vector<Vec2> dense = {profile.front()};
    for (std::size_t k = 1; k < profile.size(); ++k) {
        const Vec2 edge = profile[k] - profile[k - 1];
        const int pieces = std::max(1, static_cast<int>(std::ceil(edge.norm() / step_m)));
        for (int i = 1; i <= pieces; ++i)
            dense.push_back(profile[k - 1] + edge * (static_cast<double>(i) / pieces));
    }
    return dense;
}

/// A bottle without a neck: shoulders bend light as a sphere does, sides as a cylinder.
Mesh make_bottle(double radius) {
    constexpr int kShoulderRings = 24;
    const double gap = static_cast<double>(kGap), shoulder = 1.4 * radius, foot = 0.1 * radius;
    std::vector<Vec2> profile = {Vec2(0, gap)};
    for (int k = 0; k <= 6; ++k) {
        const double a = 0.5 * kPi * k / 6.0;
        profile.emplace_back(radius - foot + foot * std::sin(a), gap + foot * (1 - std::cos(a)));
    }
    for (int k = 0; k <= kShoulderRings; ++k) {
        const double a = 0.5 * kPi * k / kShoulderRings;
        profile.emplace_back(radius * std::cos(a), shoulder + 0.9 * radius * std::sin(a));
    }
    return make_lathe(densified(profile), 128);
}

/// The same of seven straight pieces.
Mesh make_angular_bottle(double radius) {
    return make_lathe({Vec2(0, 5e-4), Vec2(0.9 * radius, 6e-4), Vec2(radius, 0.006),
                       Vec2(radius, 1.4 * radius), Vec2(0.8 * radius, 1.9 * radius),
                       Vec2(0.45 * radius, 2.2 * radius), Vec2(0, 2.3 * radius)},
                      128);
}

/// A ball bent by slow waves and pressed flat: no axis of revolution.
Mesh make_pebble(double radius, Rng& rng) {
    Mesh mesh = make_sphere(radius, Vec3::Zero(), 64);
    const DisplacementField bend(0.09 * radius, 1.6 * radius, 3.5 * radius, rng);
    for (Vec3f& v : mesh.vertices) {
        v += bend(v);
        v.z() *= 0.75f;
    }
    mesh.uv.clear();
    mesh.normals.clear();
    mesh = welded(mesh, 1e-7);
    mesh.normals = vertex_normals(mesh);
    return rested(std::move(mesh));
}

}  // namespace

Mesh make_world_shape(WorldShape shape, double radius, Rng& rng) {
    if (shape == WorldShape::BallOrBottle && rng.next_double() >= 0.5)
        return make_angular_bottle(radius);
    switch (shape) {
        case WorldShape::Torus:
            return rested(make_torus(0.9 * radius, 0.4 * radius, Vec3::Zero()));
        case WorldShape::Pebble:
            return make_pebble(1.1 * radius, rng);
        case WorldShape::Bottle:
            return make_bottle(radius);
        case WorldShape::Ball:
        case WorldShape::BallOrBottle:
            break;
    }
    return make_sphere(radius, Vec3(0, 0, radius + kGap), 64);
}

Vessel make_vessel(double radius, Rng& rng) {
    Vessel vessel;
    vessel.wall_m = between(rng, 0.0015, 0.004);
    const double w = vessel.wall_m, foot = between(rng, 0.75, 0.95) * radius;
    const double height = between(rng, 2.0, 2.8) * radius, base = between(rng, 1.5, 3.0) * w;
    const double slope = (radius - foot) / height;
    const double gap = static_cast<double>(kGap);
    const auto outer = [&](double z) { return foot + slope * (z - gap); };
    const double top = gap + height;
    vessel.glass =
        make_lathe({Vec2(0, gap), Vec2(foot, gap), Vec2(outer(top), top), Vec2(outer(top) - w, top),
                    Vec2(outer(gap + base) - w, gap + base), Vec2(0, gap + base)},
                   128);
    vessel.hull = make_lathe(
        densified({Vec2(0, gap), Vec2(foot, gap), Vec2(outer(top), top), Vec2(0, top)}), 128);
    return vessel;
}

DisplacementField::DisplacementField(double error_m, double min_wave_m, double max_wave_m,
                                     Rng& rng) {
    // Each wave contributes half its amplitude squared to the mean square.
    const auto amplitude = static_cast<float>(error_m * std::sqrt(2.0 / kWaveCount));
    for (int k = 0; k < kWaveCount; ++k) {
        Wave wave;
        const double length = between(rng, min_wave_m, max_wave_m);
        wave.number = static_cast<float>(2.0 * kPi / length) * random_direction(rng);
        wave.shift = amplitude * random_direction(rng);
        wave.phase = 2.0f * kPif * rng.next_float();
        waves_.push_back(wave);
    }
}

Vec3f DisplacementField::operator()(const Vec3f& point) const {
    Vec3f sum = Vec3f::Zero();
    for (const Wave& wave : waves_)
        sum += std::sin(wave.number.dot(point) + wave.phase) * wave.shift;
    return sum;
}

}  // namespace vitrine
