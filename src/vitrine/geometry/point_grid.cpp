#include "geometry/point_grid.h"

namespace vitrine {

PointGrid::PointGrid(std::span<const Vec3f> points, float radius_m)
    : inverse_cell_(0.5f / radius_m) {
    std::uint32_t buckets = 1;
    while (buckets < points.size() && buckets < (1u << 24)) buckets *= 2;
    bucket_mask_ = buckets - 1;
    start_.assign(std::size_t{buckets} + 1, 0);
    std::vector<std::uint32_t> bucket(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        bucket[i] = bucket_of((points[i] * inverse_cell_).array().floor().cast<int>());
        ++start_[bucket[i] + 1];
    }
    for (std::size_t b = 0; b < buckets; ++b) start_[b + 1] += start_[b];
    order_.resize(points.size());
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i) {
        order_[next[bucket[i]]++] = static_cast<std::uint32_t>(i);
    }
}

}  // namespace vitrine
