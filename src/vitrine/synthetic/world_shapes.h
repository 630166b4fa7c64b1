// synthetic/world_shapes.h: the bodies of made worlds, and how a reconstruction gets them wrong.
#pragma once

#include "base/rng.h"
#include "geometry/mesh.h"
#include "synthetic/world.h"

namespace vitrine {

/// A body of about `radius_m`, resting half a millimetre above the table at the origin.
Mesh make_world_shape(WorldShape shape, double radius_m, Rng& rng);

struct Vessel {
    Mesh glass;  ///< one closed surface: outer wall, rim, inner wall
    Mesh hull;   ///< the outer surface closed flat at the rim: what silhouettes carve
    double wall_m = 0.0;
};
/// A slightly conical drinking glass.
Vessel make_vessel(double radius_m, Rng& rng);

/// A smooth random field of displacements: a few plane waves, root mean square length `error_m`.
class DisplacementField {
  public:
    DisplacementField(double error_m, double min_wave_m, double max_wave_m, Rng& rng);
    Vec3f operator()(const Vec3f& point) const;

  private:
    struct Wave {
        Vec3f number, shift;
        float phase = 0.0f;
    };
    std::vector<Wave> waves_;
};

}  // namespace vitrine
