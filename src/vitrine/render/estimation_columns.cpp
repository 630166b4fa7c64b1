#include "render/estimation_columns.h"

#include "base/parallel.h"
#include "base/rng.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

namespace vitrine {
namespace {

constexpr float kCellsPerRadius = 3.0f;
constexpr float kMinFacing = 0.3f;  // cosine: 73 degrees

/// Dominant axis and sign of a normal: 0 .. 5.
int facing_of(const Vec3f& normal) {
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    return 2 * axis + (normal[axis] < 0 ? 1 : 0);
}

/// Cells hold a layer across the facing's axis and share a photon between four along it.
struct CellPlace {
    Eigen::Vector3i base;     // lowest of the four cells
    float share[2] = {0, 0};  // of the higher one, along the two other axes
};

CellPlace place_of(const Vec3f& position, int axis, float cell_m) {
    CellPlace place;
    const Vec3f scaled = position / cell_m;
    int other = 0;
    for (int c = 0; c < 3; ++c) {
        if (c == axis) {
            place.base[c] = static_cast<int>(std::floor(scaled[c] + 0.5f));
            continue;
        }
        const float low = std::floor(scaled[c]);
        place.base[c] = static_cast<int>(low);
        place.share[other++] = scaled[c] - low;
    }
    return place;
}

}  // namespace

std::size_t ReceiverGrid::KeyHash::operator()(const Key& key) const {
    const auto pair = [](std::int32_t a, std::int32_t b) {
        return std::uint64_t{static_cast<std::uint32_t>(a)} << 32 | static_cast<std::uint32_t>(b);
    };
    return static_cast<std::size_t>(
        mix_bits(pair(key.x, key.y) ^ mix_bits(pair(key.z, key.facing))));
}

ReceiverGrid::ReceiverGrid(std::span<const SurfacePoint> receivers, double gather_radius_m)
    : cell_m_(static_cast<float>(gather_radius_m) / kCellsPerRadius) {
    const auto radius = static_cast<float>(gather_radius_m);
    const int reach = static_cast<int>(kCellsPerRadius) + 1;
    // Sharing photons between cells blurs by a tent of one cell; the kernel gives way, so that both
    // together have the variance of a kernel of the radius asked for (r2/6 and h2/6 per axis).
    const float kernel2 = radius * radius - cell_m_ * cell_m_;
    const float scale = 2.0f / (kPif * kernel2);
    start_.push_back(0);
    for (const SurfacePoint& receiver : receivers) {
        for (int facing = 0; facing < 6; ++facing) {
            const int axis = facing / 2;
            const float sign = facing % 2 == 0 ? 1.0f : -1.0f;
            if (sign * receiver.normal[axis] < kMinFacing) continue;
            const CellPlace centre = place_of(receiver.position, axis, cell_m_);
            // A photon on the tangent plane is put at most half a layer off along the axis and one
            // cell off along the others.
            const float slack =
                cell_m_ * (receiver.normal.cwiseAbs().sum() - 0.45f * sign * receiver.normal[axis]);
            Eigen::Vector3i d;
            for (d.z() = -reach; d.z() <= reach; ++d.z()) {
                for (d.y() = -reach; d.y() <= reach; ++d.y()) {
                    for (d.x() = -reach; d.x() <= reach; ++d.x()) {
                        const Eigen::Vector3i cell = centre.base + d;
                        const Vec3f offset = cell.cast<float>() * cell_m_ - receiver.position;
                        // Distance along the surface: a layer's height must not cost weight.
                        const float height = offset.dot(receiver.normal);
                        const float distance2 = offset.squaredNorm() - height * height;
                        if (distance2 >= kernel2) continue;
                        if (std::abs(height) > slack) continue;
                        const auto next = static_cast<std::uint32_t>(cells_.size());
                        const auto [found, is_new] =
                            cells_.try_emplace(Key{cell.x(), cell.y(), cell.z(), facing}, next);
                        shares_.push_back({found->second, scale * (1.0f - distance2 / kernel2)});
                    }
                }
            }
        }
        start_.push_back(shares_.size());
    }
}

std::vector<Rgb> ReceiverGrid::gather(std::span<const BeamArrival> arrivals) const {
    std::vector<Rgb> power(cells_.size(), Rgb::Zero());
    for (const BeamArrival& photon : arrivals) {
        if (!(photon.power > 0).any()) continue;
        const int facing = facing_of(photon.normal);
        const int axis = facing / 2;
        const int first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
        const CellPlace place = place_of(photon.position, axis, cell_m_);
        for (int corner = 0; corner < 4; ++corner) {
            Eigen::Vector3i cell = place.base;
            const int a = corner & 1, b = corner >> 1;
            cell[first] += a;
            cell[second] += b;
            const auto found = cells_.find({cell.x(), cell.y(), cell.z(), facing});
            if (found == cells_.end()) continue;
            const float share = (a ? place.share[0] : 1 - place.share[0]) *
                                (b ? place.share[1] : 1 - place.share[1]);
            power[found->second] += share * photon.power;
        }
    }
    std::vector<Rgb> irradiance(size());
    parallel_for(size(), 4096, [&](std::size_t i) {
        Rgb sum = Rgb::Zero();
        for (std::size_t k = start_[i]; k < start_[i + 1]; ++k) {
            sum += shares_[k].weight * power[shares_[k].cell];
        }
        irradiance[i] = sum;
    });
    return irradiance;
}

std::vector<Rgb> CausticColumns::at(double ior, const Rgb& sigma_a_per_m) const {
    return receivers_->gather(beam_.arrivals(ior, sigma_a_per_m));
}

std::vector<std::vector<Rgb>> CausticColumns::at(std::span<const double> iors,
                                                 const Rgb& sigma_a_per_m) const {
    std::vector<std::vector<Rgb>> columns(iors.size());
    parallel_for(iors.size(), 1, [&](std::size_t i) { columns[i] = at(iors[i], sigma_a_per_m); });
    return columns;
}

ViewReceivers caustic_receivers(const EstimationScene& scene, int object,
                                std::span<const Camera> cameras, const TrialLight& light,
                                std::span<const double> iors, std::uint32_t opaque_mask,
                                const ReceiverOptions& options) {
    constexpr int kPilotPhotons = 20'000;
    constexpr std::size_t kPilotIndices = 5;
    CausticBeamOptions pilot;
    pilot.photon_count = kPilotPhotons;
    const CausticBeam beam(scene, object, light, opaque_mask, pilot);
    const auto cell_m = static_cast<float>(options.margin_m);
    using Cell = std::tuple<int, int, int>;
    const auto cell_of = [&](const Vec3f& p) {
        return Cell{static_cast<int>(std::floor(p.x() / cell_m)),
                    static_cast<int>(std::floor(p.y() / cell_m)),
                    static_cast<int>(std::floor(p.z() / cell_m))};
    };
    std::vector<double> trials = {1.0};  // straight through: the shadow
    for (std::size_t k = 0; k < std::min(kPilotIndices, iors.size()); ++k) {
        trials.push_back(iors[k * (iors.size() - 1) / std::max<std::size_t>(1, kPilotIndices - 1)]);
    }
    const double distance2 =
        (scene.object_bounds(object).centre() - light.position_m).squaredNorm();
    std::set<Cell> lit;
    for (const double ior : trials) {
        std::map<Cell, double> power;
        for (const BeamArrival& photon : beam.arrivals(ior)) {
            if ((photon.power > 0).any()) power[cell_of(photon.position)] += photon.power.mean();
        }
        for (const auto& [cell, watt] : power) {
            if (watt > options.min_share / distance2 * cell_m * cell_m) lit.insert(cell);
        }
    }
    std::set<Cell> wide;

    for (const auto& [x, y, z] : lit) {
        for (int dz = -1; dz <= 1; ++dz) {
            for (int dy = -1; dy <= 1; ++dy) {
                for (int dx = -1; dx <= 1; ++dx) {
                    wide.insert({x + dx, y + dy, z + dz});
                }
            }
        }
    }
    ViewReceivers receivers;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
        const Camera& camera = cameras[c];
        const Vec3f origin = camera.centre_in_world().cast<float>();
        const int columns = (camera.width + options.pixel_step - 1) / options.pixel_step;
        const int rows = (camera.height + options.pixel_step - 1) / options.pixel_step;
        std::vector<std::vector<std::pair<int, SurfacePoint>>> found(
            static_cast<std::size_t>(rows));
        parallel_for(found.size(), 4, [&](std::size_t row) {
            const int y = static_cast<int>(row) * options.pixel_step;
            for (int k = 0; k < columns; ++k) {
                const int x = k * options.pixel_step;
                const Vec3f direction = camera.ray_in_world(x, y).cast<float>();
                const Hit hit = scene.accel().closest({origin, direction, 0.0f, 1e30f, kAllMask});
                if (!hit.is_hit() || scene.object_of_part(hit.part) >= 0) continue;
                if (hit.normal.dot(direction) >= 0) continue;
                const Mesh& mesh = scene.mesh(hit.part);
                const Vec3f position = hit_point(mesh, hit);
                if (!wide.contains(cell_of(position))) continue;
                found[row].push_back({x, {position, shading_normal(mesh, hit)}});
            }
        });
        for (int row = 0; row < rows; ++row) {
            for (const auto& [x, point] : found[static_cast<std::size_t>(row)]) {
                receivers.points.push_back(point);
                receivers.camera.push_back(static_cast<int>(c));
                receivers.x.push_back(x);
                receivers.y.push_back(row * options.pixel_step);
            }
        }
    }
    return receivers;
}

}  // namespace vitrine
