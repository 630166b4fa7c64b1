#include "world_series.h"

#include "base/rng.h"

namespace vitrine {

WorldOptions series_world(std::uint64_t seed) {
    WorldOptions options;
    options.seed = seed;
    Rng rng(stream_key(seed, 0xbe9cULL));
    constexpr WorldObject kKinds[] = {WorldObject::Glass, WorldObject::Metal,  WorldObject::Glass,
                                      WorldObject::Metal, WorldObject::Vessel, WorldObject::Glass,
                                      WorldObject::Metal, WorldObject::Plastic};
    options.object = kKinds[(seed / 2) % 8];
    constexpr WorldShape kShapes[] = {WorldShape::Ball, WorldShape::Bottle, WorldShape::Torus,
                                      WorldShape::Pebble};
    options.shape =
        options.object == WorldObject::Plastic ? WorldShape::Pebble : kShapes[rng.next_index(4)];
    options.light_count = (seed / 2) % 5 == 2 ? 2 : 1;
    options.is_sunny = (seed / 2) % 5 == 4;
    options.width = 160;
    options.height = 120;
    options.samples_per_pixel = 10;
    options.photon_count = 100'000;
    options.sensor_noise = 0.006;
    options.scan_error_m = 0.0008;
    const bool is_revolution =
        options.shape == WorldShape::Ball || options.shape == WorldShape::Bottle;
    options.hull_error_m =
        is_revolution || options.object == WorldObject::Vessel ? 0.00015 : 0.0003;
    options.pose_error_m = 0.0002;
    return options;
}

}  // namespace vitrine
