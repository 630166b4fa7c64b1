// render/plain_lanes.h: points of plain diffuse surfaces, many side by side: what a path does there
// in loops over arrays, which run in vector registers. A lane's values do not depend on its
// neighbours, and are bit by bit those of `RenderScene::surface`, `PathSampler::pair`,
// `LightSampler::sample` and `sample(DiffuseBsdf)`.
#pragma once

#include "render/render_scene.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace vitrine {

constexpr int kLanes = 64;
/// Loops run over a multiple of this.
constexpr int kLaneStep = 16;

/// Lanes that loops over the first `count` run over.
constexpr int whole_steps(int count) { return (count + kLaneStep - 1) / kLaneStep * kLaneStep; }

/// Calls `use(items)` for as many of a list at a time as there are lanes.
template <typename Item, typename Use>
void by_lanes(std::span<Item> all, const Use& use) {
    for (std::size_t begin = 0; begin < all.size(); begin += kLanes) {
        use(all.subspan(begin, std::min<std::size_t>(kLanes, all.size() - begin)));
    }
}

template <typename T>
using Lane = std::array<T, kLanes>;

/// A vector or colour per lane.
struct Lanes3 {
    Lane<float> x, y, z;
    Vec3f at(int i) const {
        const auto k = static_cast<std::size_t>(i);
        return {x[k], y[k], z[k]};
    }
    template <typename Vector>
    void set(int i, const Vector& v) {
        const auto k = static_cast<std::size_t>(i);
        x[k] = v[0];
        y[k] = v[1];
        z[k] = v[2];
    }
};

/// Random numbers of paths: of a stream at a vertex.
struct RandomLanes {
    Lane<std::uint64_t> stream;  ///< mixed, see PathSampler
    Lane<std::uint32_t> index;   ///< of the sample
    Lane<std::uint32_t> depth;   ///< of the vertex
    Lane<std::uint32_t> use;     ///< at the vertex
    Lane<std::uint32_t> of;      ///< pairs that the sample takes instead of one
};

struct PlainLanes {
    // What the ray met.
    Lanes3 corner[3], corner_normal[3];
    Lane<float> weight1, weight2;    ///< of corners 1 and 2
    Lane<std::uint32_t> is_rounded;  ///< has normals per vertex
    Lanes3 facet;                    ///< geometric normal, outward
    Lanes3 direction;                ///< of the ray
    Lanes3 albedo;
    // The surface; see ShadingPoint.
    Lane<float> side;  ///< 1: the ray came from outside, -1
    Lanes3 position, geometric, shading;
    Lanes3 smooth;  ///< smooth_position
    Lanes3 origin;  ///< of rays that leave: RenderScene::leave_smooth
    // The path.
    Lanes3 throughput;
    RandomLanes random;
    Lane<std::uint32_t> is_seen;        ///< from the camera, not by way of another receiver
    Lane<std::uint32_t> light_samples;  ///< shadow rays to each lamp with size
    Lane<std::uint32_t> can_scatter;    ///< else shadow rays alone find the lamps
    // A light's sample, then what it brings if nothing is in its way.
    Lane<float> u, v;
    Lanes3 to_light, light;
    Lane<float> distance, pdf;
    Lane<float> scale;  ///< of what the light brings
    Lane<float> lit;    ///< above 0: may arrive
    // The ray that goes on.
    Lanes3 scattered;
    Lane<float> scattered_pdf;
    Lane<float> open;  ///< above 0: it leaves the surface and carries something
};

/// Puts what a ray met into a lane.
/// @param hit a Hit or a RayAndHit
template <typename AnyHit>
inline void set_hit(PlainLanes& lanes, int i, const PartShape& shape, const AnyHit& hit,
                    const Vec3f& direction) {
    const auto k = static_cast<std::size_t>(i);
    const Triangle& triangle = shape.triangles[hit.triangle];
    for (int c = 0; c < 3; ++c) lanes.corner[c].set(i, shape.vertices[triangle[c]]);
    for (int c = 0; shape.normals && c < 3; ++c) {
        lanes.corner_normal[c].set(i, shape.normals[triangle[c]]);
    }
    lanes.weight1[k] = hit.barycentric.x();
    lanes.weight2[k] = hit.barycentric.y();
    lanes.is_rounded[k] = shape.normals ? 1 : 0;
    lanes.facet.set(i, hit.normal);
    lanes.direction.set(i, direction);
}

// All that follow work on the first `count` lanes, rounded up to whole steps.

/// Gives the geometric normals of what was met unit length.
void normalize_facets(PlainLanes& lanes, int count);
/// Fills side, position, geometric, shading from what was met.
void find_surfaces(PlainLanes& lanes, int count);
/// Then smooth and origin.
void find_origins(PlainLanes& lanes, float epsilon, int count);

/// PathSampler::pair(depth, use, of, k) of each lane.
void random_pairs(const RandomLanes& random, std::uint32_t k, Lane<float>& u, Lane<float>& v,
                  int count);

/// A light as `light_samples` needs it; without area: a point.
struct LaneLight {
    Vec3f position = Vec3f::Zero();
    Frame frame{Vec3f(0, 0, 1)};
    float radius = 0, area = 0;
    Rgb intensity = Rgb::Zero();
};
/// Empty for lights of other kinds than disc and point.
std::optional<LaneLight> lane_light(const Light& light);
/// Fills to_light, distance, pdf, light (radiance / pdf), lit; uses u and v.
void sample_light(PlainLanes& lanes, const LaneLight& light, int count);

/// From a light's samples to what they bring: `light` times throughput, albedo, cosine, scale and
/// weight against the scattered ray (where there is one).
void receive_light(PlainLanes& lanes, int count);

/// Fills scattered, scattered_pdf, open, and puts the albedo to the throughput; uses u and v.
void scatter_lanes(PlainLanes& lanes, int count);

/// Unit directions corner + x right + y down.
void unit_directions(const Vec3f& corner, const Vec3f& right, const Vec3f& down,
                     const Lane<float>& x, const Lane<float>& y, Lanes3& direction, int count);

}  // namespace vitrine
