#include "render/relief_light.h"

#include "base/parallel.h"
#include "render/ball_bounce.h"

#include <algorithm>

namespace vitrine {
namespace {

bool is_hidden_by_balls(const Relief& relief, std::size_t own, const Vec3f& point,
                        const Vec3f& direction) {
    const auto is_in_the_way = [&](std::size_t k, const Ball& ball) {
        const BallAhead ahead(k, ball, point);
        return ahead.is_met(ahead.to_centre.dot(direction));
    };
    for (std::size_t k = 0; k < relief.balls.size(); ++k)
        if (k != own && is_in_the_way(k, relief.balls[k])) return true;
    return std::any_of(relief.unseen_balls.begin(), relief.unseen_balls.end(),
                       [&](const Ball& ball) { return is_in_the_way(0, ball); });
}

bool is_hidden_by_relief(const Relief& relief, float top, const Vec3f& point, const Vec3f& normal,
                         const Vec3f& direction) {
    const auto radius = static_cast<float>(relief.inradius_px);
    const float step = std::max(1.0f, 0.05f * radius);
    const float flat = std::hypot(direction.x(), direction.y());
    // Clear of the surface first: samples and depth differ by a cell.
    const Vec3f start = point + 0.06f * radius * normal;
    for (int k = 1; k < 200; ++k) {
        const Vec3f p = start + (static_cast<float>(k) * step / std::max(flat, 0.2f)) * direction;
        if (std::abs(p.z()) > top) return false;
        if (p.x() < -0.5f || p.y() > 0.5f) return false;  // what follows rounds positive numbers
        const int x = static_cast<int>(p.x() + 0.5f);
        const int y = static_cast<int>(0.5f - p.y());
        if (!relief.mask.contains(x, y)) return false;
        if (is_inside(relief.mask, x, y) && p.z() < relief.depth_px(x, y) &&
            p.z() > relief.back_px(x, y)) {
            return true;
        }
    }
    return false;
}

}  // namespace

std::vector<Vec3> fibonacci_directions(int count, double z_min) {
    std::vector<Vec3> directions;
    const double golden = kPi * (3 - std::sqrt(5.0));
    for (int i = 0; i < count; ++i) {
        const double z = 1 - (1 - z_min) * (i + 0.5) / count;
        const double rho = std::sqrt(std::max(0.0, 1 - z * z));
        directions.emplace_back(rho * std::cos(golden * i), rho * std::sin(golden * i), z);
    }
    return directions;
}

Occluder::Occluder(const Relief& relief) : relief_(relief) {
    if (relief.is_cluster()) return;
    for (int y = 0; y < relief.mask.height(); ++y) {
        for (int x = 0; x < relief.mask.width(); ++x) {
            if (!is_inside(relief.mask, x, y)) continue;
            top_ =
                std::max({top_, std::abs(relief.depth_px(x, y)), std::abs(relief.back_px(x, y))});
        }
    }
}

std::vector<float> Occluder::visibility(const SurfacePoints& points, const Vec3& direction) const {
    const Vec3f w = direction.cast<float>();
    std::vector<float> seen(points.position.size(), 1.0f);
    parallel_for(points.position.size(), 256, [&](std::size_t i) {
        const bool is_hidden =
            points.normal[i].dot(w) <= 0 ||
            (relief_.is_cluster()
                 ? is_hidden_by_balls(relief_, static_cast<std::size_t>(points.ball[i]),
                                      points.position[i], w)
                 : is_hidden_by_relief(relief_, top_, points.position[i], points.normal[i], w));
        if (is_hidden) seen[i] = 0;
    });
    return seen;
}

SkyShares sky_shares(const Occluder& occluder, const SurfacePoints& points, int direction_count) {
    const std::size_t count = points.position.size();
    std::vector<float> cosines(count, 0.0f), below(count, 0.0f);
    SkyShares shares{std::vector<float>(count, 0.0f), std::vector<float>(count, 0.0f)};
    for (const Vec3& direction : fibonacci_directions(direction_count, -1.0)) {
        const std::vector<float> seen = occluder.visibility(points, direction);
        const Vec3f w = direction.cast<float>();
        for (std::size_t i = 0; i < count; ++i) {
            const float cosine = std::max(0.0f, points.normal[i].dot(w));
            cosines[i] += cosine;
            shares.ambient[i] += cosine * seen[i];
            if (w.y() >= 0) continue;
            below[i] += cosine;
            shares.below[i] += cosine * seen[i];
        }
    }
    for (std::size_t i = 0; i < count; ++i) {
        shares.ambient[i] /= std::max(cosines[i], 1e-6f);
        // Directions only say which part is hidden; what an open surface gets is known exactly.
        shares.below[i] *= facing_down(points.normal[i]) / std::max(below[i], 1e-6f);
    }
    return shares;
}

std::vector<Rgb> lamp_light(const Occluder& occluder, const SurfacePoints& points,
                            const ViewLights& lights, double eta, bool use_shadows) {
    const std::size_t count = points.position.size();
    std::vector<Rgb> result(count, Rgb::Zero());
    for (const ViewLight& light : lights.lights) {
        std::vector<float> seen(count, 1.0f);
        if (use_shadows) seen = occluder.visibility(points, light.direction);
        for (std::size_t i = 0; i < count; ++i) {
            if (seen[i] == 0) continue;
            const double e = entering_irradiance(points.normal[i], light.direction, eta) * seen[i];
            result[i] += (light.intensity * e).cast<float>();
        }
    }
    return result;
}

std::vector<Rgb> entering_light(const Relief& relief, const SurfacePoints& points,
                                const ViewLights& lights, double eta, bool use_shadows) {
    const Occluder occluder(relief);
    const std::size_t count = points.position.size();
    std::vector<Rgb> result = lamp_light(occluder, points, lights, eta, use_shadows);
    if (use_shadows && relief.is_cluster()) {
        const std::vector<Rgb> soft = SoftBallLight(relief, lights, eta).at(points);
        for (std::size_t i = 0; i < count; ++i) result[i] += soft[i];
        return result;
    }
    SkyShares sky;
    if (use_shadows) {
        sky = sky_shares(occluder, points);
    } else {
        sky.ambient.assign(count, 1.0f);
        for (const Vec3f& normal : points.normal) sky.below.push_back(facing_down(normal));
    }
    for (std::size_t i = 0; i < count; ++i) result[i] += sky_light(lights, sky, i);
    return result;
}

}  // namespace vitrine
