#include "compose/transfer.h"

#include "base/parallel.h"
#include "compose/object_irradiance.h"
#include "estimate/ball_heights.h"
#include "estimate/highlight_light.h"
#include "estimate/relief_refinement.h"
#include "image/colour.h"
#include "image/filter.h"
#include "image/poisson.h"
#include "math/statistics.h"
#include "render/render_object.h"
#include "render/translucent_shadow_map.h"

#include <algorithm>
#include <future>

namespace vitrine {
namespace {

/// White of a picture without clipping: the bright end of the object shows 0.8 encoded.
double white_of(const Photo& photo) {
    if (photo.saturation_level < 1e6) return photo.saturation_level;
    std::vector<double> values;
    for (std::size_t i = 0; i < photo.mask.size(); ++i)
        if (photo.mask[i] > 127) values.push_back(luminance(photo.linear[i]));
    return std::max(quantile(std::move(values), 0.95), 1e-9) / srgb_to_linear(0.8f);
}

/// The silhouette without any shading: where shape from known light starts.
Relief inflated_silhouette(const PhotoAnalysis& analysis, ReliefOptions options) {
    options.alpha = 0;
    return shade_to_shape(analysis.highlights.diffuse, analysis.photo.mask, options);
}

/// Only a material photo may show a cluster: what is dressed is one body.
enum class Role { Material, Object };

PhotoAnalysis analyse(const Photo& photo, Role role, const TransferAnalysisOptions& options,
                      const Progress& progress) {
    PhotoAnalysis analysis;
    analysis.photo = photo;
    analysis.white = white_of(photo);
    analysis.warnings = photo.warnings;
    progress.update(0.0, "highlights");
    analysis.highlights =
        find_highlights(photo.linear, photo.mask, photo.saturation_level, options.highlights);
    progress.update(0.2, "shape");
    std::vector<Ball> balls;
    if (options.shape == ShapeModel::Auto && role == Role::Material)
        balls = find_balls(analysis.highlights.diffuse, photo.mask, options.balls);
    analysis.relief = balls.empty()
                          ? shade_to_shape(analysis.highlights.diffuse, photo.mask, options.relief)
                          : relief_of_balls(photo.mask, std::move(balls));
    progress.update(0.4, "lights");
    analysis.highlight_lights = highlight_lights(analysis.highlights, analysis.relief);
    if (options.light_method == LightMethod::LopezMoreno) {
        analysis.lights = analysis.explaining = estimate_lopez_moreno_lights(
            analysis.highlights.diffuse, analysis.relief, analysis.highlights.grown);
    } else {
        TranslucencyLightOptions light_options = options.lights;
        light_options.softness = role == Role::Material ? options.softness : 1 - options.softness;
        const auto estimate = [&](std::span<const HighlightLight> seen, bool use_votes) {
            light_options.use_votes = use_votes;
            return estimate_translucency_lights(analysis.highlights.diffuse, analysis.relief,
                                                analysis.highlights.grown, seen, light_options);
        };
        analysis.lights = analysis.explaining = estimate(analysis.highlight_lights, true);
        if (analysis.relief.is_cluster()) {
            progress.update(0.6, "heights of the balls");
            BallHeightOptions heights;
            heights.eta = light_options.eta;
            analysis.relief = relief_of_balls(
                photo.mask,
                refine_ball_heights(analysis.relief, analysis.highlights.diffuse,
                                    analysis.highlights.grown, analysis.lights, heights));
            progress.update(0.8, "lights");
            analysis.lights = analysis.explaining = estimate(analysis.highlight_lights, true);
            analysis.relief.ball_albedo = analysis.lights.ball_albedo;
        }
        if (role == Role::Material && !analysis.relief.is_cluster()) {
            progress.update(0.5, "shape and lights");
            analysis.explaining = estimate(analysis.highlight_lights, false);
            const Relief inflated = inflated_silhouette(analysis, options.relief);
            for (int round = 0; round < options.refinement_rounds; ++round) {
                light_options.known_lamps.clear();
                for (const ViewLight& light : analysis.explaining.lights.lights)
                    light_options.known_lamps.push_back(light.direction);
                analysis.relief = refine_relief(
                    inflated, analysis.highlights.diffuse, analysis.highlights.grown,
                    analysis.explaining.lights, analysis.explaining.kernel_px, light_options.eta);
                analysis.explaining =
                    estimate(highlight_lights(analysis.highlights, analysis.relief), false);
                progress.update(0.5 + 0.5 * (round + 1) / options.refinement_rounds,
                                "shape and lights");
            }
        }
    }
    analysis.warnings.insert(analysis.warnings.end(), analysis.explaining.warnings.begin(),
                             analysis.explaining.warnings.end());
    return analysis;
}

double encoded_psnr(const ImageRgb& a, const ImageRgb& b, const Mask& mask, const Mask& excluded) {
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] <= 127 || excluded[i] > 127) continue;
        for (int c = 0; c < 3; ++c) {
            const double d = linear_to_srgb(a[i][c]) - linear_to_srgb(b[i][c]);
            sum += d * d;
            count += 1;
        }
    }
    return count == 0 ? 0 : -10 * std::log10(std::max(sum / count, 1e-12));
}

ImageRgb scaled_image(ImageRgb image, double factor) {
    for (Rgb& pixel : image) pixel *= static_cast<float>(factor);
    return image;
}

}  // namespace

LiftedMaterial lift_material(const Photo& photo, const TransferAnalysisOptions& options,
                             const Progress& progress) {
    LiftedMaterial lifted;
    lifted.analysis = analyse(photo, Role::Material, options, progress.part(0.0, 0.6));
    PhotoAnalysis& analysis = lifted.analysis;
    const ImageRgb shown = scaled_image(analysis.highlights.diffuse, 1 / analysis.white);
    const EnteringLight light = [&](const Relief& lit, const SurfacePoints& points, double eta) {
        return entering_light(lit, points, analysis.explaining.lights, eta,
                              options.bssrdf.use_shadows);
    };
    BssrdfOptions bssrdf = options.bssrdf;
    // Balls are truly round; a silhouette inflated is not what it says.
    bssrdf.prefers_random_walk |= analysis.relief.is_cluster();
    lifted.medium = estimate_bssrdf(shown, analysis.relief, analysis.highlights.grown, light,
                                    bssrdf, progress.part(0.6, 0.8));
    // R_d stays with the body for which the lights were found; another back would ask for others.
    if (options.use_back) {
        const std::optional<Relief> worn = refine_back(
            analysis.relief, shown, analysis.highlights.grown, light, lifted.medium, options.back);
        if (worn) analysis.relief = *worn;
    }
    progress.update(0.9, "shape");

    lifted.brightness = limit_albedo(lifted.medium);

    TranslucentRenderOptions render_options;
    render_options.eta = lifted.medium.is_fresnel ? options.bssrdf.eta : 1.0;
    render_options.use_curved_body = options.bssrdf.use_curved_body;
    const auto render = [&](const Relief& relief) {
        return scaled_image(render_object(relief, analysis.explaining.lights,
                                          lifted.medium.profile(), render_options),
                            lifted.brightness);
    };
    if (options.refinement_rounds > 0 && options.light_method != LightMethod::LopezMoreno &&
        !analysis.relief.is_cluster()) {
        RefinedFront front =
            refine_front(analysis.relief, inflated_silhouette(analysis, options.relief), shown,
                         analysis.highlights.grown, analysis.explaining.lights,
                         analysis.explaining.kernel_px, options.lights.eta, render, options.front);
        analysis.relief = std::move(front.relief);
        lifted.rendered = std::move(front.rendered);
    } else {
        lifted.rendered = render(analysis.relief);
    }
    lifted.self_psnr_db =
        encoded_psnr(lifted.rendered, shown, photo.mask, analysis.highlights.grown);
    Rgbd mean = Rgbd::Zero();
    double count = 0;
    for (std::size_t i = 0; i < photo.mask.size(); ++i) {
        if (photo.mask[i] <= 127 || analysis.highlights.grown[i] > 127) continue;
        for (int c = 0; c < 3; ++c) mean[c] += linear_to_srgb(shown[i][c]);
        count += 1;
    }
    Rgb flat;
    for (int c = 0; c < 3; ++c)
        flat[c] = srgb_to_linear(static_cast<float>(mean[c] / std::max(count, 1.0)));
    lifted.flat_psnr_db = encoded_psnr(ImageRgb(shown.width(), shown.height(), flat), shown,
                                       photo.mask, analysis.highlights.grown);
    progress.update(1.0, "material lifted");
    return lifted;
}

PhotoAnalysis analyse_object(const Photo& photo, const TransferAnalysisOptions& options,
                             const Progress& progress) {
    return analyse(photo, Role::Object, options, progress);
}

AnalysedPair analyse_pair(const Photo& material_photo, const Photo& object_photo,
                          const TransferAnalysisOptions& options, const Progress& progress) {
    const auto policy = thread_count() > 1 ? std::launch::async : std::launch::deferred;
    std::future<PhotoAnalysis> object =
        std::async(policy, [&] { return analyse_object(object_photo, options); });
    LiftedMaterial material = lift_material(material_photo, options, progress);
    return {std::move(material), object.get()};
}

double length_ratio(double source_inradius_px, double target_inradius_px, double source_px_per_m,
                    double target_px_per_m) {
    if (source_px_per_m > 0 && target_px_per_m > 0) return target_px_per_m / source_px_per_m;
    return target_inradius_px / source_inradius_px;
}

TransferSession::TransferSession(PhotoAnalysis object, IrradianceSource irradiance,
                                 const TranslucentRenderOptions& options, bool is_object_neutral,
                                 double object_albedo)
    : object_(std::move(object)),
      options_(options),
      renderer_(std::make_unique<TranslucentRelief>(object_.relief, options)) {
    const Mask& mask = object_.photo.mask;
    const ObjectIrradiance found =
        object_irradiance(object_, irradiance, is_object_neutral, options.eta, object_albedo);
    irradiance_ = found.irradiance;
    level_ = found.level;
    // One pixel wider than the object, with a soft edge: a sharp one leaves a fringe.
    const Mask wide = dilate(mask, 1);
    alpha_ = ImageF(mask.width(), mask.height());
    for (std::size_t i = 0; i < wide.size(); ++i) alpha_[i] = wide[i] > 127 ? 1.0f : 0.0f;
    alpha_ = gaussian_blur(alpha_, 1.0);
    ImageF column(mask.width(), mask.height()), row(mask.width(), mask.height());
    for (int y = 0; y < mask.height(); ++y) {
        for (int x = 0; x < mask.width(); ++x) {
            column(x, y) = static_cast<float>(x);
            row(x, y) = static_cast<float>(y);
        }
    }
    column = extend_nearest(column, mask);
    row = extend_nearest(row, mask);
    for (std::size_t i = 0; i < alpha_.size(); ++i) {
        if (alpha_[i] <= 0 || mask[i] > 127) continue;
        rim_.push_back(
            {i, static_cast<std::size_t>(row[i]) * static_cast<std::size_t>(mask.width()) +
                    static_cast<std::size_t>(column[i])});
    }
}

void TransferSession::set_lights(const ViewLights& lights) {
    object_.lights.lights = lights;
    irradiance_ = irradiance_from_lights(object_.relief, lights, options_.eta);
    lit_.clear();
}

const ImageRgb& TransferSession::diffuse_of(const RadialProfile& material,
                                            bool use_shadow_maps) const {
    constexpr std::size_t kKept = 2;  // at the scale asked for, and at 1 for its colour
    const auto is_same = [&](const Lit& lit) {
        return lit.use_shadow_maps == use_shadow_maps && lit.material.r == material.r &&
               std::equal(lit.material.rd.begin(), lit.material.rd.end(), material.rd.begin(),
                          material.rd.end(),
                          [](const Rgbd& a, const Rgbd& b) { return (a == b).all(); });
    };
    const auto found = std::find_if(lit_.begin(), lit_.end(), is_same);
    if (found != lit_.end()) {
        std::rotate(found, found + 1, lit_.end());
        return lit_.back().diffuse;
    }
    if (lit_.size() == kKept) lit_.erase(lit_.begin());
    lit_.push_back({material, use_shadow_maps,
                    use_shadow_maps ? render_translucent_shadow_maps(
                                          object_.relief, object_.lights.lights, material, options_)
                                    : renderer_->render(irradiance_, material)});
    return lit_.back().diffuse;
}

ImageRgb TransferSession::highlight_layer(const TransferLook& look) const {
    const Mask& mask = object_.photo.mask;
    ImageRgb layer(mask.width(), mask.height());
    const auto lobe = [&](const Image<Vec3f>& normals, std::size_t i, const Vec3& direction,
                          double exponent) {
        const Vec3 half = (direction + Vec3(0, 0, 1)).normalized();
        const Vec3 n = normals[i].cast<double>();
        if (n.dot(direction) <= 0) return 0.0;
        return std::pow(std::max(0.0, n.dot(half)), exponent);
    };
    const bool has_highlights = !object_.highlights.blobs.empty();
    if (has_highlights && look.highlights == HighlightTransfer::Residual) {
        // The fill beneath meets the picture at the border of the grown set: no seam to feather.
        for (std::size_t i = 0; i < layer.size(); ++i)
            layer[i] = object_.highlights.residual[i] * static_cast<float>(look.highlight_gain);
    } else if (has_highlights) {
        ImageF gloss(mask.width(), mask.height());
        for (std::size_t i = 0; i < gloss.size(); ++i)
            gloss[i] = object_.highlights.core[i] > 127 ? 1.0f : 0.0f;
        gloss = gaussian_blur(gloss, std::max(1.0, 0.02 * object_.relief.inradius_px));
        double total = 0;
        for (const ViewLight& light : object_.lights.lights.lights)
            total += luminance(light.intensity);
        for (std::size_t i = 0; i < layer.size(); ++i) {
            if (mask[i] <= 127 || gloss[i] <= 0) continue;
            double sum = 0;
            if (!object_.highlight_lights.empty()) {
                sum += look.highlight_weight * lobe(object_.relief.normals, i,
                                                    object_.highlight_lights.front().direction,
                                                    look.phong_exponent);
            }
            for (const ViewLight& light : object_.lights.lights.lights) {
                sum += (1 - look.highlight_weight) * luminance(light.intensity) / total *
                       lobe(object_.relief.normals, i, light.direction, look.phong_exponent);
            }
            layer[i] = Rgb::Constant(static_cast<float>(sum * look.highlight_gain * object_.white) *
                                     gloss[i]);
        }
    }
    if (look.added_gloss > 0 && !object_.lights.lights.lights.empty()) {
        const Vec3 key = object_.lights.lights.lights.front().direction;
        for (std::size_t i = 0; i < layer.size(); ++i) {
            if (mask[i] <= 127) continue;
            layer[i] += Rgb::Constant(static_cast<float>(
                object_.white * look.added_gloss *
                lobe(object_.relief.normals, i, key, look.added_gloss_exponent)));
        }
    }
    return layer;
}

TransferPicture TransferSession::render(const RadialProfile& profile,
                                        const TransferLook& look) const {
    const Mask& mask = object_.photo.mask;
    TransferPicture result;
    const RadialProfile stretched = look.scale == 1 ? profile : profile.scaled(look.scale);
    const auto sum_of = [](const ImageRgb& image) {
        Rgbd sum = Rgbd::Zero();
        for (const Rgb& pixel : image) sum += pixel.cast<double>();
        return sum;
    };
    const bool is_recoloured = look.keep_colour && look.scale != 1;
    Rgbd wanted = Rgbd::Zero();
    if (is_recoloured) wanted = sum_of(diffuse_of(profile, look.use_shadow_maps));
    result.diffuse = diffuse_of(stretched, look.use_shadow_maps);
    if (is_recoloured) {
        // Longer paths lose light in a finite body, and unequally per channel.
        const Rgb factor = (wanted / sum_of(result.diffuse).max(1e-12)).cast<float>();
        for (Rgb& pixel : result.diffuse) pixel *= factor;
    }
    const auto level = static_cast<float>(level_ * look.exposure);
    for (Rgb& pixel : result.diffuse) pixel *= level;

    const ImageRgb highlights = highlight_layer(look);
    ImageRgb object(mask.width(), mask.height());
    for (std::size_t i = 0; i < mask.size(); ++i) object[i] = result.diffuse[i] + highlights[i];
    for (const auto& [outside, inside] : rim_) object[outside] = object[inside];
    result.picture = object_.photo.linear;
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (alpha_[i] <= 0) continue;
        result.picture[i] += alpha_[i] * (object[i] - result.picture[i]);
    }
    return result;
}

ImageRgb lambertian_recolouring(const Relief& relief, const ReliefIrradiance& irradiance,
                                const Rgbd& albedo) {
    ImageRgb result(relief.mask.width(), relief.mask.height());
    for (std::size_t i = 0; i < result.size(); ++i)
        if (relief.mask[i] > 127) result[i] = irradiance.front[i] * (albedo / kPi).cast<float>();
    return result;
}

}  // namespace vitrine
