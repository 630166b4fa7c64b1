#include "estimate/paper_method.h"

#include "base/parallel.h"
#include "base/timer.h"
#include "estimate/light_combinations.h"
#include "estimate/object_context.h"
#include "estimate/paper_caustics.h"
#include "estimate/paper_rule.h"
#include "optics/ward.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace vitrine {

namespace {

constexpr float kMinViewCos = 0.2f;                  // flatter: normals of a hull are wrong there
constexpr double kSigmaMin = 0.01, kSigmaMax = 1.0;  // Eq. 12, without its singular end
constexpr double kCap = 0.25;                        // as in the default method's costs

double sigma_at(int index, int count) {
    return kSigmaMin * std::pow(kSigmaMax / kSigmaMin, static_cast<double>(index) / (count - 1));
}

/// Each light where it was found, then a ring of g places around it on the hemisphere.
std::vector<std::vector<TrialLight>> places_of(const LightEstimate& light,
                                               const PaperOptions& options) {
    std::vector<std::vector<TrialLight>> places;
    for (const FittedLight& fitted : light.lights) {
        const Vec3 offset = fitted.light.position_m - light.reference_point_m;
        const Frame frame(offset.normalized().cast<float>());
        const double tilt = std::tan(radians(options.local_radius_deg));
        std::vector<TrialLight> here;
        for (int k = 0; k <= options.local_samples; ++k) {
            Vec3 direction = offset.normalized();
            if (k > 0) {
                const double angle = 2.0 * kPi * k / options.local_samples;
                direction += tilt * (std::cos(angle) * frame.tangent.cast<double>() +
                                     std::sin(angle) * frame.bitangent.cast<double>());
                direction.normalize();
            }
            here.push_back({light.reference_point_m + offset.norm() * direction, -direction, 0.0});
        }
        places.push_back(here);
    }
    return places;
}

/// Columns of one metal: pixels that are neither clipped nor seen too flat.
struct MetalColumns {
    CombinationColumns columns;
    std::vector<const ObjectPixel*> pixels;
};

MetalColumns metal_columns(const ObjectContext& context, int object,
                           const std::vector<ObjectPixel>& pixels,
                           const std::vector<std::vector<TrialLight>>& places,
                           const PaperOptions& options) {
    MetalColumns metal;
    std::vector<SurfacePoint> points;
    for (const ObjectPixel& p : pixels)
        if (!p.is_clipped && -p.direction.dot(p.surface.normal) > kMinViewCos) {
            metal.pixels.push_back(&p);
            points.push_back(p.surface);
        }
    const auto n = static_cast<Eigen::Index>(points.size());
    const auto place_count = static_cast<Eigen::Index>(places.front().size());
    CombinationColumns& columns = metal.columns;
    columns.light_count = static_cast<int>(places.size());
    columns.place_count = static_cast<int>(place_count);
    columns.observed.resize(n);
    for (Eigen::Index i = 0; i < n; ++i)
        columns.observed[i] = luminance(metal.pixels[static_cast<std::size_t>(i)]->radiance);
    columns.diffuse.setZero(n, columns.light_count * place_count);
    columns.lobe.assign(static_cast<std::size_t>(options.roughness_count), columns.diffuse);
    const std::uint32_t opaque = kScanMask | object_mask(object);
    for (std::size_t l = 0; l < places.size(); ++l)
        for (std::size_t p = 0; p < places[l].size(); ++p) {
            const auto j =
                static_cast<Eigen::Index>(l) * place_count + static_cast<Eigen::Index>(p);
            const std::vector<float> lit =
                direct_column(context.world, points, places[l][p], 1, opaque, 0).clear;
            parallel_for(points.size(), 64, [&](std::size_t i) {
                const auto row = static_cast<Eigen::Index>(i);
                columns.diffuse(row, j) = lit[i] / kPi;
                if (lit[i] <= 0.0f) return;
                const Frame frame(points[i].normal);
                const Vec3 wo = frame.to_local(-metal.pixels[i]->direction).cast<double>();
                const Vec3f to_light = places[l][p].position_m.cast<float>() - points[i].position;
                const Vec3 wi = frame.to_local(to_light.normalized()).cast<double>();
                for (int m = 0; m < options.roughness_count; ++m)
                    columns.lobe[static_cast<std::size_t>(m)](row, j) =
                        lit[i] * ward_lobe(wo, wi, sigma_at(m, options.roughness_count));
            });
        }
    return metal;
}

/// Colours at the best combination: the roughness is shared, rho_d and rho_s are per channel.
WardFit ward_at(const MetalColumns& metal, const Combination& best,
                const std::vector<DiscLight>& lights, double bright, const PaperOptions& options) {
    const CombinationColumns& c = metal.columns;
    WardFit fit;
    fit.pixel_count = static_cast<int>(metal.pixels.size());
    const double sigma = sigma_at(static_cast<int>(best.roughness), options.roughness_count);
    fit.ward.sigma_x = fit.ward.sigma_y = fit.sigma.value = sigma;
    Eigen::ArrayXd error = Eigen::ArrayXd::Zero(c.observed.size());
    Eigen::ArrayXd error_diffuse = error;
    for (int channel = 0; channel < 3; ++channel) {
        Eigen::VectorXd a = Eigen::VectorXd::Zero(c.observed.size()), w = a, s = a;
        for (std::size_t l = 0; l < lights.size(); ++l) {
            const auto j = static_cast<Eigen::Index>(l) * c.place_count + best.place[l];
            a += lights[l].intensity_w_per_sr[channel] * c.diffuse.col(j);
            w += lights[l].intensity_w_per_sr[channel] * c.lobe[best.roughness].col(j);
        }
        for (Eigen::Index i = 0; i < s.size(); ++i)
            s[i] = metal.pixels[static_cast<std::size_t>(i)]->radiance[channel];
        const TwoColumnFit solved =
            fit_two_columns(a.dot(a), a.dot(w), w.dot(w), a.dot(s), w.dot(s), s.dot(s));
        const double only = a.dot(a) > 0.0 ? a.dot(s) / a.dot(a) : 0.0;
        fit.ward.rho_d[channel] = static_cast<float>(solved.d);
        fit.ward.rho_s[channel] = static_cast<float>(solved.s);
        fit.albedo[channel] = static_cast<float>(std::min(only, 1.0));
        error += (solved.d * a + solved.s * w - s).array().abs() / (3.0 * bright);
        error_diffuse += (only * a - s).array().abs() / (3.0 * bright);
    }
    if (error.size() > 0) {
        fit.cost = error.min(kCap).mean();
        fit.cost_diffuse = error_diffuse.min(kCap).mean();
    }
    fit.sigma.residual_rms = fit.cost;
    // The grid's own step is all the doubt the method knows.
    fit.sigma.stddev = sigma * (std::pow(kSigmaMax / kSigmaMin, 1.0 / options.roughness_count) - 1);
    fit.sigma.outcome = Outcome::Converged;
    if (best.roughness == 0 || best.roughness + 1 == c.lobe.size()) {
        fit.sigma.outcome = Outcome::AtBound;
        fit.sigma.reason = "the best roughness lies at the end of the range";
    }
    return fit;
}

/// Index and absorption of a glass at the best combination (Eq. 13 and 14).
void set_glass(ObjectEstimate& object, const ObjectContext& context, int k,
               const std::vector<ObjectPixel>& pixels, const std::vector<double>& iors,
               std::size_t best, const PaperOptions& options, const ObjectOverride* known) {
    object.ior.value = known && known->ior ? *known->ior : iors[best];
    object.ior.stddev = options.ior_step / std::sqrt(12.0);
    object.ior.outcome = Outcome::Converged;
    if (!(known && known->ior) && (best == 0 || best + 1 == iors.size())) {
        object.ior.outcome = Outcome::AtBound;
        object.ior.reason = "the best index lies at the end of the range";
    }
    const std::vector<ThroughPixel> through =
        look_through_plainly(context.world, context.lookup, k, pixels, object.ior.value);
    object.sigma_a_per_m.value = known && known->sigma_a_per_m
                                     ? *known->sigma_a_per_m
                                     : fit_absorption(through, pixels, context.bright);
    object.sigma_a_per_m.outcome = Outcome::Converged;
    object.cost_solid = through_cost(through, pixels, object.sigma_a_per_m.value, context.bright);
    object.ior.residual_rms = object.sigma_a_per_m.residual_rms = object.cost_solid;
}

}  // namespace

PaperEstimate estimate_paper(const Scene& scene, std::span<const RgbdFrame> frames,
                             double saturation_level, LightEstimate& light,
                             const std::vector<ObjectOverride>& overrides,
                             const ObjectPixelOptions& pixel_options, const PaperOptions& options,
                             const Progress& progress) {
    PaperEstimate result;
    const ObjectContext context(scene, frames, saturation_level, light);
    const std::vector<std::vector<TrialLight>> places = places_of(light, options);
    std::vector<double> intensities;
    for (const DiscLight& lamp : context.light.lights)
        intensities.push_back(luminance(lamp.intensity_w_per_sr));
    PaperCausticOptions caustic;
    caustic.ior_step = options.ior_step;
    caustic.photon_count = options.caustic_photon_count;
    const std::vector<double> iors = ior_grid(caustic);

    double seconds_metal = 0.0, seconds_glass = 0.0, all_light = 1e-12;
    std::vector<double> total;  // squared error of each combination, over all objects
    std::map<int, MetalColumns> metals;
    std::map<int, std::vector<Combination>> lobes;
    std::map<int, std::vector<std::vector<double>>> indices;
    std::vector<std::vector<ObjectPixel>> pixels;
    const auto add = [&](std::size_t combination, double error) {
        if (total.size() <= combination) total.resize(combination + 1, 0.0);
        total[combination] += error;
    };
    for (int k = 0; k < context.world.object_count(); ++k) {
        progress.update(static_cast<double>(k) / context.world.object_count(),
                        "all combinations of lights");
        Timer timer;
        const Part& part = scene.parts[static_cast<std::size_t>(context.world.part_of_object(k))];
        ObjectEstimate object;
        object.id = part.name;
        object.mesh_file = part.mesh_file;
        pixels.push_back(object_pixels(context.world, context.lookup, k, pixel_options));
        const CausticReceivers receivers = find_receivers(context, k, light.plane);
        const double reflectance = receiver_reflectance(context, receivers);
        object.class_margin = paper_rule(context, k, pixels.back(), reflectance).margin();
        object.object_class =
            object.class_margin > 0.0 ? ObjectClass::Transparent : ObjectClass::Specular;
        if (pixels.back().empty()) {
            object.object_class = ObjectClass::Unsure;
            object.reason = "no pixel shows this object";
        }
        if (const ObjectOverride* known = find_override(overrides, object.id)) {
            if (known->object_class) object.object_class = *known->object_class;
            if (known->ignore) object.object_class = ObjectClass::Diffuse;
        }
        if (object.object_class == ObjectClass::Specular ||
            object.object_class == ObjectClass::Diffuse) {
            metals[k] = metal_columns(context, k, pixels.back(), places, options);
            lobes[k] = score_combinations(metals[k].columns, intensities);
            all_light += metals[k].columns.observed.squaredNorm();
            for (std::size_t i = 0; i < lobes[k].size(); ++i) add(i, lobes[k][i].squared_error);
            seconds_metal += timer.seconds();
        } else if (object.object_class == ObjectClass::Transparent) {
            indices[k] =
                caustic_errors(context, k, receivers, places, intensities, reflectance, caustic);
            // The view through the object does not depend on the light.
            for (std::size_t m = 0; m < iors.size(); ++m) {
                const std::vector<ThroughPixel> through =
                    look_through_plainly(context.world, context.lookup, k, pixels.back(), iors[m]);
                double own = 0.0;
                for (std::size_t i = 0; i < through.size(); ++i)
                    if (through[i].is_valid && !pixels.back()[i].is_clipped)
                        own += std::pow(luminance(through[i].transmitted) -
                                            luminance(pixels.back()[i].radiance),
                                        2.0);
                for (std::vector<double>& row : indices[k]) row[m] += own;
            }
            for (const float l : receivers.luminance) all_light += l * l;
            for (std::size_t i = 0; i < indices[k].size(); ++i)
                add(i, *std::min_element(indices[k][i].begin(), indices[k][i].end()));
            seconds_glass += timer.seconds();
        }
        result.objects.push_back(object);
    }
    std::size_t best = 0;
    for (std::size_t i = 0; i < total.size(); ++i)
        if (total[i] < total[best]) best = i;
    if (!total.empty()) {
        result.error_initial = total[0] / all_light;
        result.error_joint = total[best] / all_light;
    }

    std::vector<int> place(places.size(), 0);
    std::size_t rest = best;
    for (std::size_t l = places.size(); l-- > 0; rest /= places[l].size())
        place[l] = static_cast<int>(rest % places[l].size());
    for (std::size_t l = 0; l < places.size(); ++l) {
        const TrialLight& chosen = places[l][static_cast<std::size_t>(place[l])];
        light.lights[l].light.position_m = chosen.position_m;
        light.lights[l].light.normal = chosen.normal;
    }
    for (std::size_t k = 0; k < result.objects.size(); ++k) {
        ObjectEstimate& object = result.objects[k];
        const auto index = static_cast<int>(k);
        if (metals.contains(index)) {
            const WardFit fit = ward_at(metals[index], lobes[index][best], context.light.lights,
                                        context.bright, options);
            object.clusters = {{1.0, fit}};
            object.albedo = fit.albedo;
            object.cost_ward = fit.cost;
            object.cost_diffuse = fit.cost_diffuse;
        } else if (indices.contains(index)) {
            const std::vector<double>& row = indices[index][best];
            const auto least = std::min_element(row.begin(), row.end());
            set_glass(object, context, index, pixels[k], iors,
                      static_cast<std::size_t>(least - row.begin()), options,
                      find_override(overrides, object.id));
        }
    }
    result.seconds = {{"specular", seconds_metal}, {"transparent", seconds_glass}};
    progress.update(1.0);
    return result;
}

}  // namespace vitrine
