#include "render/estimation_caustic.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "math/sampling.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace vitrine {

namespace {

struct Photon {
    Vec3f position = Vec3f::Zero();
    Vec3f direction = Vec3f::Zero();
    Rgb power = Rgb::Zero();  // per W/sr of the light; zero: lost
};

Photon shoot(const EstimationScene& scene, int object, const TrialLight& light, std::uint64_t index,
             std::uint32_t opaque_mask, const TrialCaustic& options) {
    Photon photon;
    const Frame lamp(light.normal.cast<float>());
    const Box3& box = scene.object_bounds(object);
    const Vec3f target = box.centre().cast<float>();
    const float radius = static_cast<float>(box.radius());

    const Vec2f on_disc = sample_concentric_disc(
        {halton(index + 1, 2), halton(index + 1, 3)});  // bases 5 and 7, apart from the R2 pair
    const Vec3f source = light.position_m.cast<float>() +
                         static_cast<float>(light.radius_m) *
                             (on_disc.x() * lamp.tangent + on_disc.y() * lamp.bitangent);
    const Vec3f axis = target - source;
    const float distance = axis.norm();
    if (distance <= radius) return photon;  // light inside the object's sphere: no cone
    const float cos_max = std::sqrt(1.0f - (radius / distance) * (radius / distance));
    const Vec3f direction =
        Frame(axis / distance).to_world(sample_uniform_cone(r2_point(index), cos_max));
    const float cos_l = lamp.normal.dot(direction);
    if (cos_l <= 0.0f) return photon;
    const RefractedPath path =
        options.is_shell
            ? pass_through_shell(scene, object, source, direction, static_cast<float>(options.ior),
                                 static_cast<float>(options.wall_m))
            : refract_through(scene, object, source, direction, static_cast<float>(options.ior));
    if (!path.is_valid) return photon;
    if (scene.accel().is_occluded({source, path.entry - source, 0.0f, 0.999f, opaque_mask}))
        return photon;
    const Hit hit = scan_behind(scene, path, scene.offset_m());
    if (!hit.is_hit() || hit.normal.dot(path.exit_direction) >= 0.0f) return photon;
    const double solid_angle = cone_solid_angle(std::asin(radius / distance));
    photon.position = hit_point(scene.mesh(hit.part), hit);
    photon.direction = path.exit_direction;
    photon.power = (-options.sigma_a_per_m * path.length_m).exp() * path.transmittance * cos_l *
                   static_cast<float>(solid_angle / options.photon_count);
    return photon;
}

struct Cell {
    int x, y, z;
    bool operator==(const Cell&) const = default;
};
struct CellHash {
    std::size_t operator()(const Cell& c) const {
        return static_cast<std::size_t>(stream_key(static_cast<std::uint64_t>(c.x),
                                                   static_cast<std::uint64_t>(c.y),
                                                   static_cast<std::uint64_t>(c.z)));
    }
};
Cell cell_of(const Vec3f& p, float size) {
    return {static_cast<int>(std::floor(p.x() / size)), static_cast<int>(std::floor(p.y() / size)),
            static_cast<int>(std::floor(p.z() / size))};
}

}  // namespace

std::vector<Rgb> caustic_irradiance(const EstimationScene& scene, int object,
                                    const TrialLight& light, std::span<const SurfacePoint> points,
                                    std::uint32_t opaque_mask, const TrialCaustic& options) {
    std::vector<Photon> photons(static_cast<std::size_t>(options.photon_count));
    parallel_for(photons.size(), 1024, [&](std::size_t i) {
        photons[i] = shoot(scene, object, light, i, opaque_mask, options);
    });

    // Cells of one kernel radius, photons in index order within each: sums do not depend on
    // threads.
    const float radius = static_cast<float>(options.gather_radius_m);
    std::unordered_map<Cell, std::vector<std::uint32_t>, CellHash> cells;
    for (std::size_t i = 0; i < photons.size(); ++i)
        if (photons[i].power[0] + photons[i].power[1] + photons[i].power[2] > 0.0f)
            cells[cell_of(photons[i].position, radius)].push_back(static_cast<std::uint32_t>(i));

    std::vector<Rgb> irradiance(points.size(), Rgb::Zero());
    const float area = kPif * radius * radius;
    parallel_for(points.size(), 256, [&](std::size_t i) {
        const Cell centre = cell_of(points[i].position, radius);
        Rgb sum = Rgb::Zero();
        for (int dz = -1; dz <= 1; ++dz)
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) {
                    const auto cell = cells.find({centre.x + dx, centre.y + dy, centre.z + dz});
                    if (cell == cells.end()) continue;
                    for (const std::uint32_t k : cell->second) {
                        const float d2 = (photons[k].position - points[i].position).squaredNorm();
                        if (d2 >= radius * radius) continue;
                        if (points[i].normal.dot(photons[k].direction) >= 0.0f) continue;
                        sum += photons[k].power * (2.0f * (1.0f - d2 / (radius * radius)));
                    }
                }
        irradiance[i] = sum / area;  // Epanechnikov kernel: 2 (1 - d2/r2) integrates to pi r2
    });
    return irradiance;
}

}  // namespace vitrine
