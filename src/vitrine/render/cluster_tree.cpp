#include "render/cluster_tree.h"

#include "base/error.h"

#include <algorithm>
#include <numeric>

namespace vitrine {
namespace {

constexpr std::uint32_t kLeafSize = 8;

}  // namespace

ClusterTree::ClusterTree(std::vector<Vec3f> points) : points_(std::move(points)) {
    order_.resize(points_.size());
    std::iota(order_.begin(), order_.end(), 0u);
    if (points_.empty()) return;
    nodes_.reserve(2 * points_.size() / kLeafSize + 16);
    build(0, static_cast<std::uint32_t>(points_.size()));
    Vec3f low = points_.front(), high = points_.front();
    for (const Vec3f& p : points_) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    largest_square_ = std::max((high - low).squaredNorm() * 1.001f, 1e-20f);
}

std::uint32_t ClusterTree::build(std::uint32_t begin, std::uint32_t end) {
    const auto index = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({begin, end});
    if (end - begin <= kLeafSize) return index;
    Vec3f low = points_[order_[begin]], high = low;
    for (std::uint32_t i = begin; i < end; ++i) {
        low = low.cwiseMin(points_[order_[i]]);
        high = high.cwiseMax(points_[order_[i]]);
    }
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                         const float x = points_[a][axis], y = points_[b][axis];
                         return x < y || (x == y && a < b);
                     });
    build(begin, middle);
    nodes_[index].second = build(middle, end);
    return index;
}

ClusterTree::Weights::Weights(const ClusterTree& tree, std::span<const Rgb> weight) : tree_(tree) {
    VITRINE_CHECK_EQ(weight.size(), tree.points_.size());
    for (const std::uint32_t i : tree.order_) {
        weight_.emplace_back(weight[i][0], weight[i][1], weight[i][2], 0.0f);
    }
    groups_.resize(tree.nodes_.size());
    for (std::size_t n = 0; n < groups_.size(); ++n) {
        const Node& node = tree.nodes_[n];
        Eigen::Array4d sum = Eigen::Array4d::Zero();
        Vec3 moment = Vec3::Zero(), middle = Vec3::Zero();
        double mass = 0;
        for (std::uint32_t i = node.begin; i < node.end; ++i) {
            const Vec3 p = tree.points_[tree.order_[i]].cast<double>();
            const double w = weight_[i].sum();
            sum += weight_[i].cast<double>();
            moment += w * p;
            middle += p;
            mass += w;
        }
        Group& group = groups_[n];
        group.weight = sum.cast<float>();
        group.centre =
            (mass > 0 ? Vec3(moment / mass) : Vec3(middle / (node.end - node.begin))).cast<float>();
        float radius2 = 0;
        for (std::uint32_t i = node.begin; i < node.end; ++i) {
            radius2 =
                std::max(radius2, (tree.points_[tree.order_[i]] - group.centre).squaredNorm());
        }
        group.opening2 = radius2 / (kOpening * kOpening);
    }
}

Rgb ClusterTree::Weights::sum(const Vec3f& place, const KernelTable& kernel) const {
    Eigen::Array4f total = Eigen::Array4f::Zero();
    if (tree_.nodes_.empty()) return total.head<3>();
    const float smallest = kSmallestShare * tree_.largest_square_;
    const auto look_up = [&](float square) {
        return kernel(std::clamp(square, smallest, tree_.largest_square_));
    };
    std::uint32_t pending[64];
    int count = 0;
    pending[count++] = 0;
    while (count > 0) {
        const std::uint32_t n = pending[--count];
        const Node& node = tree_.nodes_[n];
        const Group& group = groups_[n];
        const float square = (group.centre - place).squaredNorm();
        if (square > group.opening2) {
            total += look_up(square) * group.weight;
        } else if (node.second == 0) {
            for (std::uint32_t i = node.begin; i < node.end; ++i) {
                const Vec3f& p = tree_.points_[tree_.order_[i]];
                total += look_up((p - place).squaredNorm()) * weight_[i];
            }
        } else {
            pending[count++] = node.second;
            pending[count++] = n + 1;
        }
    }
    return total.head<3>();
}

}  // namespace vitrine
