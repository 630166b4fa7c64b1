#include "estimate/front_refinement.h"

#include "estimate/back_surface.h"
#include "image/filter.h"

namespace vitrine {
namespace {

/// A round asks for at most so much more or less light than the one before.
constexpr float kLargestCorrection = 2;

bool is_compared(const Relief& relief, const Mask& excluded, std::size_t i) {
    return relief.mask[i] > 127 && (excluded.empty() || excluded[i] <= 127);
}

double misfit(const ImageRgb& rendered, const ImageRgb& shown, const Relief& relief,
              const Mask& excluded) {
    double sum = 0;
    for (std::size_t i = 0; i < shown.size(); ++i)
        if (is_compared(relief, excluded, i))
            sum += (rendered[i] - shown[i]).matrix().squaredNorm();
    return sum;
}

/// What the photograph has over the rendering, by pixel; 1 where nothing is compared.
ImageF shortfall(const ImageRgb& rendered, const ImageRgb& shown, const Relief& relief,
                 const Mask& excluded) {
    ImageF ratio(shown.width(), shown.height(), 1.0f);
    for (std::size_t i = 0; i < shown.size(); ++i) {
        const float model = luminance(rendered[i]);
        if (!is_compared(relief, excluded, i) || model <= 1e-6f) continue;
        ratio[i] =
            std::clamp(luminance(shown[i]) / model, 1 / kLargestCorrection, kLargestCorrection);
    }
    return ratio;
}

}  // namespace

RefinedFront refine_front(const Relief& start, const Relief& dome, const ImageRgb& diffuse,
                          const Mask& excluded, const ViewLights& lights, double kernel_px,
                          double eta, const ReliefRenderer& render,
                          const FrontRefinementOptions& options) {
    VITRINE_CHECK(!start.is_cluster());
    RefinedFront best{start, render(start)};
    if (lights.lights.empty()) return best;
    ReliefRefinementOptions refinement;
    refinement.bending = options.bending;
    const ImageF thickness = thickness_of(start);
    ImageRgb target = diffuse;
    double lowest = misfit(best.rendered, diffuse, start, excluded);
    for (int round = 0; round < options.rounds; ++round) {
        const ImageF factor = gaussian_blur(shortfall(best.rendered, diffuse, start, excluded),
                                            options.smooth * start.inradius_px);
        for (std::size_t i = 0; i < target.size(); ++i) target[i] *= factor[i];
        RefinedFront next{with_thickness(refine_relief(dome, target, excluded, lights, kernel_px,
                                                       eta, refinement),
                                         thickness),
                          {}};
        next.rendered = render(next.relief);
        const double left = misfit(next.rendered, diffuse, start, excluded);
        if (left > 0.99 * lowest) break;
        lowest = left;
        best = std::move(next);
    }
    return best;
}

}  // namespace vitrine
