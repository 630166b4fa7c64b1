#include "render/hemisphere_photons.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "math/sampling.h"

#include <algorithm>

namespace vitrine {

namespace {

constexpr std::size_t kLeaf = 8;  // photons of a range that is no longer split

/// Nearest photons so far, farthest on top.
struct Nearest {
    std::vector<float> heap;
    std::size_t count;
    float limit() const { return heap.size() < count ? 1e30f : heap.front(); }
    void add(float distance2) {
        if (heap.size() == count) {
            std::pop_heap(heap.begin(), heap.end());
            heap.back() = distance2;
        } else {
            heap.push_back(distance2);
        }
        std::push_heap(heap.begin(), heap.end());
    }
};

}  // namespace

std::vector<PhotonHit> trace_hemisphere_photons(const EstimationScene& scene,
                                                const Vec3& position_m, const Vec3& axis,
                                                const HemispherePhotonOptions& options) {
    constexpr std::size_t kBlock = 16384;
    const auto count = static_cast<std::size_t>(options.photon_count);
    std::vector<std::vector<PhotonHit>> blocks((count + kBlock - 1) / kBlock);
    const Frame lamp(axis.cast<float>());
    parallel_for_blocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
        std::vector<PhotonHit>& hits = blocks[begin / kBlock];
        for (std::size_t i = begin; i < end; ++i) {
            Rng rng(stream_key(options.seed, i));
            const Vec2f u(rng.next_float(), rng.next_float());
            Vec3f origin = position_m.cast<float>();
            Vec3f direction = lamp.to_world(sample_uniform_cone(u, 0.0f));
            for (int bounce = 0; bounce <= options.max_bounces; ++bounce) {
                const Hit hit = scene.accel().closest({origin, direction, 0.0f, 1e30f, kScanMask});
                if (!hit.is_hit() || hit.normal.dot(direction) >= 0.0f) break;
                const Vec3f at = hit_point(scene.mesh(hit.part), hit);
                hits.push_back({at, direction});
                if (rng.next_float() >= options.albedo) break;
                origin = at + scene.offset_m() * hit.normal;
                const Vec2f v(rng.next_float(), rng.next_float());
                direction = Frame(hit.normal).to_world(sample_cosine_hemisphere(v));
            }
        }
    });
    std::vector<PhotonHit> all;
    for (const std::vector<PhotonHit>& block : blocks)
        all.insert(all.end(), block.begin(), block.end());
    return all;
}

PhotonTree::PhotonTree(std::vector<PhotonHit> photons) : photons_(std::move(photons)) {
    axis_.assign(photons_.size(), 0);
    std::vector<std::pair<std::size_t, std::size_t>> todo = {{0, photons_.size()}};
    while (!todo.empty()) {
        const auto [begin, end] = todo.back();
        todo.pop_back();
        if (end - begin <= kLeaf) continue;
        Vec3f low = Vec3f::Constant(1e30f), high = Vec3f::Constant(-1e30f);
        for (std::size_t i = begin; i < end; ++i) {
            low = low.cwiseMin(photons_[i].position);
            high = high.cwiseMax(photons_[i].position);
        }
        int axis = 0;
        (high - low).maxCoeff(&axis);
        const std::size_t middle = begin + (end - begin) / 2;
        const auto at = [&](std::size_t i) { return photons_.begin() + static_cast<long>(i); };
        std::nth_element(at(begin), at(middle), at(end),
                         [axis](const PhotonHit& a, const PhotonHit& b) {
                             return a.position[axis] < b.position[axis];
                         });
        axis_[middle] = static_cast<std::uint8_t>(axis);
        todo.emplace_back(begin, middle);
        todo.emplace_back(middle + 1, end);
    }
}

PhotonTree::Gathered PhotonTree::nearest(const SurfacePoint& point, int count) const {
    Nearest found{{}, static_cast<std::size_t>(std::max(count, 1))};
    found.heap.reserve(found.count);
    const auto visit = [&](const PhotonHit& photon) {
        const float d2 = (photon.position - point.position).squaredNorm();
        if (d2 < found.limit() && photon.direction.dot(point.normal) < 0.0f) found.add(d2);
    };
    struct Range {
        std::size_t begin, end;
        float distance2;  // of the range's half space from the point, a lower bound
    };
    std::vector<Range> todo = {{0, photons_.size(), 0.0f}};
    while (!todo.empty()) {
        const Range range = todo.back();
        todo.pop_back();
        if (range.distance2 >= found.limit()) continue;
        if (range.end - range.begin <= kLeaf) {
            for (std::size_t i = range.begin; i < range.end; ++i) visit(photons_[i]);
            continue;
        }
        const std::size_t middle = range.begin + (range.end - range.begin) / 2;
        const int axis = axis_[middle];
        const float d = point.position[axis] - photons_[middle].position[axis];
        visit(photons_[middle]);
        const Range below{range.begin, middle, 0.0f}, above{middle + 1, range.end, 0.0f};
        Range near = d < 0.0f ? below : above, far = d < 0.0f ? above : below;
        near.distance2 = range.distance2;
        far.distance2 = std::max(range.distance2, d * d);
        todo.push_back(far);
        todo.push_back(near);
    }
    return {static_cast<int>(found.heap.size()), found.heap.empty() ? 0.0f : found.heap.front()};
}

std::vector<float> photon_irradiance(const PhotonTree& tree, std::span<const SurfacePoint> points,
                                     int photon_count, int nearest_count) {
    std::vector<float> irradiance(points.size(), 0.0f);
    const float power = 2.0f * kPif / static_cast<float>(photon_count);
    parallel_for(points.size(), 64, [&](std::size_t i) {
        const PhotonTree::Gathered found = tree.nearest(points[i], nearest_count);
        if (found.distance2 > 0.0f)
            irradiance[i] = static_cast<float>(found.count) * power / (kPif * found.distance2);
    });
    return irradiance;
}

}  // namespace vitrine
