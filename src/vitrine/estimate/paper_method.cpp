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
#include <optional>

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

/// One candidate and its squared errors under every combination of lights.
struct Candidate {
    std::vector<ObjectPixel> pixels;
    std::optional<MetalColumns> metal;  // specular or diffuse: `lobes` of each combination
    std::vector<Combination> lobes;
    std::vector<std::vector<double>> index_errors;  // transparent: [combination][index]
};

/// What the candidates share, and the sums over them.
struct Search {
    const ObjectContext& context;
    const PaperOptions& options;
    std::vector<std::vector<TrialLight>> places;
    std::vector<double> intensities;
    PaperCausticOptions caustic;
    std::vector<double> iors;
    std::vector<double> total;  // squared error of each combination, over all objects
    double all_light = 1e-12;

    Search(const ObjectContext& of, const LightEstimate& light, const PaperOptions& with)
        : context(of), options(with), places(places_of(light, with)) {
        for (const DiscLight& lamp : context.light.lights)
            intensities.push_back(luminance(lamp.intensity_w_per_sr));
        caustic.ior_step = options.ior_step;
        caustic.photon_count = options.caustic_photon_count;
        iors = ior_grid(caustic);
    }

    void add(std::size_t combination, double error) {
        if (total.size() <= combination) total.resize(combination + 1, 0.0);
        total[combination] += error;
    }
    std::size_t best() const {
        return total.empty() ? 0
                             : static_cast<std::size_t>(
                                   std::min_element(total.begin(), total.end()) - total.begin());
    }
    /// The light of each lamp's place in a combination.
    std::vector<TrialLight> lights_of(std::size_t combination) const {
        std::vector<TrialLight> lights(places.size());
        for (std::size_t l = places.size(); l-- > 0; combination /= places[l].size())
            lights[l] = places[l][combination % places[l].size()];
        return lights;
    }
};

/// The class by the printed rule, or the one the user knows.
ObjectEstimate classified(const Search& search, const Part& part, int k,
                          const std::vector<ObjectPixel>& pixels, double reflectance,
                          const ObjectOverride* known) {
    ObjectEstimate object;
    object.id = part.name;
    object.mesh_file = part.mesh_file;
    object.class_margin = paper_rule(search.context, k, pixels, reflectance).margin();
    object.object_class =
        object.class_margin > 0.0 ? ObjectClass::Transparent : ObjectClass::Specular;
    if (pixels.empty()) {
        object.object_class = ObjectClass::Unsure;
        object.reason = "no pixel shows this object";
    }
    if (known && known->object_class) object.object_class = *known->object_class;
    if (known && known->ignore) object.object_class = ObjectClass::Diffuse;
    return object;
}

/// Ward's lobe at its best for every combination.
void add_metal(Search& search, int k, Candidate& candidate) {
    candidate.metal =
        metal_columns(search.context, k, candidate.pixels, search.places, search.options);
    candidate.lobes = score_combinations(candidate.metal->columns, search.intensities);
    search.all_light += candidate.metal->columns.observed.squaredNorm();
    for (std::size_t i = 0; i < candidate.lobes.size(); ++i)
        search.add(i, candidate.lobes[i].squared_error);
}

/// Caustic and view through the object for every index; the view does not depend on the light.
void add_glass(Search& search, int k, const CausticReceivers& receivers, double reflectance,
               Candidate& candidate) {
    const ObjectContext& context = search.context;
    candidate.index_errors = caustic_errors(context, k, receivers, search.places,
                                            search.intensities, reflectance, search.caustic);
    for (std::size_t m = 0; m < search.iors.size(); ++m) {
        const std::vector<ThroughPixel> through = look_through_plainly(
            context.world, context.lookup, k, candidate.pixels, search.iors[m]);
        double own = 0.0;
        for (std::size_t i = 0; i < through.size(); ++i)
            if (through[i].is_valid && !candidate.pixels[i].is_clipped)
                own += std::pow(
                    luminance(through[i].transmitted) - luminance(candidate.pixels[i].radiance),
                    2.0);
        for (std::vector<double>& row : candidate.index_errors) row[m] += own;
    }
    for (const float l : receivers.luminance) search.all_light += l * l;
    for (std::size_t i = 0; i < candidate.index_errors.size(); ++i)
        search.add(i, *std::min_element(candidate.index_errors[i].begin(),
                                        candidate.index_errors[i].end()));
}

/// Fills in what the chosen combination says of one object.
void set_material(const Search& search, int k, const Candidate& candidate, std::size_t best,
                  const ObjectOverride* known, ObjectEstimate& object) {
    if (candidate.metal) {
        const WardFit fit =
            ward_at(*candidate.metal, candidate.lobes[best], search.context.light.lights,
                    search.context.bright, search.options);
        object.clusters = {{1.0, fit}};
        object.albedo = fit.albedo;
        object.cost_ward = fit.cost;
        object.cost_diffuse = fit.cost_diffuse;
    } else if (!candidate.index_errors.empty()) {
        const std::vector<double>& row = candidate.index_errors[best];
        const auto least = std::min_element(row.begin(), row.end());
        set_glass(object, search.context, k, candidate.pixels, search.iors,
                  static_cast<std::size_t>(least - row.begin()), search.options, known);
    }
}

}  // namespace

PaperEstimate estimate_paper(const Scene& scene, std::span<const RgbdFrame> frames,
                             double saturation_level, LightEstimate& light,
                             const std::vector<ObjectOverride>& overrides,
                             const ObjectPixelOptions& pixel_options, const PaperOptions& options,
                             const Progress& progress) {
    PaperEstimate result;
    const ObjectContext context(scene, frames, saturation_level, light);
    Search search(context, light, options);
    const int count = context.world.object_count();
    double seconds_metal = 0.0, seconds_glass = 0.0;
    std::vector<Candidate> candidates(static_cast<std::size_t>(count));
    for (int k = 0; k < count; ++k) {
        progress.update(static_cast<double>(k) / count, "all combinations of lights");
        Timer timer;
        const Part& part = scene.parts[static_cast<std::size_t>(context.world.part_of_object(k))];
        Candidate& candidate = candidates[static_cast<std::size_t>(k)];
        candidate.pixels = object_pixels(context.world, context.lookup, k, pixel_options);
        const CausticReceivers receivers = find_receivers(context, k, light.plane);
        const double reflectance = receiver_reflectance(context, receivers);
        result.objects.push_back(classified(search, part, k, candidate.pixels, reflectance,
                                            find_override(overrides, part.name)));
        switch (result.objects.back().object_class) {
            case ObjectClass::Specular:
            case ObjectClass::Diffuse:
                add_metal(search, k, candidate);
                seconds_metal += timer.seconds();
                break;
            case ObjectClass::Transparent:
                add_glass(search, k, receivers, reflectance, candidate);
                seconds_glass += timer.seconds();
                break;
            case ObjectClass::Unsure:
                break;
        }
    }
    const std::size_t best = search.best();
    if (!search.total.empty()) {
        result.error_initial = search.total[0] / search.all_light;
        result.error_joint = search.total[best] / search.all_light;
    }
    const std::vector<TrialLight> chosen = search.lights_of(best);
    for (std::size_t l = 0; l < chosen.size(); ++l) {
        light.lights[l].light.position_m = chosen[l].position_m;
        light.lights[l].light.normal = chosen[l].normal;
    }
    for (int k = 0; k < count; ++k) {
        ObjectEstimate& object = result.objects[static_cast<std::size_t>(k)];
        set_material(search, k, candidates[static_cast<std::size_t>(k)], best,
                     find_override(overrides, object.id), object);
    }
    result.seconds = {{"specular", seconds_metal}, {"transparent", seconds_glass}};
    progress.update(1.0);
    return result;
}

}  // namespace vitrine
