#include "render/translucent_body.h"

#include "base/parallel.h"
#include "math/rigid3.h"
#include "render/split_kernel.h"

namespace vitrine {
namespace {

/// Nearer than this many spacings the kernel is capped in the sum over samples.
constexpr double kCapSpacings = 2.0;
/// Radius of the samples that an interpolated value rests on, in spacings: 12 to 16 of them.
constexpr float kFitSpacings = 2.1f;
/// Width of the near part (Gaussian, in spacings) below which it is paint, above which the samples
/// hold it.
constexpr double kPaintWidth = 0.15, kHeldWidth = 0.5;
/// Channels darker than this share of the brightest do not ask for finer samples.
constexpr double kDarkShare = 0.05;

double choose_spacing(const RadialProfile& profile, double area,
                      const TranslucentBodyOptions& options) {
    const Rgbd total = profile.total(), radius = profile.mean_radius();
    double shortest = 1e30;
    for (int c = 0; c < 3; ++c) {
        if (total[c] > kDarkShare * total.maxCoeff()) shortest = std::min(shortest, radius[c]);
    }
    return std::clamp(options.spacing_share * shortest, std::sqrt(area / options.max_samples),
                      std::sqrt(area / options.min_samples));
}

}  // namespace

TranslucentBody::TranslucentBody(std::shared_ptr<const Mesh> mesh, const Translucent& material,
                                 const TranslucentBodyOptions& options) {
    const RadialProfile profile{material.r_m, material.rd_per_m2};
    const double area = surface_area(*mesh);
    VITRINE_CHECK_GT(area, 0.0);
    spacing_m_ = choose_spacing(profile, area, options);
    samples_ = sample_evenly(*mesh, spacing_m_, options.seed);
    grid_ = PointGrid(samples_.points, kFitSpacings * static_cast<float>(spacing_m_));
    tree_ = ClusterTree(samples_.points);
    const SplitKernel split = split_kernel(profile, kCapSpacings * spacing_m_);
    // Interpolation blurs by 0.7 spacings: about the width of the near part of a profile that the
    // samples resolve.
    const double width = split.near_sigma / spacing_m_;
    const auto held = static_cast<float>(
        std::clamp((width - kPaintWidth) / (kHeldWidth - kPaintWidth), 0.0, 1.0));
    const Rgb near = split.near_share.max(0.0).cast<float>();
    sample_share_ = held * near;
    near_share_ = near - sample_share_;
    albedo_ = profile.total().cast<float>();
    far_kernel_ = std::make_unique<KernelTable>(
        split.far, ClusterTree::kSmallestShare * tree_.largest_square(), tree_.largest_square());
}

std::vector<Rgb> TranslucentBody::exitance(std::span<const Rgb> irradiance) const {
    VITRINE_CHECK_EQ(irradiance.size(), samples_.size());
    std::vector<Rgb> power(irradiance.begin(), irradiance.end());
    for (std::size_t i = 0; i < power.size(); ++i) power[i] *= samples_.area_m2[i];
    const ClusterTree::Weights weights(tree_, power);
    std::vector<Rgb> exitance(power.size());
    parallel_for(power.size(), 256, [&](std::size_t i) {
        exitance[i] = weights.sum(samples_.points[i], *far_kernel_) + sample_share_ * irradiance[i];
    });
    return exitance;
}

Rgb TranslucentBody::interpolate(std::span<const Rgb> values, const Vec3f& position,
                                 const Vec3f& normal) const {
    const float radius = kFitSpacings * static_cast<float>(spacing_m_);
    const float inverse = 1.0f / radius;
    const Frame frame(normal);
    Mat3f moments = Mat3f::Zero();  // of (1, u, v)
    Mat3f sums = Mat3f::Zero();     // rows: channels
    Rgb low = Rgb::Constant(1e30f), high = Rgb::Constant(-1e30f);
    grid_.for_each_near(position, [&](std::uint32_t i) {
        const Vec3f d = (samples_.points[i] - position) * inverse;
        const float facing = samples_.normals[i].dot(normal);
        const float rest = 1.0f - d.squaredNorm();
        if (facing <= 0 || rest <= 0) return;
        const float weight = facing * rest * rest;
        const Vec3f basis(1.0f, d.dot(frame.tangent), d.dot(frame.bitangent));
        moments += weight * basis * basis.transpose();
        sums += weight * values[i].matrix() * basis.transpose();
        low = low.min(values[i]);
        high = high.max(values[i]);
    });
    if (!(moments(0, 0) > 0)) return Rgb::Zero();
    // A little stiffness: samples in a line, or one alone, give their mean.
    const float stiffness = 1e-3f * moments(0, 0);
    moments(1, 1) += stiffness;
    moments(2, 2) += stiffness;
    const Vec3f weights = moments.inverse().col(0);  // moments is symmetric
    return (sums * weights).array().max(low).min(high);
}

int TranslucentBody::nearest_sample(const Vec3f& position, const Vec3f& normal) const {
    int nearest = -1;
    float best = 1e30f;
    grid_.for_each_near(position, [&](std::uint32_t i) {
        if (samples_.normals[i].dot(normal) <= 0) return;
        const float d = (samples_.points[i] - position).squaredNorm();
        if (d >= best) return;
        best = d;
        nearest = static_cast<int>(i);
    });
    return nearest;
}

}  // namespace vitrine
