// random_walk.h: light in a homogeneous scattering body by following photons, event by event. Knows
// no dipole and no profile: the independent truth for them.
#pragma once

#include "render/bsdf.h"
#include "trace/accel.h"

#include <functional>

namespace vitrine {

/// Isotropic scattering; one extinction for all channels, so that one walk serves them all.
struct WalkMedium {
    double sigma_t_per_m = 1000;
    Rgb albedo = Rgb::Constant(0.95f);  ///< scattering / extinction
    float eta = 1.3f;                   ///< inside / outside, exact Fresnel on both ways
};

struct WalkPhoton {
    Vec3f origin, direction;
    Rgb power = Rgb::Ones();
};

/// Follows `count` photons `emit(index)` through the one closed mesh of `accel`. Those that leave
/// it after having been inside are told to `left(position, power)`, in order of their number. Light
/// reflected at the outer face is not followed.
void walk_photons(const Accel& accel, const WalkMedium& medium, std::size_t count,
                  std::uint64_t seed, const std::function<WalkPhoton(std::size_t)>& emit,
                  const std::function<void(const Vec3f& position, const Rgb& power)>& left);

}  // namespace vitrine
