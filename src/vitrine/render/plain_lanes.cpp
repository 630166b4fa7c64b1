#include "render/plain_lanes.h"

#include "base/rng.h"
#include "base/wide.h"
#include "math/sampling_steps.h"
#include "render/lane_steps.h"
#include "render/sampler.h"

#include <cmath>
#include <limits>

namespace vitrine {
namespace {

inline float interpolated(float a, float b, float c, float wa, float wb, float wc) {
    return a * wa + b * wb + c * wc;
}

/// Not infinite, not NaN.
inline bool is_finite(float x) { return std::abs(x) <= std::numeric_limits<float>::max(); }

inline bool is_any_rounded(const PlainLanes& lanes, int n) {
    std::uint32_t any = 0;
    for (int i = 0; i < n; ++i) any |= lanes.is_rounded[i];
    return any != 0;
}

inline float unit_float(std::uint32_t bits) {
    return static_cast<float>(static_cast<std::int32_t>(bits >> 8)) * 0x1p-24f;
}

}  // namespace

VITRINE_WIDE void normalize_facets(PlainLanes& lanes, int count) {
    const int n = whole_steps(count);
    Lanes3& facet = lanes.facet;
    for (int i = 0; i < n; ++i) {
        const float x = facet.x[i], y = facet.y[i], z = facet.z[i];
        const float square = dot(x, y, z, x, y, z);
        const float length = square > 0 ? std::sqrt(square) : 1.0f;
        facet.x[i] = x / length;
        facet.y[i] = y / length;
        facet.z[i] = z / length;
    }
}

VITRINE_WIDE void find_surfaces(PlainLanes& lanes, int count) {
    const int n = whole_steps(count);
    Lane<float>& side = lanes.side;
    for (int i = 0; i < n; ++i) {
        const float wb = lanes.weight1[i], wc = lanes.weight2[i];
        const float wa = 1.0f - wb - wc;
        const auto& [a, b, c] = lanes.corner;
        lanes.position.x[i] = interpolated(a.x[i], b.x[i], c.x[i], wa, wb, wc);
        lanes.position.y[i] = interpolated(a.y[i], b.y[i], c.y[i], wa, wb, wc);
        lanes.position.z[i] = interpolated(a.z[i], b.z[i], c.z[i], wa, wb, wc);
    }
    for (int i = 0; i < n; ++i) {
        const float fx = lanes.facet.x[i], fy = lanes.facet.y[i], fz = lanes.facet.z[i];
        const float facing =
            dot(fx, fy, fz, lanes.direction.x[i], lanes.direction.y[i], lanes.direction.z[i]);
        side[i] = facing <= 0 ? 1.0f : -1.0f;
        lanes.geometric.x[i] = side[i] * fx;
        lanes.geometric.y[i] = side[i] * fy;
        lanes.geometric.z[i] = side[i] * fz;
    }
    if (!is_any_rounded(lanes, n)) {
        lanes.shading = lanes.geometric;
        return;
    }
    for (int i = 0; i < n; ++i) {
        const float fx = lanes.facet.x[i], fy = lanes.facet.y[i], fz = lanes.facet.z[i];
        const float wb = lanes.weight1[i], wc = lanes.weight2[i];
        const float wa = 1.0f - wb - wc;
        const auto& [a, b, c] = lanes.corner_normal;
        float x = interpolated(a.x[i], b.x[i], c.x[i], wa, wb, wc);
        float y = interpolated(a.y[i], b.y[i], c.y[i], wa, wb, wc);
        float z = interpolated(a.z[i], b.z[i], c.z[i], wa, wb, wc);
        const float square = dot(x, y, z, x, y, z);
        const float length = square > 0 ? std::sqrt(square) : 1.0f;
        x /= length;
        y /= length;
        z /= length;
        const bool is_used = lanes.is_rounded[i] & is_finite(x) & is_finite(y) & is_finite(z);
        const float sign = dot(x, y, z, fx, fy, fz) < 0 ? -side[i] : side[i];
        lanes.shading.x[i] = is_used ? sign * x : lanes.geometric.x[i];
        lanes.shading.y[i] = is_used ? sign * y : lanes.geometric.y[i];
        lanes.shading.z[i] = is_used ? sign * z : lanes.geometric.z[i];
    }
}

VITRINE_WIDE void find_origins(PlainLanes& lanes, float epsilon, int count) {
    const int n = whole_steps(count);
    const Lane<float>& side = lanes.side;
    const int rounded = is_any_rounded(lanes, n) ? n : 0;
    lanes.smooth = lanes.position;
    for (int i = 0; i < rounded; ++i) {
        const float px = lanes.position.x[i], py = lanes.position.y[i], pz = lanes.position.z[i];
        const float w[3] = {1.0f - lanes.weight1[i] - lanes.weight2[i], lanes.weight1[i],
                            lanes.weight2[i]};
        float x = px, y = py, z = pz;
        for (int k = 0; k < 3; ++k) {
            const Lanes3 &corner = lanes.corner[k], &normal = lanes.corner_normal[k];
            const float nx = side[i] * normal.x[i], ny = side[i] * normal.y[i],
                        nz = side[i] * normal.z[i];
            const float height =
                dot(px - corner.x[i], py - corner.y[i], pz - corner.z[i], nx, ny, nz);
            const float below = w[k] * (height < 0 ? height : 0.0f);
            x -= below * nx;
            y -= below * ny;
            z -= below * nz;
        }
        const bool is_rounded = lanes.is_rounded[i] != 0;
        lanes.smooth.x[i] = is_rounded ? x : px;
        lanes.smooth.y[i] = is_rounded ? y : py;
        lanes.smooth.z[i] = is_rounded ? z : pz;
    }
    for (int i = 0; i < n; ++i) {
        lanes.origin.x[i] = lanes.smooth.x[i] + epsilon * lanes.geometric.x[i];
        lanes.origin.y[i] = lanes.smooth.y[i] + epsilon * lanes.geometric.y[i];
        lanes.origin.z[i] = lanes.smooth.z[i] + epsilon * lanes.geometric.z[i];
    }
}

namespace {

VITRINE_WIDE void stratified_pairs(const RandomLanes& random, const Lane<std::uint64_t>& key,
                                   std::uint32_t k, Lane<float>& u, Lane<float>& v, int n) {
    Lane<std::uint32_t> seed;
    for (int i = 0; i < n; ++i) seed[i] = static_cast<std::uint32_t>(key[i]);
    for (int i = 0; i < n; ++i) {
        const SobolBits bits = scrambled_sobol_bits(random.index[i] * random.of[i] + k, seed[i]);
        u[i] = unit_float(bits.x);
        v[i] = unit_float(bits.y);
    }
}

/// Of the deeper vertices alone.
VITRINE_WIDE void unstratified_pairs(const RandomLanes& random, const Lane<std::uint64_t>& key,
                                     std::uint32_t k, Lane<float>& u, Lane<float>& v, int n) {
    Lane<std::uint64_t> bits;
    Lane<std::uint32_t> high, low;
    for (int i = 0; i < n; ++i) {
        bits[i] = PathSampler::bits_of(key[i], random.index[i] * random.of[i] + k);
    }
    for (int i = 0; i < n; ++i) {
        high[i] = static_cast<std::uint32_t>(bits[i] >> 32);
        low[i] = static_cast<std::uint32_t>(bits[i] >> 8);
    }
    for (int i = 0; i < n; ++i) {
        const bool is_deep = random.depth[i] > PathSampler::kStratifiedDepth;
        u[i] = is_deep ? unit_float(high[i]) : u[i];
        v[i] = is_deep ? unit_float(low[i]) : v[i];
    }
}

}  // namespace

VITRINE_WIDE void random_pairs(const RandomLanes& random, std::uint32_t k, Lane<float>& u,
                               Lane<float>& v, int count) {
    const int n = whole_steps(count);
    Lane<std::uint64_t> key;
    std::uint32_t deepest = 0, shallowest = PathSampler::kStratifiedDepth + 1;
    for (int i = 0; i < n; ++i) {
        key[i] = mix_bits(random.stream[i] ^ (random.depth[i] * 16u + random.use[i]));
    }
    for (int i = 0; i < count; ++i) {
        deepest = std::max(deepest, random.depth[i]);
        shallowest = std::min(shallowest, random.depth[i]);
    }
    if (shallowest <= PathSampler::kStratifiedDepth) stratified_pairs(random, key, k, u, v, n);
    if (deepest > PathSampler::kStratifiedDepth) unstratified_pairs(random, key, k, u, v, n);
}

std::optional<LaneLight> lane_light(const Light& light) {
    if (const auto* disc = std::get_if<DiscLight>(&light)) {
        return LaneLight{disc->position_m.cast<float>(), Frame(disc->normal.cast<float>()),
                         static_cast<float>(disc->radius_m),
                         kPif * static_cast<float>(disc->radius_m * disc->radius_m),
                         disc->intensity_w_per_sr};
    }
    if (const auto* point = std::get_if<PointLight>(&light)) {
        return LaneLight{point->position_m.cast<float>(), Frame(Vec3f(0, 0, 1)), 0, 0,
                         point->intensity_w_per_sr};
    }
    return std::nullopt;
}

VITRINE_WIDE void sample_light(PlainLanes& lanes, const LaneLight& light, int count) {
    const int n = whole_steps(count);
    const Vec3f &t = light.frame.tangent, &b = light.frame.bitangent, &normal = light.frame.normal;
    const float tx = t.x(), ty = t.y(), tz = t.z(), bx = b.x(), by = b.y(), bz = b.z();
    const float nx = normal.x(), ny = normal.y(), nz = normal.z();
    const float cx = light.position.x(), cy = light.position.y(), cz = light.position.z();
    const float red = light.intensity[0], green = light.intensity[1], blue = light.intensity[2];
    const bool is_point = light.area <= 0;
    const float radius = light.radius, area = is_point ? 1.0f : light.area;
    if (is_point) {
        for (int i = 0; i < n; ++i) {
            lanes.to_light.x[i] = cx;
            lanes.to_light.y[i] = cy;
            lanes.to_light.z[i] = cz;
        }
    } else {
        for (int i = 0; i < n; ++i) {
            float dx, dy;
            concentric_disc(lanes.u[i], lanes.v[i], dx, dy);
            dx *= radius;
            dy *= radius;
            lanes.to_light.x[i] = cx + tx * dx + bx * dy;
            lanes.to_light.y[i] = cy + ty * dx + by * dy;
            lanes.to_light.z[i] = cz + tz * dx + bz * dy;
        }
    }
    for (int i = 0; i < n; ++i) {
        float x = lanes.to_light.x[i] - lanes.origin.x[i];
        float y = lanes.to_light.y[i] - lanes.origin.y[i];
        float z = lanes.to_light.z[i] - lanes.origin.z[i];
        const float distance = std::sqrt(dot(x, y, z, x, y, z));
        x /= distance;
        y /= distance;
        z /= distance;
        const float square = distance * distance;
        const float cosine = is_point ? 1.0f : -dot(x, y, z, nx, ny, nz);
        const float share = is_point ? square : cosine / square;
        lanes.to_light.x[i] = x;
        lanes.to_light.y[i] = y;
        lanes.to_light.z[i] = z;
        lanes.distance[i] = distance;
        lanes.pdf[i] = is_point ? 0.0f : square / (cosine * area);
        lanes.light.x[i] = is_point ? red / share : red * share;
        lanes.light.y[i] = is_point ? green / share : green * share;
        lanes.light.z[i] = is_point ? blue / share : blue * share;
        lanes.lit[i] = std::min(distance, cosine);
    }
}

VITRINE_WIDE void receive_light(PlainLanes& lanes, int count) {
    const int n = whole_steps(count);
    for (int i = 0; i < n; ++i) {
        const float x = lanes.to_light.x[i], y = lanes.to_light.y[i], z = lanes.to_light.z[i];
        const float cosine =
            dot(x, y, z, lanes.shading.x[i], lanes.shading.y[i], lanes.shading.z[i]);
        const float facing =
            dot(x, y, z, lanes.geometric.x[i], lanes.geometric.y[i], lanes.geometric.z[i]);
        // The balance against the lobe's density; see `balance` in path_light.cpp.
        const float pdf = lanes.pdf[i], lobe = cosine > 0 ? cosine / kPif : 0.0f;
        const float sum = pdf + lobe;
        const bool is_balanced = (pdf > 0) & (lanes.can_scatter[i] != 0);
        const float balance = sum > 0 ? pdf / sum : 0.0f;
        const float weight = is_balanced ? balance : 1.0f;
        const float cosine_scale = lanes.scale[i] * cosine;
        const float r = weight * (lanes.albedo.x[i] / kPif);
        const float g = weight * (lanes.albedo.y[i] / kPif);
        const float b = weight * (lanes.albedo.z[i] / kPif);
        lanes.light.x[i] = lanes.throughput.x[i] * r * lanes.light.x[i] * cosine_scale;
        lanes.light.y[i] = lanes.throughput.y[i] * g * lanes.light.y[i] * cosine_scale;
        lanes.light.z[i] = lanes.throughput.z[i] * b * lanes.light.z[i] * cosine_scale;
        const float brightest = std::max(r, std::max(g, b));
        lanes.lit[i] = std::min(std::min(lanes.lit[i], cosine), std::min(facing, brightest));
    }
}

VITRINE_WIDE void scatter_lanes(PlainLanes& lanes, int count) {
    const int n = whole_steps(count);
    for (int i = 0; i < n; ++i) {
        float dx, dy;
        concentric_disc(lanes.u[i], lanes.v[i], dx, dy);
        const float rest = 1.0f - (dx * dx + dy * dy);
        const float up = std::sqrt(rest > 0 ? rest : 0.0f);
        const float nx = lanes.shading.x[i], ny = lanes.shading.y[i], nz = lanes.shading.z[i];
        const auto [tx, ty, tz, bx, by, bz] = tangents(nx, ny, nz);
        const float x = tx * dx + bx * dy + nx * up;
        const float y = ty * dx + by * dy + ny * up;
        const float z = tz * dx + bz * dy + nz * up;
        const float facing =
            dot(x, y, z, lanes.geometric.x[i], lanes.geometric.y[i], lanes.geometric.z[i]);
        const float brightest =
            std::max(lanes.albedo.x[i], std::max(lanes.albedo.y[i], lanes.albedo.z[i]));
        lanes.scattered.x[i] = x;
        lanes.scattered.y[i] = y;
        lanes.scattered.z[i] = z;
        lanes.scattered_pdf[i] = up / kPif;
        lanes.throughput.x[i] *= lanes.albedo.x[i];
        lanes.throughput.y[i] *= lanes.albedo.y[i];
        lanes.throughput.z[i] *= lanes.albedo.z[i];
        lanes.open[i] = std::min(std::min(up, facing), brightest);
    }
}

VITRINE_WIDE void unit_directions(const Vec3f& corner, const Vec3f& right, const Vec3f& down,
                                  const Lane<float>& x, const Lane<float>& y, Lanes3& direction,
                                  int count) {
    const int n = whole_steps(count);
    const float cx = corner.x(), cy = corner.y(), cz = corner.z();
    const float rx = right.x(), ry = right.y(), rz = right.z();
    const float dx = down.x(), dy = down.y(), dz = down.z();
    for (int i = 0; i < n; ++i) {
        const float a = cx + x[i] * rx + y[i] * dx;
        const float b = cy + x[i] * ry + y[i] * dy;
        const float c = cz + x[i] * rz + y[i] * dz;
        const float length = std::sqrt(dot(a, b, c, a, b, c));
        direction.x[i] = a / length;
        direction.y[i] = b / length;
        direction.z[i] = c / length;
    }
}

}  // namespace vitrine
