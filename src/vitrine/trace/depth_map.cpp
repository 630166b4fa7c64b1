#include "trace/depth_map.h"

#include "base/parallel.h"

namespace vitrine {

Ray camera_ray(const Camera& camera, double u, double v) {
    Ray ray;
    ray.origin = camera.centre_in_world().cast<float>();
    ray.direction =
        (camera.cam_from_world.rotation.transpose() * camera.ray_in_camera(u, v)).cast<float>();
    return ray;
}

ImageF render_depth(const Accel& accel, const Camera& camera) {
    ImageF depth(camera.width, camera.height);
    parallel_for(static_cast<std::size_t>(camera.height), 8, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < camera.width; ++x) {
            const Hit hit = accel.closest(camera_ray(camera, x, y));
            if (hit.is_hit()) depth(x, y) = hit.distance;
        }
    });
    return depth;
}

}  // namespace vitrine
