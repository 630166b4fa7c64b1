#include "estimate/back_surface.h"

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

/// A place whose misfit is beyond this (squared, relative) is not explained by any thickness.
constexpr double kLargestCost = 0.25;
/// No picture is explained better than to 4 %.
constexpr double kSmallestCost = 0.0016;
/// Thin parts smaller than this share of the object are errors of light or shape.
constexpr double kLeastShare = 0.02;

bool is_thinner(float before, float after) { return after < 0.7f * before; }

MatrixXd predicted_exitance(const Relief& relief, const ReliefObservations& observations,
                            const EnteringLight& light, const MediumEstimate& medium, double eta,
                            int samples_per_side) {
    const ReliefSamples samples = sample_relief(relief, samples_per_side);
    Eigen::MatrixXf source =
        irradiance_rows(light(relief, {samples.position, samples.normal, {}}, eta));
    for (Index i = 0; i < source.rows(); ++i)
        source.row(i) *= samples.area_px2[static_cast<std::size_t>(i)];
    const Eigen::MatrixXf local =
        irradiance_rows(light(relief, {observations.position, observations.normal, {}}, eta));
    std::vector<CurvedBodyFactor> bodies;
    for (const TwoExponentials& fit : medium.fit)
        bodies.push_back(curved_body_factor(std::min(fit.total(), kPlausibleAlbedo)));
    const DistanceHistogram histogram(observations, samples, source, local, bodies);
    MatrixXd result(static_cast<Index>(observations.pixel.size()), 3);
    for (int c = 0; c < 3; ++c)
        result.col(c) = histogram.image_of(medium.fit[static_cast<std::size_t>(c)]).col(c);
    return result;
}

/// Sums over neighbouring observations, weighted by a Gaussian of their distance in the picture.
MatrixXd pooled(const MatrixXd& cost, const ReliefObservations& observations, double sigma) {
    MatrixXd result(cost.rows(), cost.cols());
    parallel_for(observations.position.size(), 16, [&](std::size_t p) {
        const Vec2f centre = observations.position[p].head<2>();
        Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(cost.cols());
        double weights = 0;
        for (std::size_t q = 0; q < observations.position.size(); ++q) {
            const double d2 = (observations.position[q].head<2>() - centre).squaredNorm();
            if (d2 > 9 * sigma * sigma) continue;
            const double w = std::exp(-0.5 * d2 / (sigma * sigma));
            sum += w * cost.row(static_cast<Index>(q));
            weights += w;
        }
        result.row(static_cast<Index>(p)) = sum / weights;
    });
    return result;
}

}  // namespace

ImageF thickness_of(const Relief& relief) {
    ImageF result(relief.mask.width(), relief.mask.height());
    for (int y = 0; y < result.height(); ++y)
        for (int x = 0; x < result.width(); ++x)
            if (is_inside(relief.mask, x, y))
                result(x, y) = relief.depth_px(x, y) - relief.back_px(x, y);
    return result;
}

Relief with_thickness(const Relief& relief, const ImageF& thickness_px) {
    Relief result = relief;
    result.middle_px = ImageF(relief.mask.width(), relief.mask.height());
    for (std::size_t i = 0; i < relief.mask.size(); ++i)
        if (relief.mask[i] > 127) result.middle_px[i] = relief.depth_px[i] - 0.5f * thickness_px[i];
    return result;
}

std::optional<Relief> refine_back(const Relief& start, const ImageRgb& diffuse,
                                  const Mask& excluded, const EnteringLight& light,
                                  const MediumEstimate& medium, const BackSurfaceOptions& options) {
    if (start.is_cluster()) return {};
    const double eta = medium.is_fresnel ? medium.eta : 1.0;
    const ReliefObservations observations =
        draw_observations(start, excluded, static_cast<std::size_t>(options.observation_count), 2.0,
                          0.2, stream_key(options.seed, 0x33));
    if (observations.pixel.size() < 50) return {};
    const MatrixXd observed = exitance_rows(gaussian_blur(diffuse, 1.0), observations, eta);
    const Index rows = observed.rows();

    // Caps, thickest first; the first is none at all.
    const ImageF whole = thickness_of(start);
    std::vector<double> caps;
    const double thickest = 2 * start.inradius_px;
    for (int k = 0; k < options.label_count; ++k)
        caps.push_back(thickest * std::pow(options.thinnest / 2,
                                           static_cast<double>(k) / (options.label_count - 1)));
    MatrixXd cost(rows, options.label_count);
    for (int k = 0; k < options.label_count; ++k) {
        ImageF thickness = whole;
        if (k > 0)
            for (float& t : thickness)
                t = std::min(t, static_cast<float>(caps[static_cast<std::size_t>(k)]));
        const MatrixXd model = predicted_exitance(with_thickness(start, thickness), observations,
                                                  light, medium, eta, options.samples_per_side);
        for (Index p = 0; p < rows; ++p) {
            double sum = 0;
            for (int c = 0; c < 3; ++c) {
                const double y = std::max(observed(p, c), 0.2 * observed.col(c).mean());
                sum += std::pow((model(p, c) - observed(p, c)) / y, 2) / 3;
            }
            cost(p, k) = std::min(sum, kLargestCost);
        }
    }
    const MatrixXd shared = pooled(cost, observations, options.window * start.inradius_px);
    // What the model leaves unexplained elsewhere is no reason to wear the body thin.
    const VectorXd thickest_cost = shared.col(0);
    const double price =
        options.price *
        std::max(median(std::vector<double>(thickest_cost.data(),
                                            thickest_cost.data() + thickest_cost.size())),
                 kSmallestCost);
    VectorXd log_cap(rows);
    for (Index p = 0; p < rows; ++p) {
        int best = 0;
        for (int k = 1; k < options.label_count; ++k)
            if (shared(p, k) + price * k < shared(p, best) + price * best) best = k;
        log_cap[p] = std::log(caps[static_cast<std::size_t>(best)]);
    }
    // Between the observations: their weighted mean, on a grid of a twentieth of the inradius.
    const int block = std::max(1, static_cast<int>(0.05 * start.inradius_px));
    const int columns = (start.mask.width() + block - 1) / block + 1;
    const int lines = (start.mask.height() + block - 1) / block + 1;
    ImageF sum(columns, lines), weight(columns, lines);
    const auto width = static_cast<std::size_t>(start.mask.width());
    for (Index p = 0; p < rows; ++p) {
        const std::size_t i = observations.pixel[static_cast<std::size_t>(p)];
        const int u = static_cast<int>(i % width) / block, v = static_cast<int>(i / width) / block;
        sum(u, v) += static_cast<float>(log_cap[p]);
        weight(u, v) += 1;
    }
    const double sigma = 0.7 * options.window * start.inradius_px / block;
    sum = gaussian_blur(sum, sigma);
    weight = gaussian_blur(weight, sigma);
    ImageF thickness = whole;
    for (int y = 0; y < thickness.height(); ++y) {
        for (int x = 0; x < thickness.width(); ++x) {
            if (!is_inside(start.mask, x, y)) continue;
            const float u = (static_cast<float>(x) + 0.5f) / static_cast<float>(block) - 0.5f;
            const float v = (static_cast<float>(y) + 0.5f) / static_cast<float>(block) - 0.5f;
            const float w = bilinear(weight, u, v);
            if (w < 1e-4f) continue;
            const float cap = std::exp(bilinear(sum, u, v) / w);
            thickness(x, y) = std::min(thickness(x, y), cap);
        }
    }
    std::size_t inside = 0, thin = 0;
    for (std::size_t i = 0; i < thickness.size(); ++i) {
        if (start.mask[i] <= 127) continue;
        ++inside;
        if (is_thinner(whole[i], thickness[i])) ++thin;
    }
    if (static_cast<double>(thin) < kLeastShare * static_cast<double>(inside)) return {};
    return with_thickness(start, thickness);
}

Mask with_thin_parts(const Mask& excluded, const Relief& start, const Relief& refined) {
    if (start.is_cluster()) return excluded;
    const ImageF before = thickness_of(start), after = thickness_of(refined);
    Mask result = excluded.empty() ? Mask(before.width(), before.height()) : excluded;
    for (std::size_t i = 0; i < result.size(); ++i)
        if (is_thinner(before[i], after[i])) result[i] = 255;
    return result;
}

BodyEstimate estimate_body(const Relief& start, const ImageRgb& diffuse, const Mask& excluded,
                           const EnteringLight& light, const BssrdfOptions& bssrdf,
                           const BackSurfaceOptions& back, const Progress& progress) {
    BodyEstimate body{start, estimate_bssrdf(diffuse, start, excluded, light, bssrdf)};
    for (int round = 0; round < back.rounds; ++round) {
        progress.update(static_cast<double>(round) / back.rounds, "material: thickness");
        const std::optional<Relief> refined =
            refine_back(start, diffuse, excluded, light, body.medium, back);
        if (!refined) break;
        body.relief = *refined;
        body.has_thin_parts = true;
        body.medium = estimate_bssrdf(diffuse, body.relief,
                                      with_thin_parts(excluded, start, body.relief), light, bssrdf);
    }
    progress.update(1.0, "material: done");
    return body;
}

}  // namespace vitrine
