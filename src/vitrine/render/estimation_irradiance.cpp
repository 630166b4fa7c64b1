#include "render/estimation_irradiance.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "math/sampling.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr float kMinRayCos = 0.1f;  // flatter rays start ten offsets away, not more
constexpr int kScoutSamples = 4;    // if these agree, the point is in full light or full shadow

/// Points of the unit disc: scouts first, near the rim at four sides, then an even spiral.
std::vector<Vec2f> disc_pattern(int count) {
    std::vector<Vec2f> pattern;
    for (int k = 0; k < kScoutSamples; ++k) {
        const float angle = kPif * (0.25f + 0.5f * static_cast<float>(k));
        pattern.emplace_back(0.85f * std::cos(angle), 0.85f * std::sin(angle));
    }
    for (int k = 0; k < count; ++k) {
        const float r = std::sqrt((static_cast<float>(k) + 0.5f) / static_cast<float>(count));
        const float angle = 2.39996323f * static_cast<float>(k);  // golden angle
        pattern.emplace_back(r * std::cos(angle), r * std::sin(angle));
    }
    return pattern;
}

struct Sums {
    float clear = 0, through = 0;
};

/// Where around a receiver its samples arrive: even over a square whose deviation is the footprint,
/// its axes along those of the lamp's disc, so that the scouts' extremes of both add up.
class Footprint {
  public:
    Footprint(const SurfacePoint& point, const Frame& disc) {
        const float half = std::sqrt(3.0f) * point.footprint_m;
        const Vec3f along = disc.tangent - point.normal.dot(disc.tangent) * point.normal;
        const Vec3f across = disc.bitangent - point.normal.dot(disc.bitangent) * point.normal;
        // One of them vanishes where the surface stands edge-on to the disc's axis.
        const bool is_along = along.squaredNorm() > across.squaredNorm();
        const Vec3f first = (is_along ? along : across).normalized();
        const Vec3f second = point.normal.cross(first);
        x_ = half * (is_along ? first : (second.dot(along) < 0.0f ? Vec3f(-second) : second));
        y_ = half * (is_along ? (second.dot(across) < 0.0f ? Vec3f(-second) : second) : first);
    }
    Vec3f at(float x, float y) const { return x * x_ + y * y_; }  ///< x, y in [-1, 1]

  private:
    Vec3f x_, y_;
};

}  // namespace

DirectColumn direct_column(const EstimationScene& scene, std::span<const SurfacePoint> points,
                           const TrialLight& light, int sample_count, std::uint32_t opaque_mask,
                           std::uint32_t see_through_mask) {
    DirectColumn column;
    column.clear.assign(points.size(), 0.0f);
    column.through.assign(points.size(), 0.0f);
    const Frame frame(light.normal.cast<float>());
    const Vec3f centre = light.position_m.cast<float>();
    const float radius = static_cast<float>(light.radius_m);
    const std::vector<Vec2f> pattern = disc_pattern(sample_count);

    const auto add_sample = [&](const SurfacePoint& point, const Vec3f& origin, const Vec2f& disc,
                                Sums& sums) {
        const Vec3f source =
            centre + radius * (disc.x() * frame.tangent + disc.y() * frame.bitangent);
        const Vec3f to_light = source - origin;
        const float d2 = to_light.squaredNorm();
        const float d = std::sqrt(d2);
        const float cos_s = point.normal.dot(to_light) / d;
        const float cos_l = -frame.normal.dot(to_light) / d;
        if (cos_s <= 0.0f || cos_l <= 0.0f) return;
        // Clear of the roughness, but on the line from the surface to the lamp: a lifted origin
        // would shorten every shadow and so raise every lamp by half a degree.
        const float near = scene.offset_m() / (std::max(cos_s, kMinRayCos) * d);
        if (scene.accel().is_occluded({origin, to_light, near, 1.0f, opaque_mask})) return;
        const float e = cos_s * cos_l / d2;
        const bool is_through =
            see_through_mask != 0 &&
            scene.accel().is_occluded({origin, to_light, near, 1.0f, see_through_mask});
        (is_through ? sums.through : sums.clear) += e;
    };

    parallel_for(points.size(), 64, [&](std::size_t i) {
        const SurfacePoint& point = points[i];
        const Vec3f& origin = point.position;
        if (radius == 0.0f && point.footprint_m == 0.0f) {
            Sums one;
            add_sample(point, origin, Vec2f::Zero(), one);
            column.clear[i] = one.clear;
            column.through[i] = one.through;
            return;
        }
        const Footprint footprint(point, frame);
        Sums scouts;
        int lit = 0, dark = 0, behind = 0;
        for (int k = 0; k < kScoutSamples; ++k) {
            const Sums before = scouts;
            const Vec2f& p = pattern[static_cast<std::size_t>(k)];
            const Vec3f corner =
                footprint.at(std::copysign(1.0f, p.x()), std::copysign(1.0f, p.y()));
            add_sample(point, origin + corner, p, scouts);
            lit += scouts.clear > before.clear;
            behind += scouts.through > before.through;
            dark += scouts.clear == before.clear && scouts.through == before.through;
        }
        const bool is_uniform =
            lit == kScoutSamples || dark == kScoutSamples || behind == kScoutSamples;
        if (is_uniform) {
            column.clear[i] = scouts.clear / kScoutSamples;
            column.through[i] = scouts.through / kScoutSamples;
            return;
        }
        // The spiral is turned by a fixed angle per point, the footprint's samples shifted: no two
        // points share their banding.
        const float part = static_cast<float>(mix_bits(i) >> 40) * 0x1p-24f;
        const float turn = 2.0f * kPif * part;
        const float c = std::cos(turn), s = std::sin(turn);
        Sums sums;
        for (int k = 0; k < sample_count; ++k) {
            const Vec2f& p = pattern[static_cast<std::size_t>(kScoutSamples + k)];
            // Two by two on opposite sides: a mean off the middle would move every shadow, and with
            // them the lamp.
            const Vec2f q = r2_point(static_cast<std::size_t>(k / 2),
                                     Vec2f(part, std::fmod(7.0f * part, 1.0f)));
            const float side = k % 2 == 0 ? 1.0f : -1.0f;
            const Vec3f from =
                origin + side * footprint.at(2.0f * q.x() - 1.0f, 2.0f * q.y() - 1.0f);
            add_sample(point, from, Vec2f(c * p.x() - s * p.y(), s * p.x() + c * p.y()), sums);
        }
        column.clear[i] = sums.clear / static_cast<float>(sample_count);
        column.through[i] = sums.through / static_cast<float>(sample_count);
    });
    return column;
}

GatheredLight gather_light(const EstimationScene& scene, std::span<const SurfacePoint> points,
                           int ray_count, std::uint32_t see_through_mask,
                           std::span<const Rgb> object_radiance, std::uint64_t seed) {
    GatheredLight gathered;
    gathered.bounced.assign(points.size(), Rgb::Zero());
    gathered.openness.assign(points.size(), 0.0f);
    const std::uint32_t mask = kAllMask & ~see_through_mask;
    parallel_for(points.size(), 32, [&](std::size_t i) {
        const SurfacePoint& point = points[i];
        const Frame frame(point.normal);
        const Vec3f origin = point.position + scene.offset_m() * point.normal;
        const auto key = static_cast<std::uint32_t>(stream_key(seed, i));
        Rgb bounced = Rgb::Zero();
        int open = 0;
        for (int k = 0; k < ray_count; ++k) {
            const auto index = static_cast<std::uint32_t>(k);
            const Vec3f direction = frame.to_world(sample_cosine_hemisphere(
                {scrambled_sobol(index, 0, key), scrambled_sobol(index, 1, key)}));
            const Hit hit = scene.accel().closest({origin, direction, 0.0f, 1e30f, mask});
            if (!hit.is_hit()) {
                ++open;
            } else if (const int object = scene.object_of_part(hit.part); object >= 0) {
                if (static_cast<std::size_t>(object) < object_radiance.size())
                    bounced += object_radiance[static_cast<std::size_t>(object)];
            } else {
                bounced += *scene.scan_radiance(hit, direction);
            }
        }
        gathered.bounced[i] = bounced * (kPif / static_cast<float>(ray_count));
        gathered.openness[i] = kPif * static_cast<float>(open) / static_cast<float>(ray_count);
    });
    return gathered;
}

}  // namespace vitrine
