// render/kernel_table.h: R_d by squared distance, for sums over millions of pairs.
#pragma once

#include "optics/radial_profile.h"

#include <bit>
#include <vector>

namespace vitrine {

/// Three channels of R_d(sqrt(q)) looked up by the leading bits of the float q: 512 entries per
/// doubling of q, so the distance is resolved to 0.1 % and no square root is taken.
class KernelTable {
  public:
    using Value = Eigen::Array4f;

    KernelTable(const RadialProfile& profile, float q_min, float q_max)
        : base_(std::bit_cast<std::uint32_t>(q_min) >> kShift) {
        const std::uint32_t last = std::bit_cast<std::uint32_t>(q_max) >> kShift;
        values_.reserve(last - base_ + 1);
        for (std::uint32_t i = base_; i <= last; ++i) {
            const float q = std::bit_cast<float>((i << kShift) | (1u << (kShift - 1)));
            const Rgbd rd = profile.at(std::sqrt(static_cast<double>(q)));
            values_.emplace_back(static_cast<float>(rd[0]), static_cast<float>(rd[1]),
                                 static_cast<float>(rd[2]), 0.0f);
        }
    }

    /// @param q squared distance within [q_min, q_max]
    const Value& operator()(float q) const {
        return values_[(std::bit_cast<std::uint32_t>(q) >> kShift) - base_];
    }

  private:
    static constexpr unsigned kShift = 14;
    std::uint32_t base_;
    std::vector<Value> values_;
};

}  // namespace vitrine
