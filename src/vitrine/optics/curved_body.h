// optics/curved_body.h: how much more light a curved body passes between two of its points than a
// flat surface does over the same distance.
#pragma once

#include "math/vector.h"

namespace vitrine {

/// R_d is defined on a half-space. On a closed body the way between two surface points leads
/// through the inside, away from the surface that would swallow the light; the flat R_d falls
/// short there, by a third for a grape and by much more for strongly absorbing media.
///
/// Random walks in balls of 1.5 to 8 mean free paths (isotropic scattering, matched boundary,
/// cosine entry; the test repeats some) show that the ratio depends almost only on the albedo of
/// R_d and on the rise s of the chord over the surface at its two ends (0 flat, r / 2R on a ball,
/// 1 between opposite sides). Fitted, within 15 %, with L = ln(1.8 / albedo):
///   C(s) = 1 + 1.6 L s + 3.5 max(0, L - 0.95)^2 s^2
/// The unscattered light that crosses the body is part of it.
struct CurvedBodyFactor {
    double linear = 0, quadratic = 0;  ///< both 0: as if flat
    double operator()(double rise) const { return 1 + rise * (linear + rise * quadratic); }
};

/// @param albedo integral of R_d over the plane, clamped to [0.02, 0.95]
CurvedBodyFactor curved_body_factor(double albedo);

/// Sine of the mean angle between the chord from a to b and the two tangent planes; 0 where the
/// body is hollow between them. Normals are unit and point outward.
inline float chord_rise(const Vec3f& a, const Vec3f& normal_a, const Vec3f& b,
                        const Vec3f& normal_b) {
    const Vec3f chord = b - a;
    const float length = chord.norm();
    if (length < 1e-6f) return 0;
    return std::clamp(0.5f * (normal_b - normal_a).dot(chord) / length, 0.0f, 1.0f);
}

}  // namespace vitrine
