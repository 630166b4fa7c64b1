#include "estimate/translucency_lights.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "estimate/distance_histogram.h"
#include "image/colour.h"
#include "image/filter.h"
#include "math/nnls.h"
#include "math/statistics.h"
#include "render/relief_light.h"

#include <numeric>

namespace vitrine {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Of wax, milk, marble and flesh; C(s) changes little around it.
constexpr double kTypicalAlbedo = 0.6;
/// Light thrown back by the ground is common, but dearer than a lamp: it must earn its place.
constexpr double kGroundPrice = 2.0;

/// The picture as the fit sees it: luminance over what leaves the surface, mean 1.
VectorXd observed_exitance(const ImageRgb& diffuse, const ReliefObservations& observations,
                           double eta) {
    const ImageF y = gaussian_blur(luminance_image(diffuse), 1.0);
    VectorXd result(static_cast<Index>(observations.pixel.size()));
    for (std::size_t p = 0; p < observations.pixel.size(); ++p) {
        const double cosine = std::max(0.35, static_cast<double>(observations.normal[p].z()));
        result[static_cast<Index>(p)] =
            y[observations.pixel[p]] / fresnel_transmittance(cosine, eta);
    }
    return result / std::max(result.mean(), 1e-12);
}

/// Fields of unit lights over the samples (times area) and at the observations.
struct Fields {
    Eigen::MatrixXf source, local;
};

/// Columns: the directions, then (unless `sky` is null) light from everywhere and from below.
void fill_fields(Eigen::MatrixXf& field, const Relief& relief, const SurfacePoints& points,
                 const std::vector<Vec3>& directions, const SkyShares* sky,
                 const TranslucencyLightOptions& options) {
    const auto count = static_cast<Index>(directions.size());
    const auto rows = static_cast<Index>(points.position.size());
    field.resize(rows, count + (sky == nullptr ? 0 : 2));
    for (Index l = 0; l < count; ++l) {
        const Vec3& direction = directions[static_cast<std::size_t>(l)];
        std::vector<float> seen(points.position.size(), 1.0f);
        if (options.use_shadows) seen = visibility(relief, points, direction);
        for (Index i = 0; i < rows; ++i) {
            const auto k = static_cast<std::size_t>(i);
            field(i, l) = seen[k] * static_cast<float>(entering_irradiance(points.normal[k],
                                                                           direction, options.eta));
        }
    }
    if (sky == nullptr) return;
    for (Index i = 0; i < rows; ++i) {
        field(i, count) = sky->ambient[static_cast<std::size_t>(i)];
        field(i, count + 1) = sky->below[static_cast<std::size_t>(i)];
    }
}

/// What the fit knows of the object: where light enters and where it is seen.
struct Body {
    const Relief& relief;
    const ReliefSamples& samples;
    const ReliefObservations& observations;
    SkyShares sample_sky, observation_sky;

    SurfacePoints sample_points() const { return {samples.position, samples.normal, samples.ball}; }
    SurfacePoints observation_points() const {
        return {observations.position, observations.normal, observations.ball};
    }
    Fields fields(const std::vector<Vec3>& directions, bool with_sky,
                  const TranslucencyLightOptions& options) const {
        Fields result;
        fill_fields(result.source, relief, sample_points(), directions,
                    with_sky ? &sample_sky : nullptr, options);
        fill_fields(result.local, relief, observation_points(), directions,
                    with_sky ? &observation_sky : nullptr, options);
        for (Index i = 0; i < result.source.rows(); ++i)
            result.source.row(i) *= samples.area_px2[static_cast<std::size_t>(i)];
        return result;
    }
};

/// Weighted ridge NNLS for one kernel's image of all lights.
struct Fit {
    VectorXd intensity;
    double residual = 1e300;  ///< sum of squared weighted misfit
};
Fit fit_intensities(const MatrixXd& image, const VectorXd& y, const VectorXd& weight,
                    const VectorXd& price) {
    const MatrixXd a = weight.asDiagonal() * image;
    const VectorXd b = weight.cwiseProduct(y);
    const double scale = a.colwise().norm().mean();
    MatrixXd gram = a.transpose() * a;
    gram.diagonal() += (price * scale).cwiseAbs2();
    Fit fit;
    fit.intensity = solve_nnls_gram(gram, a.transpose() * b).x;
    fit.residual = (a * fit.intensity - b).squaredNorm() +
                   (price * scale).cwiseProduct(fit.intensity).squaredNorm();
    return fit;
}

struct KernelChoice {
    double g1 = 1, g2 = 1, mix = 1;
};

/// Huber's weights: creases, ears and other shape errors must not steer the lights.
VectorXd robust_weights(const MatrixXd& image, const VectorXd& intensity, const VectorXd& y,
                        const VectorXd& weight) {
    const VectorXd residual = weight.cwiseProduct(image * intensity - y);
    const double bend =
        1.5 * std::max(1e-6, robust_sd(std::vector<double>(residual.data(),
                                                           residual.data() + residual.size())));
    VectorXd result = weight;
    for (Index i = 0; i < residual.size(); ++i)
        if (std::abs(residual[i]) > bend) result[i] *= std::sqrt(bend / std::abs(residual[i]));
    return result;
}

/// The image operator of one kernel, for lights that move: exitance = near * local + far * source.
class KernelImage {
  public:
    KernelImage(const ReliefObservations& observations, const ReliefSamples& samples,
                const RadialKernel& kernel, const CurvedBodyFactor& body)
        : far_(static_cast<Index>(observations.position.size()),
               static_cast<Index>(samples.position.size())) {
        const CappedKernel capped(kernel, 1.5 * samples.step_px);
        near_ = capped.near_share();
        parallel_for(observations.position.size(), 8, [&](std::size_t p) {
            for (std::size_t i = 0; i < samples.position.size(); ++i) {
                float& entry = far_(static_cast<Index>(p), static_cast<Index>(i));
                entry = 0;
                if (!samples.ball.empty() && samples.ball[i] != observations.ball[p]) continue;
                const float rise = chord_rise(samples.position[i], samples.normal[i],
                                              observations.position[p], observations.normal[p]);
                entry = static_cast<float>(
                    capped((samples.position[i] - observations.position[p]).norm()) * body(rise));
            }
        });
    }
    MatrixXd operator()(const Fields& fields) const {
        return (far_ * fields.source).cast<double>() + near_ * fields.local.cast<double>();
    }

  private:
    Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> far_;
    double near_ = 0;
};

RadialKernel exponential(double g) {
    return [g](double r) { return std::exp(-r / g) / (2 * kPi * g * g); };
}

/// Directions nearer than `merge_deg` to a stronger one join it, weighted by intensity.
std::vector<ViewLight> merge_lights(const std::vector<Vec3>& directions, const VectorXd& intensity,
                                    double merge_deg, int max_lights) {
    std::vector<std::size_t> order;
    for (std::size_t l = 0; l < directions.size(); ++l)
        if (intensity[static_cast<Index>(l)] > 0) order.push_back(l);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return intensity[static_cast<Index>(a)] > intensity[static_cast<Index>(b)];
    });
    struct Group {
        Vec3 sum = Vec3::Zero();
        double intensity = 0;
    };
    std::vector<Group> groups;
    for (const std::size_t l : order) {
        const double value = intensity[static_cast<Index>(l)];
        Group* home = nullptr;
        for (Group& group : groups) {
            if (degrees(angle_between(group.sum, directions[l])) < merge_deg) {
                home = &group;
                break;
            }
        }
        if (home == nullptr) {
            groups.emplace_back();
            home = &groups.back();
        }
        home->sum += value * directions[l];
        home->intensity += value;
    }
    std::stable_sort(groups.begin(), groups.end(),
                     [](const Group& a, const Group& b) { return a.intensity > b.intensity; });
    std::vector<ViewLight> lights;
    for (const Group& group : groups) {
        if (static_cast<int>(lights.size()) == max_lights) break;
        if (group.intensity < 0.02 * groups.front().intensity) break;
        lights.push_back({group.sum.normalized(), Rgbd::Constant(group.intensity)});
    }
    return lights;
}

/// Where several highlights agree on a lamp, that is where it is: lights near it go there.
/// @returns which lights are held
std::vector<bool> snap_to_highlights(std::vector<ViewLight>& lights,
                                     std::span<const HighlightLight> highlight_lights,
                                     double reach_deg) {
    std::vector<bool> is_held(lights.size(), false);
    for (std::size_t h = 0; h < highlight_lights.size(); ++h) {
        if (highlight_lights[h].votes < 2) continue;
        std::size_t nearest = lights.size();
        double best = reach_deg;
        for (std::size_t l = 0; l < lights.size(); ++l) {
            const double apart =
                degrees(angle_between(lights[l].direction, highlight_lights[h].direction));
            if (apart >= best || is_held[l]) continue;
            best = apart;
            nearest = l;
        }
        if (nearest == lights.size()) continue;
        lights[nearest].direction = highlight_lights[h].direction;
        is_held[nearest] = true;
    }
    return is_held;
}

/// Mean colour of what surrounds the lower half of the object, luminance 1: what the ground throws
/// back. White where nothing is seen there.
Rgbd ground_colour(const ImageRgb& picture, const Relief& relief) {
    const ImageF away = distance_to(relief.mask);
    double row_sum = 0, count = 0;
    for (int y = 0; y < picture.height(); ++y) {
        for (int x = 0; x < picture.width(); ++x) {
            if (!is_inside(relief.mask, x, y)) continue;
            row_sum += y;
            count += 1;
        }
    }
    Rgbd sum = Rgbd::Zero();
    for (int y = static_cast<int>(row_sum / std::max(count, 1.0)); y < picture.height(); ++y) {
        for (int x = 0; x < picture.width(); ++x) {
            const float d = away(x, y);
            if (d > 3 && d < static_cast<float>(relief.inradius_px))
                sum += picture(x, y).cast<double>();
        }
    }
    const double y = luminance(sum);
    return y > 1e-6 ? (sum / y).eval() : Rgbd::Ones().eval();
}

}  // namespace

void normalise_and_warn(ViewLightsEstimate& estimate, const Relief& relief, double eta) {
    estimate.ambient_share = luminance(estimate.lights.ambient) / estimate.lights.total();
    normalise_lights(estimate.lights, relief, eta);
    if (estimate.ambient_share > 0.6) {
        estimate.warnings.push_back(
            "Flat light: most of it comes from everywhere, so how translucent the material is "
            "stays uncertain.");
    }
}

ViewLightsEstimate estimate_translucency_lights(const ImageRgb& diffuse, const Relief& relief,
                                                const Mask& excluded,
                                                std::span<const HighlightLight> highlight_lights,
                                                const TranslucencyLightOptions& options,
                                                const Progress& progress) {
    ViewLightsEstimate result;
    const double radius = relief.inradius_px;
    const ReliefObservations observations =
        draw_observations(relief, excluded, static_cast<std::size_t>(options.observation_count),
                          2.0, 0.2, stream_key(options.seed, 0x11));
    if (observations.pixel.size() < 50) {
        result.lights.ambient = Rgbd::Constant(kPi);
        result.outcome = Outcome::NotIdentifiable;
        result.reason = "too little of the object is free of highlights and rim";
        return result;
    }
    const VectorXd y = observed_exitance(diffuse, observations, options.eta);
    const VectorXd weight = y.cwiseMax(0.2).cwiseInverse();
    const ReliefSamples samples = sample_relief(relief, options.samples_per_side);
    Body body{relief, samples, observations, {}, {}};
    body.sample_sky = sky_shares(relief, body.sample_points());
    body.observation_sky = sky_shares(relief, body.observation_points());
    const CurvedBodyFactor factor =
        options.use_curved_body ? curved_body_factor(kTypicalAlbedo) : CurvedBodyFactor{};

    std::vector<Vec3> directions = fibonacci_directions(options.direction_count, -0.97);
    const std::size_t first_highlight = directions.size();
    for (std::size_t k = 0; k < std::min<std::size_t>(highlight_lights.size(), 4); ++k)
        directions.push_back(highlight_lights[k].direction);
    const auto count = static_cast<Index>(directions.size());

    // Softness steers which kernels are tried and how dear ambient light is.
    const double s = std::clamp(options.softness, 0.0, 1.0);
    const double g_low = 0.02 * std::pow(4.0, s) * radius, g_high = 0.1 * std::pow(6.0, s) * radius;
    VectorXd price(count + 2);
    for (Index l = 0; l < count; ++l) {
        const Vec3& w = directions[static_cast<std::size_t>(l)];
        price[l] = options.direction_penalty * (1 + 3 * std::max(0.0, -w.z()));
        if (static_cast<std::size_t>(l) >= first_highlight) price[l] *= options.highlight_discount;
    }
    price[count] = options.direction_penalty * std::pow(12.0, s);
    price[count + 1] = options.use_ground ? options.direction_penalty * kGroundPrice : 1e3;

    const Fields fields = body.fields(directions, true, options);
    const DistanceHistogram histogram(observations, samples, fields.source, fields.local, {factor});
    progress.update(0.4, "lights: light fields");

    constexpr int kWidths = 5;
    std::vector<double> widths;
    std::vector<MatrixXd> images;
    for (int i = 0; i < kWidths; ++i) {
        widths.push_back(g_low * std::pow(g_high / g_low, static_cast<double>(i) / (kWidths - 1)));
        images.push_back(histogram.image_of(exponential(widths.back())));
    }
    std::vector<KernelChoice> choices;
    for (int i = 0; i < kWidths; ++i) {
        choices.push_back({static_cast<double>(i), static_cast<double>(i), 1.0});
        for (int j = i + 1; j < kWidths; ++j)
            for (const double mix : {0.3, 0.6})
                choices.push_back({static_cast<double>(i), static_cast<double>(j), mix});
    }
    const auto mixed = [&](const KernelChoice& choice) -> MatrixXd {
        return choice.mix * images[static_cast<std::size_t>(choice.g1)] +
               (1 - choice.mix) * images[static_cast<std::size_t>(choice.g2)];
    };
    std::vector<Fit> fits(choices.size());
    parallel_for(choices.size(), 1, [&](std::size_t k) {
        const MatrixXd image = mixed(choices[k]);
        fits[k] = fit_intensities(image, y, weight, price);
        const VectorXd robust = robust_weights(image, fits[k].intensity, y, weight);
        fits[k] = fit_intensities(image, y, robust, price);
    });
    std::size_t best = 0;
    for (std::size_t k = 1; k < fits.size(); ++k)
        if (fits[k].residual < fits[best].residual) best = k;
    progress.update(0.8, "lights: kernels");

    const KernelChoice& choice = choices[best];
    const double w1 = widths[static_cast<std::size_t>(choice.g1)];
    const double w2 = widths[static_cast<std::size_t>(choice.g2)];
    result.kernel_px = 2 * (choice.mix * w1 + (1 - choice.mix) * w2);
    result.lights.lights = merge_lights(directions, fits[best].intensity.head(count),
                                        options.merge_deg, options.max_lights);

    const std::vector<bool> is_held =
        snap_to_highlights(result.lights.lights, highlight_lights, options.merge_deg);

    // The others move freely now, intensities follow: pattern search on the sphere.
    std::vector<Vec3> few;
    for (const ViewLight& light : result.lights.lights) few.push_back(light.direction);
    const KernelImage image_of(
        observations, samples,
        [&](double r) {
            return choice.mix * exponential(w1)(r) + (1 - choice.mix) * exponential(w2)(r);
        },
        factor);
    const MatrixXd sky_columns = image_of(body.fields({}, true, options));
    const auto column_of = [&](const Vec3& direction) -> VectorXd {
        return image_of(body.fields({direction}, false, options)).col(0);
    };
    const auto solve = [&](const MatrixXd& columns, const std::vector<Vec3>& trial,
                           const VectorXd& weights) {
        VectorXd few_price(static_cast<Index>(trial.size()) + 2);
        for (std::size_t l = 0; l < trial.size(); ++l) {
            few_price[static_cast<Index>(l)] =
                0.3 * options.direction_penalty * (1 + 3 * std::max(0.0, -trial[l].z()));
        }
        few_price.tail<2>() = price.tail<2>();
        return fit_intensities(columns, y, weights, few_price);
    };
    MatrixXd few_image(y.size(), static_cast<Index>(few.size()) + 2);
    for (std::size_t l = 0; l < few.size(); ++l)
        few_image.col(static_cast<Index>(l)) = column_of(few[l]);
    few_image.rightCols<2>() = sky_columns;
    const VectorXd few_weight =
        robust_weights(few_image, solve(few_image, few, weight).intensity, y, weight);
    Fit final_fit = solve(few_image, few, few_weight);
    const auto try_move = [&](std::size_t l, const Vec3& direction) {
        std::vector<Vec3> trial = few;
        trial[l] = direction;
        MatrixXd image = few_image;
        image.col(static_cast<Index>(l)) = column_of(direction);
        const Fit fit = solve(image, trial, few_weight);
        if (fit.residual >= final_fit.residual * (1 - 1e-3)) return false;
        final_fit = fit;
        few = trial;
        few_image = image;
        return true;
    };
    for (double step = radians(options.polish_deg); step > radians(1.0); step *= 0.5) {
        for (int round = 0; round < 4; ++round) {
            bool has_moved = false;
            for (std::size_t l = 0; l < few.size(); ++l) {
                if (is_held[l]) continue;
                const Vec3 side = few[l].unitOrthogonal(), up = few[l].cross(side);
                for (int k = 0; k < 6; ++k) {
                    const double turn = k * kPi / 3;
                    has_moved |= try_move(
                        l, std::cos(step) * few[l] +
                               std::sin(step) * (std::cos(turn) * side + std::sin(turn) * up));
                }
            }
            if (!has_moved) break;
        }
        progress.update(0.9, "lights: directions");
    }
    std::vector<ViewLight> kept;
    for (std::size_t l = 0; l < few.size(); ++l) {
        const double value = final_fit.intensity[static_cast<Index>(l)];
        if (value > 0) kept.push_back({few[l], Rgbd::Constant(value)});
    }
    std::stable_sort(kept.begin(), kept.end(), [](const ViewLight& a, const ViewLight& b) {
        return a.intensity[0] > b.intensity[0];
    });
    result.lights.lights = std::move(kept);
    result.lights.ambient = Rgbd::Constant(final_fit.intensity[static_cast<Index>(few.size())]);
    result.lights.from_below =
        ground_colour(diffuse, relief) * final_fit.intensity[static_cast<Index>(few.size()) + 1];
    const VectorXd misfit = weight.cwiseProduct(few_image * final_fit.intensity - y);
    result.relative_residual = std::sqrt(misfit.squaredNorm() / static_cast<double>(misfit.size()));
    if (result.lights.total() <= 0) {
        result.lights.ambient = Rgbd::Constant(kPi);
        result.outcome = Outcome::NotIdentifiable;
        result.reason = "no light explains the picture";
        return result;
    }
    normalise_and_warn(result, relief, options.eta);
    if (result.relative_residual > 0.25) {
        result.outcome = Outcome::Ambiguous;
        result.reason = "the lighting could not be explained well";
        result.warnings.push_back(
            fmt::format("The lighting could not be explained: the best model is off by {:.0f} %.",
                        100 * result.relative_residual));
    }
    return result;
}

}  // namespace vitrine
