// geometry/point_grid.h: points in space sorted into a hash grid, to find those near a place.
#pragma once

#include "math/vector.h"

#include <cstdint>
#include <span>
#include <vector>

namespace vitrine {

/// Immutable; 4 bytes per point and 4 to 8 per bucket. Building is linear in the count.
class PointGrid {
  public:
    PointGrid() = default;
    /// @param radius_m largest radius that `for_each_near` will be asked for
    PointGrid(std::span<const Vec3f> points, float radius_m);

    /// Calls `visit(index)` for each point within `radius_m` of `position`, and may call it for
    /// farther ones: the caller measures the distance, which it wants anyway. Each at most once.
    template <typename Visit>
    void for_each_near(const Vec3f& position, const Visit& visit) const {
        if (order_.empty()) return;
        const Eigen::Vector3i low =
            (position * inverse_cell_ - Vec3f::Constant(0.5f)).array().floor().cast<int>();
        std::uint32_t visited[8];
        int count = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const std::uint32_t bucket =
                bucket_of(low + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2));
            bool is_repeated = false;  // two cells in one bucket must not count twice
            for (int k = 0; k < count; ++k) is_repeated |= visited[k] == bucket;
            if (is_repeated) continue;
            visited[count++] = bucket;
            for (std::uint32_t i = start_[bucket]; i < start_[bucket + 1]; ++i) visit(order_[i]);
        }
    }

  private:
    std::uint32_t bucket_of(const Eigen::Vector3i& cell) const {
        const std::uint32_t hash = static_cast<std::uint32_t>(cell.x()) * 73856093u ^
                                   static_cast<std::uint32_t>(cell.y()) * 19349663u ^
                                   static_cast<std::uint32_t>(cell.z()) * 83492791u;
        return (hash ^ hash >> 15) & bucket_mask_;
    }

    std::vector<std::uint32_t> order_;  // point numbers by bucket, ascending within
    std::vector<std::uint32_t> start_;  // first of each bucket, and the end
    std::uint32_t bucket_mask_ = 0;
    float inverse_cell_ = 0.0f;
};

}  // namespace vitrine
