// render/camera_rays.h: directions of a camera's rays, many side by side.
#pragma once

#include "render/path_tracer.h"

namespace vitrine {

/// Sample `index` of a pixel: a ray through a place in its square that the first of its path's
/// random numbers says. Renderers that share a seed share them.
class CameraRays {
  public:
    explicit CameraRays(const Camera& camera);
    /// Writes the rays of tasks with samplers of stream_key(seed, x, y) and index.
    /// @param columns of the pixels, per task; @param y their row
    void aim(std::span<const int> columns, int y, std::span<const PathTask> tasks,
             const RayList& rays) const;

  private:
    Vec3f origin_;
    Vec3f corner_, right_, down_;
};

}  // namespace vitrine
