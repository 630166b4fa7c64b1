#include "estimate/paper_caustics.h"

#include "math/statistics.h"
#include "render/estimation_columns.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr double kStretch = 4.0;   // of the box, along the support plane
constexpr double kLitShare = 0.5;  // of the brightest receiver: in full light
constexpr int kMinConePhotons = 64;
constexpr double kGatherRadius = 0.004;  // metres, about two pixels seen from a metre

}  // namespace

CausticReceivers find_receivers(const ObjectContext& context, int object, const SupportPlane& plane,
                                int pixels_per_view) {
    const Box3& box = context.world.object_bounds(object);
    const Vec3 centre = box.centre();
    const double radius = 0.5 * kStretch * box.size().head<2>().maxCoeff();
    const double height = box.size().norm();
    CausticReceivers receivers;
    for (const Camera& camera : context.lookup.cameras()) {
        const int stride =
            std::max(1, static_cast<int>(std::sqrt(static_cast<double>(camera.width) *
                                                   camera.height / (8.0 * pixels_per_view))));
        const Vec3f eye = camera.centre_in_world().cast<float>();
        std::vector<SurfacePoint> here;
        for (int v = stride / 2; v < camera.height; v += stride)
            for (int u = stride / 2; u < camera.width; u += stride) {
                const Vec3f direction = camera.ray_in_world(u, v).cast<float>();
                const Hit hit =
                    context.world.accel().closest({eye, direction, 0.0f, 1e30f, kAllMask});
                if (!hit.is_hit() || context.world.object_of_part(hit.part) >= 0) continue;
                const Mesh& mesh = context.world.mesh(hit.part);
                const SurfacePoint point{hit_point(mesh, hit), shading_normal(mesh, hit)};
                const Vec3 offset = point.position.cast<double>() - centre;
                const double up = plane.normal.dot(offset);
                if ((offset - up * plane.normal).norm() > radius || std::abs(up) > height) continue;
                here.push_back(point);
            }
        for (const SurfacePoint& point : here) {
            const FrameLookup::Seen seen = context.lookup.observe(point);
            if (seen.views + seen.saturated == 0) continue;
            receivers.points.push_back(point);
            receivers.luminance.push_back(
                seen.saturated > seen.views ? static_cast<float>(context.lookup.saturation_level())
                                            : vitrine::luminance(seen.radiance));
        }
    }
    return receivers;
}

double receiver_reflectance(const ObjectContext& context, const CausticReceivers& receivers) {
    std::vector<double> irradiance(receivers.points.size(), 0.0);
    for (const DiscLight& lamp : context.light.lights) {
        const DirectColumn column =
            direct_column(context.world, receivers.points,
                          {lamp.position_m, lamp.normal, lamp.radius_m}, 8, kAllMask, 0);
        for (std::size_t i = 0; i < irradiance.size(); ++i)
            irradiance[i] += vitrine::luminance(lamp.intensity_w_per_sr) * column.clear[i];
    }
    const double brightest =
        irradiance.empty() ? 0.0 : *std::max_element(irradiance.begin(), irradiance.end());
    std::vector<double> ratio;
    for (std::size_t i = 0; i < irradiance.size(); ++i)
        if (irradiance[i] > kLitShare * brightest)
            ratio.push_back(receivers.luminance[i] / irradiance[i]);
    return ratio.empty() ? 0.0 : median(ratio);
}

std::vector<double> ior_grid(const PaperCausticOptions& options) {
    std::vector<double> grid;
    for (int k = 0; options.ior_min + k * options.ior_step < options.ior_max + 1e-9; ++k)
        grid.push_back(options.ior_min + k * options.ior_step);
    return grid;
}

int photons_in_cone(const EstimationScene& scene, int object, const Vec3& light_position_m,
                    double photon_count) {
    const Box3& box = scene.object_bounds(object);
    const double sine = box.radius() / (box.centre() - light_position_m).norm();
    if (sine >= 1.0) return static_cast<int>(photon_count);
    const double share = 1.0 - std::sqrt(1.0 - sine * sine);  // of the half space
    return std::max(kMinConePhotons, static_cast<int>(std::lround(share * photon_count)));
}

std::vector<std::vector<double>> caustic_errors(const ObjectContext& context, int object,
                                                const CausticReceivers& receivers,
                                                const std::vector<std::vector<TrialLight>>& places,
                                                const std::vector<double>& intensities,
                                                double reflectance,
                                                const PaperCausticOptions& options) {
    const std::vector<double> iors = ior_grid(options);
    const std::size_t n = receivers.points.size();
    const auto clip = static_cast<float>(context.lookup.saturation_level());
    const std::size_t place_count = places.front().size();
    std::size_t combination_count = 1;
    for (std::size_t l = 0; l < places.size(); ++l) combination_count *= place_count;
    std::vector<std::vector<double>> errors(combination_count,
                                            std::vector<double>(iors.size(), 0.0));

    std::vector<std::vector<std::vector<float>>> direct(places.size());
    for (std::size_t l = 0; l < places.size(); ++l)
        for (const TrialLight& place : places[l])
            direct[l].push_back(
                direct_column(context.world, receivers.points, place, 1, kAllMask, 0).clear);
    // One unit image per light, place and index, used in every combination.
    const auto grid = std::make_shared<const ReceiverGrid>(receivers.points, kGatherRadius);
    std::vector<std::vector<std::vector<std::vector<Rgb>>>> bent(places.size());
    for (std::size_t l = 0; l < places.size(); ++l)
        for (const TrialLight& place : places[l]) {
            CausticBeamOptions beam;
            beam.has_fresnel = false;
            beam.photon_count =
                photons_in_cone(context.world, object, place.position_m, options.photon_count);
            const CausticColumns columns(
                CausticBeam(context.world, object, place,
                            options.opaque_mask & ~object_mask(object), beam),
                grid);
            bent[l].push_back(columns.at(iors));
        }
    for (std::size_t m = 0; m < iors.size(); ++m) {
        std::vector<std::vector<std::vector<float>>> unit = direct;
        for (std::size_t l = 0; l < places.size(); ++l)
            for (std::size_t p = 0; p < place_count; ++p)
                for (std::size_t i = 0; i < n; ++i) unit[l][p][i] += bent[l][p][m][i][1];
        for (std::size_t combination = 0; combination < combination_count; ++combination) {
            std::vector<const std::vector<float>*> columns(places.size());
            std::size_t rest = combination;
            for (std::size_t l = places.size(); l-- > 0; rest /= place_count)
                columns[l] = &unit[l][rest % place_count];
            double sum = 0.0;
            for (std::size_t i = 0; i < n; ++i) {
                double e = 0.0;
                for (std::size_t l = 0; l < columns.size(); ++l)
                    e += intensities[l] * (*columns[l])[i];
                const double model = std::min<double>(reflectance * e, clip);
                const double difference = model - receivers.luminance[i];
                sum += difference * difference;
            }
            errors[combination][m] = sum;
        }
    }
    return errors;
}

}  // namespace vitrine
