// pipeline/placement.h: stands a mesh on the surface that a pixel shows (`--insert MESH --at
// F,U,V`).
#pragma once

#include "scene/insertion.h"

namespace vitrine {

struct Placement {
    std::string frame;
    Vec2 pixel = Vec2::Zero();
};

/// Reads "000003,320,180". @throws UsageError
Placement parse_placement(const std::string& text);

/// The mesh (its own z up, metres) with the middle of its underside on the surface point seen at
/// the pixel. It stands upright on anything flatter than 30 degrees against `up`, else along the
/// normal. A mesh without material becomes white diffuse (albedo 0.7).
/// @throws InputError when the frame does not exist or the pixel shows no surface.
Insertion place_on_surface(const std::filesystem::path& mesh_file, const Placement& placement,
                           const Scene& scene, const Vec3& up);

}  // namespace vitrine
