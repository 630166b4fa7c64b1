#include "render/split_kernel.h"

namespace vitrine {

SplitKernel split_kernel(const RadialProfile& profile, double rho) {
    SplitKernel split;
    const double h = 0.05 * rho;
    const Rgbd value = profile.at(rho);
    // Steeper than this the kernel is all near, whatever the cap.
    const Rgbd steepest = Rgbd::Constant(-16.0 / rho);
    const Rgbd slope =
        ((profile.at(rho + h).max(1e-300).log() - profile.at(rho - h).max(1e-300).log()) / (2 * h))
            .max(steepest);
    const auto cap = [&](double r) -> Rgbd {
        return value * ((slope.min(0.0) / (2 * rho)) * (r * r - rho * rho)).exp();
    };
    constexpr int kSteps = 64;
    std::vector<double> edges;
    for (int i = 0; i <= kSteps; ++i) edges.push_back(rho * i / kSteps);
    const std::vector<Rgbd> within = profile.cumulative(edges);
    double second_moment = 0, weight = 0;
    for (int i = 0; i < kSteps; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const double r0 = edges[k], r1 = edges[k + 1], r = 0.5 * (r0 + r1);
        split.far.r.push_back(r0);
        split.far.rd.push_back(cap(r0));
        const Rgbd ring = within[k + 1] - within[k] - kPi * (r1 * r1 - r0 * r0) * cap(r);
        split.near_share += ring;
        second_moment += ring.max(0.0).sum() * r * r;
        weight += ring.max(0.0).sum();
    }
    if (weight > 0) split.near_sigma = std::sqrt(0.5 * second_moment / weight);
    split.far.r.push_back(rho);
    split.far.rd.push_back(value);
    for (std::size_t i = 0; i < profile.r.size(); ++i) {
        if (profile.r[i] <= rho) continue;
        split.far.r.push_back(profile.r[i]);
        split.far.rd.push_back(profile.rd[i]);
    }
    return split;
}

}  // namespace vitrine
