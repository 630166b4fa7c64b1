#include "scene/scene.h"

namespace vitrine {

Box3 bounds(const Scene& scene) {
    Box3 box;
    for (const Part& part : scene.parts) {
        for (const Vec3f& v : part.mesh->vertices) box.extend(v.cast<double>());
    }
    return box;
}

double ray_epsilon(const Scene& scene) {
    // 2e-6 of the diagonal: ten float steps at the far corner, 3 micrometres on a table of 1.5 m.
    constexpr double kShareOfDiagonal = 2e-6;
    const Box3 box = bounds(scene);
    return box.is_empty() ? 1e-6 : std::max(1e-6, kShareOfDiagonal * box.size().norm());
}

}  // namespace vitrine
