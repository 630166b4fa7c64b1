#include "estimate/bssrdf.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "estimate/distance_histogram.h"
#include "estimate/profile_fit.h"
#include "image/filter.h"
#include "math/statistics.h"

namespace vitrine {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Gaussian over the usable pixels only: mask without highlights.
ImageRgb smooth_inside(const ImageRgb& image, const Mask& mask, const Mask& excluded,
                       double sigma) {
    ImageRgb weighted(image.width(), image.height());
    ImageF weight(image.width(), image.height());
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] <= 127 || (!excluded.empty() && excluded[i] > 127)) continue;
        weighted[i] = image[i];
        weight[i] = 1;
    }
    weighted = gaussian_blur(weighted, sigma);
    weight = gaussian_blur(weight, sigma);
    for (std::size_t i = 0; i < mask.size(); ++i)
        weighted[i] = weight[i] > 1e-3f ? (weighted[i] / weight[i]).eval() : image[i];
    return weighted;
}

const char* const kChannelNames[3] = {"red", "green", "blue"};

/// Albedos as they will be once the brightest is brought down to `brightest`.
std::vector<CurvedBodyFactor> body_factors(const MediumEstimate& medium, double brightest) {
    double largest = 0;
    for (const TwoExponentials& fit : medium.fit) largest = std::max(largest, fit.total());
    const double scale = largest > brightest ? brightest / largest : 1.0;
    std::vector<CurvedBodyFactor> factors;
    for (const TwoExponentials& fit : medium.fit)
        factors.push_back(curved_body_factor(scale * fit.total()));
    return factors;
}

void judge(MediumEstimate& medium, int c, double longest_px, double mean_exitance) {
    ChannelFit& channel = medium.channels[static_cast<std::size_t>(c)];
    const TwoExponentials& fit = medium.fit[static_cast<std::size_t>(c)];
    channel.albedo = fit.total();
    channel.mean_radius_px = fit.mean_radius();
    const bool is_long = (fit.a > 0 && -1 / fit.b > 0.98 * longest_px) ||
                         (fit.c > 0 && -1 / fit.d > 0.98 * longest_px);
    if (mean_exitance < 0.02) {
        channel.outcome = Outcome::NotIdentifiable;
        channel.reason = "the channel is too dark";
        medium.warnings.push_back(
            fmt::format("The {} channel is too dark: its hue and scattering are unreliable.",
                        kChannelNames[c]));
    } else if (is_long) {
        channel.outcome = Outcome::AtBound;
        channel.reason = "the scattering length is a lower bound";
        medium.warnings.push_back(
            fmt::format("Very translucent or badly lit: the scattering length of the {} channel is "
                        "a lower bound.",
                        kChannelNames[c]));
    } else if (channel.relative_residual > 0.3) {
        channel.outcome = Outcome::Ambiguous;
        channel.reason = "the picture is not that of a homogeneous material";
        medium.warnings.push_back(fmt::format(
            "The material is textured ({} channel): its average is used.", kChannelNames[c]));
    }
}

void equivalent_media(MediumEstimate& medium) {
    for (std::size_t c = 0; c < 3; ++c) {
        const ChannelFit& channel = medium.channels[c];
        medium.dipole[c].reset();
        if (channel.albedo > 1e-4 && channel.albedo <= kDipoleMaxTotal &&
            channel.mean_radius_px > 0) {
            medium.dipole[c] = dipole_from_total_and_mean_radius(
                channel.albedo, channel.mean_radius_px, medium.eta);
        }
    }
}

}  // namespace

RadialProfile MediumEstimate::profile() const {
    double longest = 1e-9, shortest = 1e30;
    for (const TwoExponentials& channel : fit) {
        if (channel.a > 0) {
            longest = std::max(longest, -1 / channel.b);
            shortest = std::min(shortest, -1 / channel.b);
        }
        if (channel.c > 0) {
            longest = std::max(longest, -1 / channel.d);
            shortest = std::min(shortest, -1 / channel.d);
        }
    }
    if (shortest > longest) return tabulate(fit, 0.01, 1.0, 8);  // all black
    return tabulate(fit, 0.01 * shortest, 16 * longest);
}

namespace {

/// The profile for one way of entering: fresnel or not.
MediumEstimate fit_medium(const ImageRgb& diffuse, const Relief& relief, const Mask& excluded,
                          const EnteringLight& light, bool is_fresnel,
                          const BssrdfOptions& options) {
    MediumEstimate medium;
    medium.eta = options.eta;
    medium.is_fresnel = is_fresnel;
    medium.inradius_px = relief.inradius_px;
    const double surface_eta = is_fresnel ? options.eta : 1.0;
    const ReliefObservations observations =
        draw_observations(relief, excluded, static_cast<std::size_t>(options.pixel_count), 2.0,
                          0.25, stream_key(options.seed, 0x22));
    if (observations.pixel.size() < 50) {
        for (ChannelFit& channel : medium.channels) {
            channel.outcome = Outcome::NotIdentifiable;
            channel.reason = "too few usable pixels";
        }
        medium.warnings.push_back("Too little of the object is free of highlights and rim.");
        return medium;
    }
    const ReliefSamples samples = sample_relief(relief, options.samples_per_side);
    Eigen::MatrixXf source = irradiance_rows(
        light(relief, {samples.position, samples.normal, samples.ball}, surface_eta));
    for (Index i = 0; i < source.rows(); ++i)
        source.row(i) *= samples.area_px2[static_cast<std::size_t>(i)];
    const Eigen::MatrixXf local = irradiance_rows(light(
        relief, {observations.position, observations.normal, observations.ball}, surface_eta));

    const ImageRgb smooth =
        smooth_inside(diffuse, relief.mask, excluded, options.smoothing * relief.inradius_px);
    const MatrixXd exitance = exitance_rows(smooth, observations, surface_eta);
    double extent = 2 * relief.inradius_px;
    if (!relief.is_cluster())
        extent = 2 * std::sqrt(static_cast<double>(count_inside(relief.mask)) / kPi);

    ProfileFitOptions fit_options;
    fit_options.longest_px = options.longest * extent;
    fit_options.shortest_px = 0.5 * samples.step_px;
    fit_options.extent_px = extent;
    fit_options.shell_count = options.shell_count;
    fit_options.ridge = options.ridge;
    fit_options.prefers_random_walk = options.prefers_random_walk;
    const ShellGrid shells = make_shells(samples.step_px, extent, options.shell_count);

    // How much more a curved body passes depends on the albedo that is being looked for.
    std::vector<CurvedBodyFactor> factors;
    if (options.use_curved_body) factors.assign(3, curved_body_factor(0.5));
    const int rounds = options.use_curved_body ? 3 : 1;
    for (int round = 0; round < rounds; ++round) {
        const DistanceHistogram histogram(observations, samples, source, local, factors);
        const bool is_last = round + 1 == rounds;
        std::array<PiecewiseProfile, 3> pieces;
        if (is_last || options.solver == ProfileSolver::Qmr) {
            medium.piecewise = {};
            for (int c = 0; c < 3; ++c) {
                pieces[static_cast<std::size_t>(c)] =
                    options.solver == ProfileSolver::Qmr
                        ? fit_piecewise_qmr(histogram, exitance.col(c), c, fit_options)
                        : fit_piecewise_monotone(histogram, exitance.col(c), c, fit_options);
            }
            for (int k = 0; k < options.shell_count; ++k) {
                const auto i = static_cast<std::size_t>(k);
                medium.piecewise.r.push_back(0.5 * (shells.edge[i] + shells.edge[i + 1]));
                medium.piecewise.rd.push_back(
                    Rgbd(pieces[0].value[k], pieces[1].value[k], pieces[2].value[k]));
            }
        }
        if (options.solver == ProfileSolver::Qmr) {
            for (std::size_t c = 0; c < 3; ++c)
                medium.fit[c] = fit_exponentials_to_shells(shells, pieces[c].value, fit_options);
        } else if (options.coupling == ChannelCoupling::Free) {
            for (int c = 0; c < 3; ++c) {
                medium.fit[static_cast<std::size_t>(c)] =
                    fit_exponentials(histogram, exitance.col(c), c, fit_options);
            }
        } else {
            medium.fit = fit_ordered(histogram, exitance, fit_options);
        }
        if (!is_last) {
            factors = body_factors(medium, options.is_level_known ? 1.0 : kPlausibleAlbedo);
            continue;
        }
        for (int c = 0; c < 3; ++c) {
            const TwoExponentials& fit = medium.fit[static_cast<std::size_t>(c)];
            const VectorXd model = histogram.image_of(fit).col(c);
            const double mean_exitance = exitance.col(c).mean();
            medium.channels[static_cast<std::size_t>(c)].relative_residual =
                std::sqrt((model - exitance.col(c)).squaredNorm() /
                          static_cast<double>(model.size())) /
                std::max(mean_exitance, 1e-9);
            judge(medium, c, fit_options.longest_px, mean_exitance / kPi);
        }
    }
    equivalent_media(medium);
    return medium;
}

double total_residual(const MediumEstimate& medium) {
    double sum = 0;
    for (const ChannelFit& channel : medium.channels)
        if (channel.outcome != Outcome::NotIdentifiable) sum += channel.relative_residual;
    return sum;
}

}  // namespace

MediumEstimate estimate_bssrdf(const ImageRgb& diffuse, const Relief& relief, const Mask& excluded,
                               const EnteringLight& light, const BssrdfOptions& options,
                               const Progress& progress) {
    if (options.transmittance != Transmittance::Auto) {
        return fit_medium(diffuse, relief, excluded, light,
                          options.transmittance == Transmittance::Fresnel, options);
    }
    MediumEstimate fresnel = fit_medium(diffuse, relief, excluded, light, true, options);
    progress.update(0.5, "material: with Fresnel");
    MediumEstimate plain = fit_medium(diffuse, relief, excluded, light, false, options);
    progress.update(1.0, "material: done");
    return total_residual(plain) < total_residual(fresnel) ? plain : fresnel;
}

MediumEstimate estimate_bssrdf(const ImageRgb& diffuse, const Relief& relief, const Mask& excluded,
                               const ViewLights& lights, const BssrdfOptions& options,
                               const Progress& progress) {
    const EnteringLight light = [&](const Relief& lit, const SurfacePoints& points, double eta) {
        return entering_light(lit, points, lights, eta, options.use_shadows);
    };
    return estimate_bssrdf(diffuse, relief, excluded, light, options, progress);
}

double limit_albedo(MediumEstimate& medium) {
    double largest = 0;
    for (const ChannelFit& channel : medium.channels) largest = std::max(largest, channel.albedo);
    if (largest <= kPlausibleAlbedo) return 1;
    const double factor = kPlausibleAlbedo / largest;
    for (std::size_t c = 0; c < 3; ++c) {
        medium.fit[c].a *= factor;
        medium.fit[c].c *= factor;
        medium.channels[c].albedo *= factor;
    }
    for (Rgbd& rd : medium.piecewise.rd) rd *= factor;
    if (largest > 1.5) {
        medium.warnings.push_back(
            "The material photo shows more light than the estimated lamps can explain; the "
            "material's brightness was reduced to a plausible one.");
    }
    equivalent_media(medium);
    return 1 / factor;
}

}  // namespace vitrine
