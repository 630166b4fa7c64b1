#include "render/guided_choice.h"

#include "base/error.h"

namespace vitrine {

GuidedChoice::GuidedChoice(std::span<const double> weights) {
    double sum = 0;
    for (const double weight : weights) {
        VITRINE_CHECK_GE(weight, 0.0);
        sum += weight;
    }
    VITRINE_CHECK_GT(sum, 0.0);
    double running = 0;
    for (const double weight : weights) {
        running += weight;
        above_.push_back(static_cast<float>(running / sum));
    }
    above_.back() = 1.0f;
    guide_.resize(weights.size());
    std::size_t i = 0;
    for (std::size_t k = 0; k < guide_.size(); ++k) {
        // Rounded down twice, so that no number of the cell begins too far.
        const double start = (static_cast<double>(k) - 0.5) / static_cast<double>(guide_.size());
        while (above_[i] <= start) ++i;
        guide_[k] = static_cast<std::uint32_t>(i);
    }
}

}  // namespace vitrine
