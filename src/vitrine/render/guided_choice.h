// render/guided_choice.h: picks one of many by weight, in constant time and in order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace vitrine {

/// Index with probability weights[i] / sum by inversion of the running sum, which keeps numbers
/// that are spread well over [0, 1) spread well over the indices. A table of where to begin (Chen
/// and Asau 1974) makes it two look-ups in memory, however many weights there are.
class GuidedChoice {
  public:
    GuidedChoice() = default;
    /// @param weights not negative, not all zero
    explicit GuidedChoice(std::span<const double> weights);

    bool empty() const { return above_.empty(); }
    /// @param u in [0, 1)
    std::size_t pick(float u) const {
        std::size_t i = guide_[static_cast<std::size_t>(u * static_cast<float>(guide_.size()))];
        while (u >= above_[i] && i + 1 < above_.size()) ++i;
        return i;
    }
    double probability(std::size_t index) const {
        return static_cast<double>(above_[index]) - (index > 0 ? above_[index - 1] : 0.0f);
    }

  private:
    std::vector<float> above_;  // running sums, each with its own weight; the last is 1
    std::vector<std::uint32_t> guide_;
};

}  // namespace vitrine
