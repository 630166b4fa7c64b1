// render/bsdf.h: how a surface point scatters light: eval, sample and pdf of each material.
//
// Directions are unit, local (z = shading normal), away from the surface: wo to the viewer, wi to
// the light. `eval` leaves out the cosine; `sample` returns f cos / pdf. Densities are per solid
// angle. Smooth materials (mirror, dielectric) have no eval: only their samples carry light.
#pragma once

#include "scene/material.h"

#include <variant>

namespace vitrine {

struct DiffuseBsdf {
    Rgb albedo = Rgb::Zero();
};
struct WardBsdf {
    Rgb rho_d = Rgb::Zero();
    Rgb rho_s = Rgb::Zero();
    float sigma_x = 0.1f;
    float sigma_y = 0.1f;
    bool is_duer = false;
};
struct MirrorBsdf {
    Rgb reflectance = Rgb::Ones();
};
/// `eta` = index beyond the surface / index on the side of wo (z > 0 is the side of wo).
struct DielectricBsdf {
    float eta = 1.5f;
};
/// The face of a translucent body (Jensen et al. 2001, Eq. 5): what its profile spreads too
/// little for the body's samples to tell leaves like paint under a smooth interface; the rest is
/// the body's exitance. A `sigma` above 0 adds the interface's own reflection, blurred.
struct TranslucentBsdf {
    Rgb near_share = Rgb::Zero();  ///< albedo of what is left to paint
    float eta = 1.3f;              ///< inside / outside
    float sigma = 0.0f;            ///< width of the glossy lobe, as Ward's; 0: none
};
/// Light on its way into a translucent body: F_t(wi) / pi, so that pi times the reflected radiance
/// is the irradiance that enters.
struct EnteringBsdf {
    float eta = 1.3f;
};
using Bsdf =
    std::variant<DiffuseBsdf, WardBsdf, MirrorBsdf, DielectricBsdf, TranslucentBsdf, EnteringBsdf>;

/// The two parts of a material that scatters over a range of directions.
enum class Lobe { Diffuse, Glossy };

/// True when all light leaves in single directions.
bool is_smooth(const Bsdf& bsdf);
/// Share of perpendicular light that the diffuse lobe sends back.
Rgb diffuse_reflectance(const Bsdf& bsdf);

/// Value of one lobe in 1/sr.
Rgb eval_lobe(const Bsdf& bsdf, Lobe lobe, const Vec3f& wo, const Vec3f& wi);
/// Value of the whole, in 1/sr; zero for smooth materials.
Rgb eval(const Bsdf& bsdf, const Vec3f& wo, const Vec3f& wi);

/// Chance that `sample` picks the lobe.
float lobe_probability(const Bsdf& bsdf, Lobe lobe);
/// Density of wi within one lobe; multiply with `lobe_probability` for the density of `sample`.
float pdf_lobe(const Bsdf& bsdf, Lobe lobe, const Vec3f& wo, const Vec3f& wi);
/// Density of `sample` over both lobes; zero for smooth materials.
float pdf(const Bsdf& bsdf, const Vec3f& wo, const Vec3f& wi);

struct BsdfSample {
    Vec3f wi = Vec3f::Zero();
    Rgb weight = Rgb::Zero();  ///< f cos / (pdf * lobe probability); zero: absorbed
    float pdf = 0.0f;          ///< per solid angle, times the lobe's probability; 0 when smooth
    Lobe lobe = Lobe::Diffuse;
    bool is_smooth = false;
    bool is_transmitted = false;
};

/// Draws wi. `weight` belongs to the chosen lobe alone: the lobes are estimated apart, since light
/// that arrives through one may be known from another estimator.
/// @param u direction; @param u_lobe choice of lobe, or of reflection against refraction
BsdfSample sample(const Bsdf& bsdf, const Vec3f& wo, const Vec2f& u, float u_lobe);

}  // namespace vitrine
