// synthetic/world.h: small scenes of known truth, rendered to captures. For tests and benchmarks,
// for no stage. The renderer is the path tracer with photons, not the estimators' own model.
#pragma once

#include "capture/capture.h"
#include "scene/scene.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace vitrine {

enum class WorldObject {
    None,
    Glass,    ///< solid
    Vessel,   ///< a drinking glass: thin wall, thicker base, open above; its hull is solid
    Metal,    ///< a strong Ward lobe over little diffuse light
    Plastic,  ///< dark with a faint, wide gloss: a false candidate
};
enum class WorldShape {
    BallOrBottle,  ///< a ball, or a bottle of seven straight pieces
    Ball,
    Bottle,
    Torus,
    Pebble,  ///< no body of revolution
};

struct WorldOptions {
    std::uint64_t seed = 0;  ///< light, materials, shapes and places all follow from it
    WorldObject object = WorldObject::Glass;
    WorldShape shape = WorldShape::BallOrBottle;  ///< a vessel has its own
    double rho_s_scale = 1.0;                     ///< of metal; 0 makes it a painted, diffuse body
    std::optional<Material> material;             ///< of the object, in place of a random one
    int light_count = 1;
    bool is_sunny = false;                ///< one light far away in place of lamps
    std::vector<DiscLight> lamps;         ///< in place of random ones
    std::optional<Rgb> ambient_radiance;  ///< in place of a random one
    int body_count = 3;                   ///< painted boxes and cylinders on the table
    bool is_shaded = false;               ///< a board keeps the first of `lamps` off the object
    double texture = 1.0;                 ///< contrast of the table's paint; 0: one even colour
    int view_count = 8;
    int width = 200, height = 150;
    int samples_per_pixel = 24;  ///< their noise is the sensor's
    std::uint64_t photon_count = 400'000;
    double saturation_level = 1.25;  ///< clips there
    bool is_quantised = true;        ///< 8-bit sRGB
    double sensor_noise = 0.0;       ///< deviation at the saturation level, in its unit; falls
                                     ///< with the root of the signal
    // How far what reconstruction hands on is from the truth, root of the mean square:
    double scan_error_m = 0.0;  ///< of the bodies on the table
    double hull_error_m = 0.0;  ///< of the object's hull, in waves of 3 to 8 cm
    double pose_error_m = 0.0;  ///< of the cameras' places; their turn is this over 0.5 m
};

struct World {
    Scene truth;     ///< true materials and lights; part 0 is the scan, part 1 the object if any
    Scene labelled;  ///< as reconstruction hands it on: scan with observed radiance, "object_0"
    Capture capture;
    std::vector<DiscLight> lights;  ///< the true ones, aimed at the origin; the sun 1 km away
    double wall_m = 0.0;            ///< of a vessel
};

/// A textured table with three painted bodies, one object in their midst, and one or two lamps or
/// the sun. The true meshes, bent by the errors asked for, stand in for the reconstruction; a
/// vessel's is closed and solid, as a visual hull is. Costs about 4 s on two cores.
World make_world(const WorldOptions& options);

}  // namespace vitrine
