#include "estimate/grid_lights.h"

#include "estimate/light_data.h"
#include "estimate/light_search.h"
#include "math/nnls.h"
#include "render/hemisphere_photons.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace vitrine {

namespace {

constexpr double kPointRadius = 1e-3;        // metres: a point, as the paper has it
constexpr double kMinSeparationCos = 0.906;  // 25 degrees, about the spacing of 36 lights
constexpr double kMeanAlbedo = 0.5;          // assumed when no albedo is known

/// Unit-intensity irradiance of one grid light at all samples (and the reference, last).
std::vector<float> unit_column(const LightData& data, std::span<const SurfacePoint> points,
                               const Vec3& position, const LightOptions& options,
                               const GridLightOptions& grid_options, std::size_t index) {
    if (grid_options.model == GridLightModel::Photons) {
        HemispherePhotonOptions photons;
        photons.photon_count = grid_options.photon_count;
        photons.seed = options.seed + index;
        const Vec3 axis = (data.samples.reference_point - position).normalized();
        const PhotonTree tree(trace_hemisphere_photons(data.world, position, axis, photons));
        return photon_irradiance(tree, points, photons.photon_count, grid_options.nearest_count);
    }
    std::vector<float> column;
    for (const SurfacePoint& p : points) {
        const Vec3f to_light = position.cast<float>() - p.position;
        column.push_back(std::max(0.0f, p.normal.dot(to_light)) / std::pow(to_light.norm(), 3.0f));
    }
    return column;
}

/// Strongest first; a weaker one counts where it is no neighbour of a stronger one.
std::vector<std::size_t> local_maxima(const std::vector<Vec3>& directions,
                                      const std::vector<double>& intensity, int max_lights,
                                      double second_share) {
    std::vector<std::size_t> order(intensity.size()), chosen;
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return intensity[a] > intensity[b]; });
    for (const std::size_t j : order) {
        if (static_cast<int>(chosen.size()) == max_lights || intensity[j] <= 0.0) break;
        if (!chosen.empty() && intensity[j] < second_share * intensity[chosen[0]]) break;
        const bool is_apart = std::all_of(chosen.begin(), chosen.end(), [&](std::size_t other) {
            return directions[other].dot(directions[j]) < kMinSeparationCos;
        });
        if (is_apart) chosen.push_back(j);
    }
    return chosen;
}

/// Factor from the intensities with f = 1 to W/sr, per channel.
Rgb intensity_scale(const LightData& data, const std::vector<double>& irradiance) {
    Rgb scale;
    for (int c = 0; c < 3; ++c) {
        double se = 0.0, ee = 1e-12;
        for (std::size_t i = 0; i < data.samples.points.size(); ++i) {
            se += data.samples.radiance[i][c] * irradiance[i];
            ee += irradiance[i] * irradiance[i];
        }
        scale[c] = static_cast<float>(kPi * se / (ee * kMeanAlbedo));
        if (data.reference && irradiance.back() > 0.0)
            scale[c] = static_cast<float>(kPi * data.reference->radiance[c] /
                                          (data.reference->albedo[c] * irradiance.back()));
    }
    return scale;
}

}  // namespace

GridLightEstimate estimate_grid_lights(const Scene& scene, std::span<const RgbdFrame> frames,
                                       double saturation_level, const LightOptions& options,
                                       const GridLightOptions& grid_options,
                                       const Progress& progress) {
    const LightData data(scene, frames, saturation_level, options);
    GridLightEstimate result;
    result.light = data.start_estimate();
    if (!data.problem.empty()) return result;
    const ScanSamples& samples = data.samples;
    std::vector<SurfacePoint> points = samples.points;
    if (data.reference) points.push_back(data.reference->point);

    const HemisphereGrid grid = make_hemisphere(samples, options.candidate_count);
    const double radius = grid.distances_m.front();  // twice that of the scene, as in the paper
    const auto n = static_cast<Eigen::Index>(samples.points.size());
    const auto all = static_cast<Eigen::Index>(points.size());
    Eigen::MatrixXd columns(all, options.candidate_count);
    for (Eigen::Index j = 0; j < columns.cols(); ++j) {
        progress.update(static_cast<double>(j) / static_cast<double>(columns.cols()),
                        "photon maps of the trial lights");
        const auto index = static_cast<std::size_t>(j);
        result.positions_m.push_back(samples.reference_point + radius * grid.directions[index]);
        const std::vector<float> column =
            unit_column(data, points, result.positions_m.back(), options, grid_options, index);
        columns.col(j) =
            Eigen::Map<const Eigen::VectorXf>(column.data(), all).template cast<double>();
    }
    Eigen::VectorXd observed(n);
    for (Eigen::Index i = 0; i < n; ++i)
        observed[i] = luminance(samples.radiance[static_cast<std::size_t>(i)]);
    const Eigen::MatrixXd a = columns.topRows(n);
    const NnlsResult fit = solve_nnls_gram(a.transpose() * a, a.transpose() * observed);
    result.intensity.assign(fit.x.begin(), fit.x.end());
    for (std::size_t j = 0; j < result.intensity.size(); ++j)
        result.mean_direction += result.intensity[j] * grid.directions[j];
    if (result.mean_direction.norm() > 0.0) result.mean_direction.normalize();

    const std::vector<std::size_t> chosen = local_maxima(
        grid.directions, result.intensity, options.max_lights, grid_options.second_share);
    LightEstimate& light = result.light;
    if (chosen.empty()) {
        light.reason = "no light of the hemisphere explains the pictures";
        return result;
    }
    std::vector<double> irradiance(static_cast<std::size_t>(all), 0.0);
    for (const std::size_t j : chosen)
        for (std::size_t i = 0; i < irradiance.size(); ++i)
            irradiance[i] += result.intensity[j] *
                             columns(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    const Rgb scale = intensity_scale(data, irradiance);
    for (const std::size_t j : chosen) {
        FittedLight fitted;
        fitted.light = {result.positions_m[j], -grid.directions[j], kPointRadius,
                        static_cast<float>(result.intensity[j]) * scale};
        // All it can say: somewhere in its cell of the hemisphere.
        fitted.stddev_direction_deg = degrees(std::sqrt(1.0 / options.candidate_count));
        fitted.stddev_distance_m = 0.5 * radius;
        fitted.outcome = Outcome::Converged;
        light.lights.push_back(fitted);
    }
    light.grid_direction = grid.directions[chosen[0]];
    light.error_initial = light.error_refined =
        (a * fit.x - observed).squaredNorm() / std::max(observed.squaredNorm(), 1e-12);
    light.residual_rms = std::sqrt(light.error_initial);
    light.outcome = Outcome::Converged;
    progress.update(1.0);
    return result;
}

}  // namespace vitrine
