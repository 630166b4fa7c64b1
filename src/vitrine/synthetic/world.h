// synthetic/world.h: small scenes of known truth, rendered to captures. For tests and benchmarks,
// for no stage. The renderer is the path tracer with photons, not the estimators' own model.
#pragma once

#include "capture/capture.h"
#include "scene/scene.h"

#include <cstdint>
#include <vector>

namespace vitrine {

enum class WorldObject { None, Glass, Metal };

struct WorldOptions {
    std::uint64_t seed = 0;  ///< light, materials, shapes and places all follow from it
    WorldObject object = WorldObject::Glass;
    double rho_s_scale = 1.0;  ///< of metal; 0 makes it a painted, diffuse body
    int light_count = 1;
    int view_count = 8;
    int width = 200, height = 150;
    int samples_per_pixel = 24;  ///< their noise is the sensor's
    std::uint64_t photon_count = 400'000;
    double saturation_level = 1.25;  ///< clips there
    bool is_quantised = true;        ///< 8-bit sRGB
};

struct World {
    Scene truth;     ///< true materials and lights; part 0 is the scan, part 1 the object if any
    Scene labelled;  ///< as reconstruction hands it on: scan with observed radiance, "object_0"
    Capture capture;
    std::vector<DiscLight> lights;  ///< the true ones, aimed at the origin
};

/// A textured table with three painted bodies, one object in their midst, and one or two lamps.
/// The true meshes stand in for the reconstruction. Costs about 4 s on two cores.
World make_world(const WorldOptions& options);

}  // namespace vitrine
