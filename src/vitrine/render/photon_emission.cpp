#include "render/photon_emission.h"

#include "base/parallel.h"
#include "base/wide.h"
#include "math/sampling_steps.h"
#include "render/lane_steps.h"
#include "render/sampler.h"

#include <cmath>

namespace vitrine {
namespace {

/// As many cells per axis as half a chunk of photons fills.
constexpr unsigned kCellBits = 9;
constexpr std::size_t kCells = std::size_t{1} << (2 * kCellBits);

/// Random numbers of photons at their light.
struct LightRandom {
    RandomLanes random;
    Lane<float> u, v;  // of the direction

    explicit LightRandom(const PhotonTarget& target) {
        random.stream.fill(PathSampler(target.key, 0).mixed_stream());
        random.index.fill(0);
        random.depth.fill(0);
        random.use.fill(0);
        random.of.fill(1);
    }
    void draw(int count) { random_pairs(random, 0, u, v, count); }
};

/// Rays from `photons.origin` into the cone around the target.
/// @param count of the target's photons
/// @param[out] is_inside  the place on the light is within the target's sphere: no such cone
VITRINE_WIDE void aim_at_sphere(const Sphere& sphere, const LaneLight& light, float count,
                                const Lane<float>& u, const Lane<float>& v, EmittedLanes& photons,
                                Lane<std::uint32_t>& is_inside, int n) {
    const float cx = sphere.centre.x(), cy = sphere.centre.y(), cz = sphere.centre.z();
    const float radius = sphere.radius;
    const Vec3f& normal = light.frame.normal;
    const float lx = normal.x(), ly = normal.y(), lz = normal.z();
    const float red = light.intensity[0], green = light.intensity[1], blue = light.intensity[2];
    const bool is_point = light.area <= 0;
    for (int i = 0; i < n; ++i) {
        float nx = cx - photons.origin.x[i];
        float ny = cy - photons.origin.y[i];
        float nz = cz - photons.origin.z[i];
        const float distance = std::sqrt(dot(nx, ny, nz, nx, ny, nz));
        is_inside[i] = distance <= radius ? 1 : 0;
        nx /= distance;
        ny /= distance;
        nz /= distance;
        const float sin2 = radius * radius / (distance * distance);
        const float cos2 = 1.0f - sin2;
        const float one_minus_cos = sin2 / (1.0f + std::sqrt(cos2 > 0 ? cos2 : 0.0f));
        const float solid_angle = 2 * kPif * one_minus_cos;
        // `sample_uniform_cone`.
        const float cos_max = 1 - one_minus_cos;
        const float one_minus_z = u[i] * (1.0f - cos_max);
        const float rest = one_minus_z * (2.0f - one_minus_z);
        const float r = std::sqrt(rest > 0 ? rest : 0.0f);
        const SineCosine turn = sine_cosine_of_turn(v[i]);
        const float x = r * turn.cosine, y = r * turn.sine, z = 1.0f - one_minus_z;
        const auto [tx, ty, tz, bx, by, bz] = tangents(nx, ny, nz);
        const float dx = tx * x + bx * y + nx * z;
        const float dy = ty * x + by * y + ny * z;
        const float dz = tz * x + bz * y + nz * z;
        const float cosine = dot(dx, dy, dz, lx, ly, lz);
        const float bright = cosine > 0 ? cosine : 0.0f;
        const float scale = is_point ? solid_angle : bright * solid_angle;
        photons.direction.x[i] = dx;
        photons.direction.y[i] = dy;
        photons.direction.z[i] = dz;
        photons.power.x[i] = red * scale / count;
        photons.power.y[i] = green * scale / count;
        photons.power.z[i] = blue * scale / count;
    }
}

/// Places on a lamp, by numbers in u and v.
VITRINE_WIDE void place_on_disc(const LaneLight& light, const Lane<float>& u, const Lane<float>& v,
                                Lanes3& place, int n) {
    const Vec3f &t = light.frame.tangent, &b = light.frame.bitangent, &c = light.position;
    const float tx = t.x(), ty = t.y(), tz = t.z(), bx = b.x(), by = b.y(), bz = b.z();
    const float cx = c.x(), cy = c.y(), cz = c.z(), radius = light.radius;
    for (int i = 0; i < n; ++i) {
        float dx, dy;
        concentric_disc(u[i], v[i], dx, dy);
        dx *= radius;
        dy *= radius;
        place.x[i] = cx + tx * dx + bx * dy;
        place.y[i] = cy + ty * dx + by * dy;
        place.z[i] = cz + tz * dx + bz * dy;
    }
}

/// Cells of the unit square in an order that keeps neighbours together: the bits of both
/// coordinates interleaved (Morton 1966).
VITRINE_WIDE void find_cells(const Lane<float>& u, const Lane<float>& v, std::uint32_t* cell,
                             int count) {
    const auto spread = [](float coordinate) {
        auto x =
            static_cast<std::uint32_t>(static_cast<std::int32_t>(coordinate * (1 << kCellBits)));
        x = (x | x << 8) & 0x00ff00ffu;
        x = (x | x << 4) & 0x0f0f0f0fu;
        x = (x | x << 2) & 0x33333333u;
        return (x | x << 1) & 0x55555555u;
    };
    for (int i = 0; i < count; ++i) cell[i] = spread(u[i]) | spread(v[i]) << 1;
}

}  // namespace

PhotonEmission::PhotonEmission(const RenderScene& scene, const PhotonTarget& target)
    : scene_(scene), target_(target), light_(lane_light(scene.lights().light(target.light))) {}

void PhotonEmission::emit(std::span<const std::uint32_t> indices, EmittedLanes& photons) const {
    const LightSampler& lights = scene_.lights();
    const bool has_size = lights.needs_position(target_.light);
    const PathSampler first(target_.key, 0);
    LightRandom direction(target_);
    Lane<float> u, v;  // of the place on the light
    Lane<std::uint32_t> is_apart;
    const int count = static_cast<int>(indices.size());
    for (std::size_t i = 0; i < indices.size(); ++i) {
        direction.random.index[i] = indices[i];
        const Vec2f place = has_size ? first.at(indices[i]).further_pair(0) : Vec2f(0.5f, 0.5f);
        u[i] = place.x();
        v[i] = place.y();
    }
    direction.draw(count);
    is_apart.fill(1);
    if (light_) {
        const int n = whole_steps(count);
        if (light_->area > 0) {
            place_on_disc(*light_, u, v, photons.origin, n);
        } else {
            photons.origin.x.fill(light_->position.x());
            photons.origin.y.fill(light_->position.y());
            photons.origin.z.fill(light_->position.z());
        }
        aim_at_sphere(target_.sphere, *light_, static_cast<float>(target_.count), direction.u,
                      direction.v, photons, is_apart, n);
    }
    for (int i = 0; i < count; ++i) {
        const auto k = static_cast<std::size_t>(i);
        if (!is_apart[k]) continue;
        const EmittedRay ray =
            lights.emit(target_.light, target_.sphere, {direction.u[k], direction.v[k]},
                        {u[k], v[k]}, scene_.bounding_sphere());
        photons.origin.set(i, ray.origin);
        photons.direction.set(i, ray.direction);
        photons.power.set(i, ray.power / static_cast<float>(target_.count));
    }
}

std::vector<std::uint32_t> coherent_order(const PhotonTarget& target, std::uint64_t first,
                                          std::uint64_t count) {
    std::vector<std::uint32_t> cell(count);
    constexpr std::size_t kBlock = 64 * kLanes;
    parallel_for_blocks(count, kBlock, [&](std::size_t block, std::size_t end) {
        LightRandom random(target);
        for (std::size_t begin = block; begin < end; begin += kLanes) {
            const auto together = static_cast<int>(std::min<std::size_t>(kLanes, end - begin));
            for (int i = 0; i < together; ++i) {
                const auto k = static_cast<std::size_t>(i);
                random.random.index[k] = static_cast<std::uint32_t>(first + begin + k);
            }
            random.draw(together);
            find_cells(random.u, random.v, cell.data() + begin, together);
        }
    });
    std::vector<std::uint32_t> start(kCells + 1, 0);
    for (const std::uint32_t c : cell) ++start[c + 1];
    for (std::size_t c = 0; c < kCells; ++c) start[c + 1] += start[c];
    std::vector<std::uint32_t> order(count);
    for (std::size_t k = 0; k < count; ++k) {
        order[start[cell[k]]++] = static_cast<std::uint32_t>(first + k);
    }
    return order;
}

}  // namespace vitrine
