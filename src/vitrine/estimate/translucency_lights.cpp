#include "estimate/translucency_lights.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "estimate/few_lamps.h"
#include "estimate/profile_fit.h"
#include "image/colour.h"
#include "image/filter.h"
#include "math/nnls.h"

#include <numeric>

namespace vitrine {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// By which balls light each other, before it is fitted (few_lamps.h).
constexpr double kUsualBounce = 0.3;
/// Light thrown back by the ground is common, but dearer than a lamp: it must earn its place.
constexpr double kGroundPrice = 2.0;
/// Few lamps are cheaper than many.
constexpr double kFewPrice = 0.3;
/// Balls are round but for a few degrees, so that shading places lamps better than their mirror
/// images do; on bumps that the relief lacks it does not. Half of what votes that agree may differ.
constexpr double kClusterReachDeg = 6.0;
/// What a picture of one body says of its lamps is limited by its shape, which is wrong in few and
/// wide places: so many independent looks.
constexpr double kLooksAtBody = 20.0;
/// Two lamps nearer than this are mostly one, split by such errors.
constexpr double kJoinDeg = 55.0;
/// Of the normals of an inflated silhouette where they face us; less toward the outline.
constexpr double kNormalError = radians(15.0);
constexpr double kSurestVote = radians(12.0);
/// Of the brightest channel's mean.
constexpr double kDarkChannel = 0.05;

/// The picture as the fit sees it: what would leave through a surface that holds nothing back.
MatrixXd observed_exitance(const ImageRgb& diffuse, const ReliefObservations& observations,
                           double eta) {
    const ImageRgb smooth = gaussian_blur(diffuse, 1.0);
    MatrixXd result(static_cast<Index>(observations.pixel.size()), 3);
    for (std::size_t p = 0; p < observations.pixel.size(); ++p) {
        result.row(static_cast<Index>(p)) =
            smooth[observations.pixel[p]].cast<double>().matrix().transpose() /
            leaving_transmittance(observations.normal[p], eta);
    }
    return result;
}

/// Channels far darker than the brightest say little, and that with noise: zeros.
MatrixXd without_dark_channels(MatrixXd exitance) {
    const double brightest = exitance.colwise().mean().maxCoeff();
    for (Index c = 0; c < 3; ++c)
        if (exitance.col(c).mean() < kDarkChannel * brightest) exitance.col(c).setZero();
    return exitance;
}

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
    return weight.cwiseProduct(huber_factors(residual, 1e-6).cwiseSqrt());
}

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

/// Highlights of a body, whose normals are known less well than those of balls.
std::vector<LampVote> votes_of(std::span<const HighlightLight> highlight_lights) {
    std::vector<LampVote> votes;
    double heaviest = 1e-12;
    for (const HighlightLight& light : highlight_lights) {
        const double normal_z2 = 0.5 * (1 + light.direction.z());
        // The votes of HighlightLight weigh less toward the outline, where on a body the normal is
        // known best; what lies within is guessed the worse the more it faces us.
        const double weight = luminance(light.intensity) / std::max(normal_z2, 0.05);
        heaviest = std::max(heaviest, weight);
        const double spread = std::max(kSurestVote, 2 * kNormalError * std::sqrt(normal_z2));
        votes.push_back({light.direction, weight, 1 / (spread * spread)});
    }
    // A lamp shows brightly here and faintly there.
    for (LampVote& vote : votes) vote.weight = std::sqrt(vote.weight / heaviest);
    return votes;
}

/// Directions about which most votes lie, each without those that the ones before explain.
std::vector<Vec3> vote_modes(std::span<const LampVote> votes) {
    std::vector<double> left;
    for (const LampVote& vote : votes) left.push_back(vote.weight);
    std::vector<Vec3> modes;
    while (modes.size() < 3 && modes.size() < votes.size()) {
        double most = 0;
        Vec3 mode = Vec3::Zero();
        for (const LampVote& centre : votes) {
            double sum = 0;
            Vec3 mean = Vec3::Zero();
            for (std::size_t b = 0; b < votes.size(); ++b) {
                const double w = left[b] * votes[b].concentration *
                                 std::exp(votes[b].concentration *
                                          (votes[b].direction.dot(centre.direction) - 1));
                sum += w;
                mean += w * votes[b].direction;
            }
            if (sum <= most) continue;
            most = sum;
            mode = mean.normalized();
        }
        if (most <= 0) break;
        modes.push_back(mode);
        for (std::size_t b = 0; b < votes.size(); ++b)
            left[b] *= 1 - std::exp(votes[b].concentration * (votes[b].direction.dot(mode) - 1));
    }
    return modes;
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

/// A glossy ball shows every lamp, a cluster shows each on most balls: where lamps were seen so
/// often, those that no highlight tells of are not there.
void drop_unseen(std::vector<ViewLight>& lights, std::vector<bool>& is_held,
                 std::span<const HighlightLight> highlight_lights) {
    constexpr int kManyVotes = 4;
    const bool is_glossy =
        std::any_of(highlight_lights.begin(), highlight_lights.end(),
                    [](const HighlightLight& light) { return light.votes >= kManyVotes; });
    if (!is_glossy) return;
    for (std::size_t l = lights.size(); l-- > 0;) {
        if (is_held[l] || lights.size() == 1) continue;
        lights.erase(lights.begin() + static_cast<std::ptrdiff_t>(l));
        is_held.erase(is_held.begin() + static_cast<std::ptrdiff_t>(l));
    }
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

void set_lights(const FewLamps& lamps, const Rgbd& ground, ViewLightsEstimate& result) {
    result.lights.lights.clear();
    for (std::size_t l = 0; l < lamps.directions.size(); ++l) {
        const double value = lamps.intensity[static_cast<Index>(l)];
        if (value > 0) result.lights.lights.push_back({lamps.directions[l], Rgbd::Constant(value)});
    }
    std::stable_sort(
        result.lights.lights.begin(), result.lights.lights.end(),
        [](const ViewLight& a, const ViewLight& b) { return a.intensity[0] > b.intensity[0]; });
    const auto sky = lamps.intensity.tail<2>();
    result.lights.ambient = Rgbd::Constant(sky[0]);
    result.lights.from_below = ground * sky[1];
    result.relative_residual = lamps.relative_residual;
    result.ball_albedo = lamps.ball_albedo;
    result.kernel = lamps.kernel;
    double sum = 0, count = 0;
    for (const TwoExponentials& kernel : lamps.kernel) {
        sum += kernel.mean_radius();
        count += kernel.total() > 0 ? 1 : 0;
    }
    result.kernel_px = sum / std::max(count, 1.0);
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
    const MatrixXd exitance = observed_exitance(diffuse, observations, options.eta);
    VectorXd y = exitance * Eigen::Vector3d(luminance(Rgbd(1, 0, 0)), luminance(Rgbd(0, 1, 0)),
                                            luminance(Rgbd(0, 0, 1)));
    y /= std::max(y.mean(), 1e-12);
    const VectorXd weight = y.cwiseMax(0.2).cwiseInverse();
    const LitRelief object(relief, sample_relief(relief, options.samples_per_side), observations,
                           options.eta, options.use_shadows);
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

    const LightFields fields = object.bounced(object.fields(directions, true), kUsualBounce);
    const DistanceHistogram histogram(observations, object.samples(), fields.source, fields.local,
                                      {factor});
    progress.update(0.4, "lights: light fields");

    constexpr int kWidths = 5;
    std::vector<MatrixXd> images;
    for (const double width : length_grid(g_low, g_high, kWidths))
        images.push_back(histogram.image_of(exponential(width)));
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

    result.lights.lights = merge_lights(directions, fits[best].intensity.head(count),
                                        options.merge_deg, options.max_lights);
    const bool use_votes = options.use_votes && !relief.is_cluster();
    std::vector<bool> is_held(result.lights.lights.size(), false);
    if (!use_votes)
        is_held = snap_to_highlights(result.lights.lights, highlight_lights, options.merge_deg);

    if (relief.is_cluster()) drop_unseen(result.lights.lights, is_held, highlight_lights);

    FewLampsOptions few;
    few.shortest_px = g_low;
    few.longest_px = g_high;
    few.lamp_price = kFewPrice * options.direction_penalty;
    few.ambient_price = price[count];
    few.ground_price = price[count + 1];
    few.first_step_deg = options.polish_deg;
    few.use_curved_body = options.use_curved_body;
    if (relief.is_cluster()) few.held_reach_deg = kClusterReachDeg;
    const Rgbd ground = ground_colour(diffuse, relief);
    std::vector<LampStart> starts(1);
    for (std::size_t l = 0; l < is_held.size(); ++l) {
        const Vec3& direction = result.lights.lights[l].direction;
        starts[0].directions.push_back(direction);
        starts[0].seen_at.push_back(is_held[l] ? SeenAt(direction) : std::nullopt);
    }
    if (!options.known_lamps.empty()) {
        starts.push_back(
            {options.known_lamps, std::vector<SeenAt>(options.known_lamps.size(), std::nullopt)});
    }
    std::vector<LampVote> votes;
    if (use_votes) {
        votes = votes_of(highlight_lights);
        few.looks = kLooksAtBody;
        few.lamp_cost = 1.5 * std::log(few.looks);  // two angles and a strength (Schwarz 1978)
        few.join_deg = kJoinDeg;
        const std::vector<Vec3> modes = vote_modes(votes);
        for (std::size_t k = 1; k < modes.size(); ++k)
            starts.push_back({{modes[0], modes[k]}, {std::nullopt, std::nullopt}});
    }
    const FewLamps lamps =
        fit_few_lamps(object, without_dark_channels(exitance), ground, starts, votes, few);
    progress.update(1.0, "lights: directions");
    set_lights(lamps, ground, result);
    if (result.lights.total() <= 0) {
        result.lights.ambient = Rgbd::Constant(kPi);
        result.outcome = Outcome::NotIdentifiable;
        result.reason = "no light explains the picture";
        return result;
    }
    normalise_and_warn(result, relief, options.eta);
    if (result.relative_residual > (use_votes ? 0.3 : 0.25)) {
        result.outcome = Outcome::Ambiguous;
        result.reason = "the lighting could not be explained well";
        result.warnings.push_back(
            fmt::format("The lighting could not be explained: the best model is off by {:.0f} %.",
                        100 * result.relative_residual));
    }
    return result;
}

}  // namespace vitrine
