#include "reconstruct/vote_grid.h"

#include "base/parallel.h"

#include <algorithm>

namespace vitrine {
namespace {

constexpr double kHiddenMargin_m = 0.01;  // a surface this much nearer hides what is behind

float bad_fraction_at(const Vec3& p, std::span<const VoteView> views, int min_views) {
    int seen = 0, bad = 0;
    for (const VoteView& view : views) {
        const Vec3 q = view.camera->cam_from_world * p;
        if (q.z() <= 0.05) continue;
        const Vec2 pixel = view.camera->project_camera(q);
        const int x = static_cast<int>(std::lround(pixel.x()));
        const int y = static_cast<int>(std::lround(pixel.y()));
        if (!view.known->contains(x, y) || (*view.known)(x, y) < 128) continue;
        const bool is_bad_here = (*view.bad)(x, y) > 127;
        const double surface = (*view.model_m)(x, y);
        if (!is_bad_here && surface > 0 && surface + kHiddenMargin_m < q.z()) continue;
        ++seen;
        bad += is_bad_here ? 1 : 0;
    }
    return seen < min_views ? -1.0f : float(bad) / float(seen);
}

std::vector<VoxelCluster> connected_regions(const ScalarGrid& fraction,
                                            const std::vector<std::uint8_t>& is_in) {
    std::vector<std::uint8_t> is_done(is_in.size(), 0);
    std::vector<VoxelCluster> clusters;
    for (std::size_t seed = 0; seed < is_in.size(); ++seed) {
        if (!is_in[seed] || is_done[seed]) continue;
        VoxelCluster cluster;
        std::vector<std::size_t> stack = {seed};
        is_done[seed] = 1;
        while (!stack.empty()) {
            const std::size_t node = stack.back();
            stack.pop_back();
            cluster.nodes.push_back(node);
            const Eigen::Vector3i c = fraction.node_of(node);
            cluster.box.extend(fraction.node(c.x(), c.y(), c.z()));
            cluster.bad_fraction += fraction.values[node];
            for (int d = 0; d < 6; ++d) {
                Eigen::Vector3i n = c;
                n[d / 2] += d % 2 ? 1 : -1;
                if (!fraction.contains(n.x(), n.y(), n.z())) continue;
                const std::size_t next = fraction.index(n.x(), n.y(), n.z());
                if (!is_in[next] || is_done[next]) continue;
                is_done[next] = 1;
                stack.push_back(next);
            }
        }
        std::sort(cluster.nodes.begin(), cluster.nodes.end());
        cluster.bad_fraction /= double(cluster.nodes.size());
        cluster.volume_m3 = double(cluster.nodes.size()) * std::pow(fraction.spacing_m, 3);
        clusters.push_back(std::move(cluster));
    }
    return clusters;
}

}  // namespace

Votes vote_for_bad_depth(std::span<const VoteView> views, const Box3& box, const Plane& support,
                         const VoteOptions& options) {
    Votes votes;
    votes.fraction = ScalarGrid(box, options.voxel_m, -1.0f);
    ScalarGrid& grid = votes.fraction;
    parallel_for(grid.values.size(), 8192, [&](std::size_t i) {
        const Eigen::Vector3i c = grid.node_of(i);
        const Vec3 p = grid.node(c.x(), c.y(), c.z());
        if (support.height(p) < options.voxel_m) return;
        grid.values[i] = bad_fraction_at(p, views, options.min_views);
    });
    std::vector<std::uint8_t> is_in(grid.values.size());
    for (std::size_t i = 0; i < is_in.size(); ++i) {
        is_in[i] = grid.values[i] >= options.min_bad_fraction ? 1 : 0;
    }
    for (VoxelCluster& cluster : connected_regions(grid, is_in)) {
        if (cluster.volume_m3 >= options.min_volume_m3) {
            votes.clusters.push_back(std::move(cluster));
        }
    }
    std::stable_sort(
        votes.clusters.begin(), votes.clusters.end(),
        [](const VoxelCluster& a, const VoxelCluster& b) { return a.volume_m3 > b.volume_m3; });
    return votes;
}

}  // namespace vitrine
