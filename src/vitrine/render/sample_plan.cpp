#include "render/sample_plan.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>

namespace vitrine {

Image<int> plan_samples(const ImageF& variance, const Image<int>& count, const ImageF& target,
                        int max_samples, int multiple) {
    VITRINE_CHECK(variance.same_size(count) && variance.same_size(target));
    Image<int> plan(variance.width(), variance.height());
    parallel_for(static_cast<std::size_t>(plan.height()), 8, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < plan.width(); ++x) {
            double sum = 0;
            int neighbours = 0;
            constexpr int kReach = 2;
            for (int dy = -kReach; dy <= kReach; ++dy) {
                for (int dx = -kReach; dx <= kReach; ++dx) {
                    if (!plan.contains(x + dx, y + dy)) continue;
                    sum += variance(x + dx, y + dy);
                    ++neighbours;
                }
            }
            const double own = std::max(sum / neighbours, double(variance(x, y)));
            const int n = count(x, y);
            const double wanted = n * own / target(x, y);
            const auto samples =
                static_cast<int>(std::clamp(wanted, double(n), double(std::max(n, max_samples))));
            plan(x, y) = (samples + multiple - 1) / multiple * multiple;
        }
    });
    return plan;
}

}  // namespace vitrine
