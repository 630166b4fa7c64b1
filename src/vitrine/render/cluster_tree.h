// render/cluster_tree.h: sums of a radial kernel over many weighted points, far groups as one
// (Jensen and Buhler 2002, Sec. 4).
#pragma once

#include "render/kernel_table.h"

#include <span>

namespace vitrine {

/// A binary tree over points, built once; weights change per sum.
///
/// A group counts as one point at the centre of its weight when its radius is below `kOpening` of
/// the distance: within 1 % of the full sum for the profiles in use (tested). Memory 60 bytes per
/// point; a sum over n points at n places costs O(n log n), about 3 us per place.
class ClusterTree {
  public:
    static constexpr float kOpening = 0.18f;

    ClusterTree() = default;
    explicit ClusterTree(std::vector<Vec3f> points);

    /// The weights of all groups for weights `weight` of the points.
    class Weights {
      public:
        Weights(const ClusterTree& tree, std::span<const Rgb> weight);
        /// sum_i kernel(|place - point_i|) weight_i
        Rgb sum(const Vec3f& place, const KernelTable& kernel) const;

      private:
        struct Group {
            Vec3f centre;
            float opening2;  // squared distance beyond which it counts as one point
            Eigen::Array4f weight;
        };
        const ClusterTree& tree_;
        std::vector<Group> groups_;
        std::vector<Eigen::Array4f> weight_;  // in tree order
    };

    const std::vector<Vec3f>& points() const { return points_; }
    /// Squares of distances stay below this.
    float largest_square() const { return largest_square_; }

    /// Distances (squared) below this, as a share of the largest square, look up the kernel's top.
    static constexpr float kSmallestShare = 1e-9f;

  private:
    struct Node {
        std::uint32_t begin, end;  // of the points in tree order
        std::uint32_t second = 0;  // child; the first one follows its parent; 0: leaf
    };
    std::uint32_t build(std::uint32_t begin, std::uint32_t end);

    std::vector<Vec3f> points_;         // as given
    std::vector<std::uint32_t> order_;  // point numbers in tree order
    std::vector<Node> nodes_;
    float largest_square_ = 1.0f;
};

}  // namespace vitrine
