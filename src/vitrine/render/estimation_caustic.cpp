#include "render/estimation_caustic.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "math/sampling.h"
#include "optics/fresnel.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace vitrine {

std::optional<CausticBeam::Entry> CausticBeam::shoot(std::uint64_t index,
                                                     std::uint32_t opaque_mask) const {
    const Frame lamp(light_.normal.cast<float>());
    const float radius = target_radius_;
    const Vec2f on_disc = sample_concentric_disc(
        {halton(index + 1, 2), halton(index + 1, 3)});  // bases 5 and 7, apart from the R2 pair
    Entry entry;
    entry.source = light_.position_m.cast<float>() +
                   static_cast<float>(light_.radius_m) *
                       (on_disc.x() * lamp.tangent + on_disc.y() * lamp.bitangent);
    const Vec3f axis = target_ - entry.source;
    const float distance = axis.norm();
    if (distance <= radius) return std::nullopt;  // light inside the object's sphere: no cone
    const float cos_max = std::sqrt(1.0f - (radius / distance) * (radius / distance));
    const Vec3f direction =
        Frame(axis / distance).to_world(sample_uniform_cone(r2_point(index), cos_max));
    const float cos_l = lamp.normal.dot(direction);
    if (cos_l <= 0.0f) return std::nullopt;
    entry.entry = enter_object(scene_, object_, entry.source, direction);
    if (options_.is_shell ? !entry.entry.is_hit : !entry.entry.is_valid) return std::nullopt;
    if (scene_.accel().is_occluded(
            {entry.source, entry.entry.point - entry.source, 0.0f, 0.999f, opaque_mask}))
        return std::nullopt;
    const double solid_angle = cone_solid_angle(std::asin(radius / distance));
    entry.power = cos_l * static_cast<float>(solid_angle / options_.photon_count);
    if (!options_.is_shell) {
        entry.mirrored = reflect_at(entry.entry);
        entry.mirrored.power *= entry.power;
    }
    return entry;
}

BeamArrival CausticBeam::reflect_at(const ObjectEntry& entry) const {
    BeamArrival arrival;
    const Vec3f direction = reflect(-entry.direction, entry.normal);
    const Hit hit =
        scene_.accel().closest({entry.point + scene_.offset_m() * entry.normal, direction, 0.0f,
                                1e30f, kScanMask | object_mask(object_)});
    if (!hit.is_hit() || scene_.object_of_part(hit.part) >= 0 || hit.normal.dot(direction) >= 0)
        return arrival;
    arrival.position = hit_point(scene_.mesh(hit.part), hit);
    arrival.direction = direction;
    arrival.normal = hit.normal;
    arrival.power = Rgb::Ones();
    return arrival;
}

CausticBeam::CausticBeam(const EstimationScene& scene, int object, const TrialLight& light,
                         std::uint32_t opaque_mask, const CausticBeamOptions& options)
    : scene_(scene), object_(object), light_(light), options_(options) {
    target_ = scene.object_bounds(object).centre().cast<float>();
    for (const Vec3f& v : scene.mesh(scene.part_of_object(object)).vertices)
        target_radius_ = std::max(target_radius_, (v - target_).norm());
    std::vector<std::optional<Entry>> shot(static_cast<std::size_t>(options.photon_count));
    parallel_for(shot.size(), 1024, [&](std::size_t i) { shot[i] = shoot(i, opaque_mask); });
    for (const std::optional<Entry>& entry : shot)
        if (entry) entries_.push_back(*entry);
}

BeamArrival CausticBeam::arrive(const Entry& entry, float ior, const Rgb& sigma_a,
                                int skipped_exits) const {
    BeamArrival arrival;
    const RefractedPath path =
        options_.is_shell ? pass_through_shell(scene_, object_, entry.source, entry.entry.direction,
                                               ior, static_cast<float>(options_.wall_m))
                          : refract_from(scene_, object_, entry.entry, ior, skipped_exits);
    if (!path.is_valid) return arrival;
    const Hit hit = scan_behind(scene_, path, scene_.offset_m());
    if (!hit.is_hit() || hit.normal.dot(path.exit_direction) >= 0.0f) return arrival;
    arrival.position = hit_point(scene_.mesh(hit.part), hit);
    arrival.direction = path.exit_direction;
    arrival.normal = hit.normal;
    const float passed = options_.has_fresnel ? path.transmittance : 1.0f;
    arrival.power = (-sigma_a * path.length_m).exp() * passed * entry.power;
    return arrival;
}

std::vector<BeamArrival> CausticBeam::arrivals(double ior, const Rgb& sigma_a_per_m) const {
    const auto eta = static_cast<float>(ior);
    const auto ways = static_cast<std::size_t>(options_.is_shell ? 1 : 1 + options_.max_exits);
    std::vector<BeamArrival> arrivals(entries_.size() * ways);
    parallel_for(entries_.size(), 1024, [&](std::size_t i) {
        const Entry& entry = entries_[i];
        BeamArrival* out = &arrivals[i * ways];
        if (!options_.is_shell) {
            *out = entry.mirrored;
            out->power *=
                options_.has_fresnel
                    ? fresnel_dielectric(-entry.entry.normal.dot(entry.entry.direction), eta)
                    : 0.0f;
            ++out;
        }
        const int exits = options_.is_shell ? 1 : options_.max_exits;
        for (int way = 0; way < exits; ++way) *out++ = arrive(entry, eta, sigma_a_per_m, way);
    });
    return arrivals;
}

namespace {

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
    CausticBeamOptions beam;
    beam.photon_count = options.photon_count;
    beam.is_shell = options.is_shell;
    beam.wall_m = options.wall_m;
    const std::vector<BeamArrival> photons = CausticBeam(scene, object, light, opaque_mask, beam)
                                                 .arrivals(options.ior, options.sigma_a_per_m);

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
