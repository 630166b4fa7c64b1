#include "estimate/joint_light.h"

#include "estimate/glass_cue.h"
#include "estimate/light_combinations.h"
#include "estimate/light_data.h"
#include "estimate/light_search.h"
#include "estimate/object_context.h"
#include "math/optimise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <set>

namespace vitrine {

namespace {

constexpr int kPixelsPerView = 90;  // of a metal: every pixel costs a lobe of lamp samples
constexpr int kDiscSamples = 8;
constexpr int kStride = 2;       // of the scan's samples
constexpr double kPatch = 0.01;  // metres, on a metal: errors of a hull are alike within it
constexpr std::array<double, 5> kSigmaFactors = {0.7, 0.85, 1.0, 1.18, 1.4};

/// One specular candidate with what does not depend on the lamps. Stays where it was made: the
/// model refers to the pixels.
struct Metal {
    std::vector<ObjectPixel> pixels;
    std::unique_ptr<SpecularModel> model;
    std::vector<WardLobe> lobes;                 // around the one fitted
    std::vector<std::vector<Rgb>> surroundings;  // of each lobe
    double patches = 1.0;
};

std::unique_ptr<const Metal> make_metal(const ObjectContext& context, int k, const WardFit& fit,
                                        const MaterialOptions& options) {
    auto made = std::make_unique<Metal>();
    Metal& metal = *made;
    ObjectPixelOptions pixels = options.pixels;
    pixels.pixels_per_view = kPixelsPerView;
    metal.pixels = object_pixels(context.world, context.lookup, k, pixels);
    SpecularOptions specular = options.specular;
    specular.disc_samples = kDiscSamples;
    metal.model =
        std::make_unique<SpecularModel>(context.world, metal.pixels, context.light_on(k), specular);
    for (const double factor : kSigmaFactors)
        metal.lobes.push_back(
            {fit.ward.sigma_x * factor, fit.ward.sigma_y * factor, fit.ward.form});
    for (const WardLobe& lobe : metal.lobes)
        metal.surroundings.push_back(metal.model->surroundings(lobe));
    std::set<std::array<int, 3>> cells;
    for (const ObjectPixel& p : metal.pixels) {
        const Vec3f c = p.surface.position / static_cast<float>(kPatch);
        cells.insert({static_cast<int>(std::floor(c.x())), static_cast<int>(std::floor(c.y())),
                      static_cast<int>(std::floor(c.z()))});
    }
    metal.patches = std::max(1.0, static_cast<double>(cells.size()));
    return made;
}

double metal_cost(const Metal& metal, const std::vector<DiscLight>& lamps, double bright) {
    const SpecularModel model = metal.model->with_lamps(lamps);
    double least = 1.0;
    for (std::size_t m = 0; m < metal.lobes.size(); ++m)
        least = std::min(
            least,
            fit_lobe(model, model.with_direct(metal.lobes[m], metal.surroundings[m]), bright, true)
                .objective);
    return least;
}

DiscLight turned(const DiscLight& lamp, const Vec3& reference, double x, double y,
                 double log_distance) {
    const Vec3 offset = lamp.position_m - reference;
    const Frame frame(offset.normalized().cast<float>());
    const Vec3 direction = (offset.normalized() + std::tan(x) * frame.tangent.cast<double>() +
                            std::tan(y) * frame.bitangent.cast<double>())
                               .normalized();
    DiscLight moved = lamp;
    moved.position_m = reference + offset.norm() * std::exp(log_distance) * direction;
    moved.normal = -direction;
    moved.radius_m *= std::exp(log_distance);
    // Irradiance at the reference point is what the pictures fix.
    moved.intensity_w_per_sr *= static_cast<float>(std::exp(2.0 * log_distance));
    return moved;
}

/// All cues of one scene, to be asked for any lights.
class JointObjective {
  public:
    JointObjective(const LightData& data, const LightFit& fit, const ObjectContext& context,
                   std::vector<std::unique_ptr<const Metal>> metals,
                   std::vector<std::unique_ptr<const GlassCue>> glasses,
                   const JointOptions& options)
        : data_(data),
          fit_(fit),
          context_(context),
          metals_(std::move(metals)),
          glasses_(std::move(glasses)),
          options_(options) {
        std::set<int> blocks(data.samples.block.begin(), data.samples.block.end());
        blocks_ = static_cast<double>(blocks.size());
    }

    double light_cost(const std::vector<DiscLight>& lamps) const {
        LightColumns columns;
        for (const DiscLight& lamp : lamps)
            columns.add(
                fit_.column({lamp.position_m, lamp.normal, lamp.radius_m}, kDiscSamples, kStride),
                luminance(lamp.intensity_w_per_sr) / luminance(lamps.front().intensity_w_per_sr));
        return fit_.score(columns, kStride, kLuminance).cost;
    }
    double object_cost(const std::vector<DiscLight>& lamps) const {
        double sum = 0.0;
        for (const auto& metal : metals_) sum += metal_cost(*metal, lamps, context_.bright);
        return metals_.empty() ? 0.0 : sum / static_cast<double>(metals_.size());
    }
    /// Of glass `g` itself.
    double ior(std::size_t g, double caustic_ior) const { return glasses_[g]->ior(caustic_ior); }
    /// @param iors that the caustic of each glass asks for
    double operator()(const std::vector<DiscLight>& lamps, std::span<const double> iors) const {
        double nll = 0.0;
        for (std::size_t g = 0; g < glasses_.size(); ++g) {
            if (iors[g] < glasses_[g]->ior_min() || iors[g] > glasses_[g]->ior_max()) return 1e9;
            nll += (*glasses_[g])(lamps, iors[g]);
        }
        for (const auto& metal : metals_)
            nll += 0.5 * metal->patches *
                   std::log(std::max(metal_cost(*metal, lamps, context_.bright), 1e-6));
        if (options_.mode == JointMode::Likelihoods)
            nll += 0.5 * blocks_ * std::log(std::max(light_cost(lamps), 1e-6));
        return nll;
    }

    /// The best of all combinations of places, rho and sigma of each metal exact for each.
    std::vector<DiscLight> best_combination(const std::vector<DiscLight>& lamps) const {
        if (metals_.empty()) return lamps;
        const std::vector<std::vector<DiscLight>> places = places_of(lamps);
        std::vector<double> total;
        std::vector<std::vector<int>> choice;
        for (const auto& metal : metals_) {
            const std::vector<Combination> scored = score(*metal, places);
            total.resize(scored.size(), 0.0);
            choice.clear();
            for (std::size_t i = 0; i < scored.size(); ++i) {
                total[i] +=
                    0.5 * metal->patches * std::log(std::max(scored[i].squared_error, 1e-12));
                choice.push_back(scored[i].place);
            }
        }
        std::vector<DiscLight> best = lamps;
        double least = 1e300;
        for (std::size_t i = 0; i < total.size(); ++i) {
            std::vector<DiscLight> trial;
            for (std::size_t l = 0; l < lamps.size(); ++l)
                trial.push_back(places[l][static_cast<std::size_t>(choice[i][l])]);
            if (options_.mode == JointMode::Likelihoods)
                total[i] += 0.5 * blocks_ * std::log(std::max(light_cost(trial), 1e-6));
            if (total[i] < least) {
                least = total[i];
                best = trial;
            }
        }
        return best;
    }

  private:
    std::vector<std::vector<DiscLight>> places_of(const std::vector<DiscLight>& lamps) const {
        const double radius = radians(options_.local_radius_deg);
        std::vector<std::vector<DiscLight>> places;
        for (const DiscLight& lamp : lamps) {
            std::vector<DiscLight> here = {lamp};
            for (int k = 0; k < options_.local_samples; ++k) {
                const double angle = 2.0 * kPi * k / options_.local_samples;
                here.push_back(turned(lamp, data_.samples.reference_point, radius * std::cos(angle),
                                      radius * std::sin(angle), 0.0));
            }
            places.push_back(here);
        }
        return places;
    }

    /// Luminance columns of every place alone; what no lamp causes is shared out among the lamps.
    std::vector<Combination> score(const Metal& metal,
                                   const std::vector<std::vector<DiscLight>>& places) const {
        std::vector<std::size_t> rows;
        for (std::size_t i = 0; i < metal.pixels.size(); ++i)
            if (!metal.pixels[i].is_clipped) rows.push_back(i);
        const auto n = static_cast<Eigen::Index>(rows.size());
        CombinationColumns columns;
        columns.light_count = static_cast<int>(places.size());
        columns.place_count = static_cast<int>(places.front().size());
        columns.observed.resize(n);
        columns.diffuse.setZero(n, columns.light_count * columns.place_count);
        columns.lobe.assign(metal.lobes.size(), columns.diffuse);
        const SpecularModel dark = metal.model->with_lamps({});
        for (std::size_t l = 0; l < places.size(); ++l)
            for (std::size_t p = 0; p < places[l].size(); ++p) {
                const auto j = static_cast<Eigen::Index>(l * places[l].size() + p);
                const SpecularModel lit = metal.model->with_lamps({places[l][p]});
                const float share = 1.0f / static_cast<float>(places.size()) - 1.0f;
                for (std::size_t m = 0; m < metal.lobes.size(); ++m) {
                    const SpecularColumns c =
                        lit.with_direct(metal.lobes[m], metal.surroundings[m]);
                    for (Eigen::Index r = 0; r < n; ++r) {
                        const std::size_t i = rows[static_cast<std::size_t>(r)];
                        columns.observed[r] = luminance(metal.pixels[i].radiance);
                        columns.diffuse(r, j) =
                            luminance(Rgb(c.diffuse[i] + share * dark.irradiance()[i] / kPif));
                        columns.lobe[m](r, j) =
                            luminance(Rgb(c.lobe[i] + share * metal.surroundings[m][i]));
                    }
                }
            }
        return score_combinations(columns, std::vector<double>(places.size(), 1.0));
    }

    const LightData& data_;
    const LightFit& fit_;
    const ObjectContext& context_;
    std::vector<std::unique_ptr<const Metal>> metals_;
    std::vector<std::unique_ptr<const GlassCue>> glasses_;
    JointOptions options_;
    double blocks_ = 1.0;
};

/// The solid clear objects whose index is free or known, with the objects they are.
struct Glasses {
    std::vector<std::unique_ptr<const GlassCue>> cues;
    std::vector<std::size_t> object;
};

Glasses glasses_of(const ObjectContext& context, const LightEstimate& light,
                   const std::vector<ObjectEstimate>& objects, const TransparentOptions& options) {
    Glasses glasses;
    for (std::size_t k = 0; k < objects.size(); ++k) {
        const ObjectEstimate& object = objects[k];
        if (object.object_class != ObjectClass::Transparent || object.is_hollow) continue;
        const CausticScene scene = {context.light.lights, context.light.ambient,
                                    object.sigma_a_per_m.value, kScanMask, light.plane};
        Estimate<double> through = object.ior_through;
        if (options.ior_step > 0.0 || !options.ior_grid.empty()) through.stddev = 0.0;  // stays
        auto cue =
            std::make_unique<const GlassCue>(context.world, context.lookup, static_cast<int>(k),
                                             scene, through, options.ior_min, options.ior_max);
        if (!cue->is_usable()) continue;
        glasses.cues.push_back(std::move(cue));
        glasses.object.push_back(k);
    }
    return glasses;
}

}  // namespace

LightEstimate refine_light_jointly(const Scene& scene, std::span<const RgbdFrame> frames,
                                   double saturation_level, const LightEstimate& light,
                                   const LightOptions& light_options,
                                   const MaterialOptions& material_options,
                                   const JointOptions& options,
                                   std::vector<ObjectEstimate>& objects, JointReport* report) {
    if (options.mode == JointMode::Separate || light.lights.empty() ||
        !light_options.known_lights.empty())
        return light;
    const ObjectContext context(scene, frames, saturation_level, light);
    std::vector<std::unique_ptr<const Metal>> metals;
    for (int k = 0; k < context.world.object_count(); ++k) {
        const ObjectEstimate& object = objects[static_cast<std::size_t>(k)];
        if (object.object_class != ObjectClass::Specular || object.clusters.empty()) continue;
        metals.push_back(make_metal(context, k, object.clusters.front().fit, material_options));
        if (metals.back()->pixels.empty()) metals.pop_back();
    }
    Glasses glasses;
    if (options.mode == JointMode::Likelihoods)
        glasses = glasses_of(context, light, objects, material_options.transparent);
    if (metals.empty() && glasses.cues.empty()) return light;
    const LightData data(scene, frames, saturation_level, light_options);
    if (!data.problem.empty()) return light;
    const LightFit fit(data.world, data.samples, data.reference, data.opaque_mask,
                       data.see_through_mask, light_options.seed);
    const std::vector<std::size_t> glass_object = glasses.object;
    const JointObjective objective(data, fit, context, std::move(metals), std::move(glasses.cues),
                                   options);

    const std::vector<DiscLight>& start = context.light.lights;
    const std::vector<DiscLight> nearest = objective.best_combination(start);
    const Vec3& reference = data.samples.reference_point;
    const double max_move = radians(options.max_move_deg);
    const auto lamps_at = [&](const std::vector<double>& x) {
        std::vector<DiscLight> lamps;
        for (std::size_t l = 0; l < nearest.size(); ++l)
            lamps.push_back(turned(nearest[l], reference, x[3 * l], x[3 * l + 1], x[3 * l + 2]));
        return lamps;
    };
    const std::size_t first_ior = 3 * nearest.size();
    const auto cost = [&](const std::vector<double>& x) {
        const std::vector<DiscLight> lamps = lamps_at(x);
        for (std::size_t l = 0; l < lamps.size(); ++l)
            if (angle_between(lamps[l].position_m - reference, start[l].position_m - reference) >
                max_move)
                return 1e9;
        return objective(lamps, std::span(x).subspan(first_ior));
    };
    std::vector<double> steps, at;
    for (std::size_t l = 0; l < nearest.size(); ++l) steps.insert(steps.end(), {0.02, 0.02, 0.05});
    at.assign(steps.size(), 0.0);
    for (const std::size_t k : glass_object) {
        at.push_back(objects[k].ior.value);
        steps.push_back(0.02);
    }
    const MinimumNd best = minimise_nelder_mead(
        cost, at, steps, {.max_evaluations = options.max_evaluations, .min_size = 0.02});
    const std::vector<DiscLight> found = lamps_at(best.x);
    for (std::size_t g = 0; g < glass_object.size(); ++g)
        objects[glass_object[g]].ior.value = objective.ior(g, best.x[first_ior + g]);
    if (report) {
        report->moved_deg = degrees(
            angle_between(found[0].position_m - reference, start[0].position_m - reference));
        report->light_cost_before = objective.light_cost(start);
        report->light_cost_after = objective.light_cost(found);
        report->object_cost_before = objective.object_cost(start);
        report->object_cost_after = objective.object_cost(found);
    }
    // Strength, ambient and deviations at the new places.
    LightOptions strength = light_options;
    strength.start = found;
    strength.keep_start = true;
    LightEstimate refined = estimate_lights(scene, frames, saturation_level, strength);
    refined.error_initial = light.error_initial;
    refined.grid_direction = light.grid_direction;
    return refined;
}

}  // namespace vitrine
