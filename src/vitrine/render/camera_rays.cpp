#include "render/camera_rays.h"

namespace vitrine {

CameraRays::CameraRays(const Camera& camera) : origin_(camera.centre_in_world().cast<float>()) {
    const Mat3 world_from_camera = camera.cam_from_world.rotation.transpose();
    right_ = (world_from_camera.col(0) / camera.fx).cast<float>();
    down_ = (world_from_camera.col(1) / camera.fy).cast<float>();
    corner_ = (world_from_camera * camera.ray_in_camera(0, 0)).cast<float>();
}

void CameraRays::aim(std::span<const int> columns, int y, std::span<const PathTask> tasks,
                     const RayList& rays) const {
    RandomLanes random;
    random.depth.fill(0);
    random.use.fill(0);
    random.of.fill(1);
    Lane<float> u, v;
    Lanes3 directions;
    for (std::size_t begin = 0; begin < tasks.size(); begin += kLanes) {
        const std::size_t count = std::min<std::size_t>(kLanes, tasks.size() - begin);
        for (std::size_t i = 0; i < count; ++i) {
            const PathSampler& sampler = tasks[begin + i].sampler;
            random.stream[i] = sampler.mixed_stream();
            random.index[i] = sampler.index();
        }
        random_pairs(random, 0, u, v, static_cast<int>(count));
        for (std::size_t i = 0; i < count; ++i) {
            u[i] = static_cast<float>(columns[begin + i]) + (u[i] - 0.5f);
            v[i] = static_cast<float>(y) + (v[i] - 0.5f);
        }
        unit_directions(corner_, right_, down_, u, v, directions, static_cast<int>(count));
        for (std::size_t i = 0; i < count; ++i) {
            new (&rays[begin + i])
                RayAndHit(origin_, directions.at(static_cast<int>(i)), kAllParts);
        }
    }
}

}  // namespace vitrine
