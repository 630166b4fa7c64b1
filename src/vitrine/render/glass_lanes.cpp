#include "render/glass_lanes.h"

#include "base/wide.h"
#include "render/interface.h"
#include "render/lane_steps.h"

#include <cmath>

namespace vitrine {
namespace {

/// Faint branches of a boundary survive with this many times their share of the power.
constexpr float kFaintBranchBoost = 4.0f;
inline float sum(float a, float b, float c) { return a + (b + c); }

inline float strongest(float a, float b, float c) { return std::max(a, std::max(b, c)); }

/// As `bend` where the rounded normal agrees with the flat one; marks the lanes where not.
VITRINE_WIDE void bend_agreeing(const PlainLanes& surfaces, GlassLanes& glass, int n) {
    const Lanes3 &direction = surfaces.direction, &flat = surfaces.geometric;
    for (int i = 0; i < n; ++i) {
        const float wx = -direction.x[i], wy = -direction.y[i], wz = -direction.z[i];
        const float nx = surfaces.shading.x[i], ny = surfaces.shading.y[i],
                    nz = surfaces.shading.z[i];
        const float gx = flat.x[i], gy = flat.y[i], gz = flat.z[i];
        const float eta = glass.eta[i];
        const float facing = dot(wx, wy, wz, nx, ny, nz);
        const float cos_i = facing < 1 ? facing : 1.0f;
        // Fresnel, as `fresnel_dielectric`.
        const float sin2_t = (1.0f - cos_i * cos_i) / (eta * eta);
        const bool is_total = sin2_t >= 1.0f;
        const float cos_t = std::sqrt(is_total ? 0.0f : 1.0f - sin2_t);
        const float rs = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
        const float rp = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
        const float reflectance = is_total ? 1.0f : 0.5f * (rs * rs + rp * rp);
        // `mirror_direction`.
        const float twice = 2.0f * facing;
        float mx = twice * nx - wx, my = twice * ny - wy, mz = twice * nz - wz;
        const float above = dot(mx, my, mz, gx, gy, gz);
        const float mirror_square = dot(mx, my, mz, mx, my, mz);
        const float mirror_length = std::sqrt(mirror_square);
        // `refract`.
        const float along = facing / eta - cos_t;
        float rx = -wx / eta + along * nx, ry = -wy / eta + along * ny, rz = -wz / eta + along * nz;
        const float square = dot(rx, ry, rz, rx, ry, rz);
        const float length = std::sqrt(square);
        rx /= length;
        ry /= length;
        rz /= length;
        const float below = dot(rx, ry, rz, gx, gy, gz);
        const bool is_optical = eta != 1.0f;
        glass.reflectance[i] = is_optical ? reflectance : 0.0f;
        glass.reflected.x[i] = mx / mirror_length;
        glass.reflected.y[i] = my / mirror_length;
        glass.reflected.z[i] = mz / mirror_length;
        glass.refracted.x[i] = is_optical ? rx : direction.x[i];
        glass.refracted.y[i] = is_optical ? ry : direction.y[i];
        glass.refracted.z[i] = is_optical ? rz : direction.z[i];
        const bool agrees = (facing > 0) & (above > 0) & (is_total | (below < 0));
        glass.is_odd[i] = is_optical & !agrees ? 1 : 0;
    }
}

}  // namespace

void bend_lanes(const PlainLanes& surfaces, GlassLanes& glass, int count) {
    bend_agreeing(surfaces, glass, whole_steps(count));
    for (int i = 0; i < count; ++i) {
        const auto k = static_cast<std::size_t>(i);
        if (!glass.is_odd[k]) continue;
        ShadingPoint point;
        point.geometric_normal = surfaces.geometric.at(i);
        point.shading_normal = surfaces.shading.at(i);
        const BentRays rays = bend(point, surfaces.direction.at(i), glass.eta[k]);
        glass.reflectance[k] = rays.reflectance;
        glass.reflected.set(i, rays.reflected);
        glass.refracted.set(i, rays.refracted);
    }
}

VITRINE_WIDE void branch_lanes(const PlainLanes& surfaces, GlassLanes& glass, int count) {
    const int n = whole_steps(count);
    for (int i = 0; i < n; ++i) {
        const float reflectance = glass.reflectance[i], initial = glass.initial[i];
        const bool is_split = (reflectance > 0) & (reflectance < 1);
        const bool is_mostly_reflected = reflectance > 0.5f;
        const float larger = is_mostly_reflected ? reflectance : 1.0f - reflectance;
        const float share = is_split ? larger : 1.0f;
        const float r = surfaces.throughput.x[i], g = surfaces.throughput.y[i],
                    b = surfaces.throughput.z[i];
        // Russian roulette: the power of those that stay makes up for those that go.
        const float faint_r = r * (1.0f - share), faint_g = g * (1.0f - share),
                    faint_b = b * (1.0f - share);
        const float wish = kFaintBranchBoost * strongest(faint_r, faint_g, faint_b) / initial;
        const float chance = wish < 1 ? wish : 1.0f;
        const bool stays = is_split & (surfaces.u[i] < chance);
        const float before = sum(faint_r, faint_g, faint_b);
        glass.faint.power.x[i] = faint_r / chance;
        glass.faint.power.y[i] = faint_g / chance;
        glass.faint.power.z[i] = faint_b / chance;
        const float after =
            sum(glass.faint.power.x[i], glass.faint.power.y[i], glass.faint.power.z[i]);
        glass.faint.is_open[i] = stays ? 1 : 0;
        glass.faint.is_refracted[i] = is_mostly_reflected ? 1 : 0;
        const float faint_taken = before - (stays ? after : 0.0f);

        const float strong_r = r * share, strong_g = g * share, strong_b = b * share;
        const float survival = strongest(strong_r, strong_g, strong_b) / (initial * kSurePower);
        const bool is_sure = !is_split | (survival >= 1);
        const bool survives = is_sure | (surfaces.v[i] < survival);
        const float divisor = is_sure ? 1.0f : survival;
        glass.strong.power.x[i] = strong_r / divisor;
        glass.strong.power.y[i] = strong_g / divisor;
        glass.strong.power.z[i] = strong_b / divisor;
        const float rest =
            sum(glass.strong.power.x[i], glass.strong.power.y[i], glass.strong.power.z[i]);
        glass.strong.is_open[i] = survives ? 1 : 0;
        glass.strong.is_refracted[i] = is_mostly_reflected ? 0 : 1;
        const float strong_taken = sum(strong_r, strong_g, strong_b) - (survives ? rest : 0.0f);
        glass.chance[i] = (is_split ? faint_taken : 0.0f) + (is_sure ? 0.0f : strong_taken);
    }
}

}  // namespace vitrine
