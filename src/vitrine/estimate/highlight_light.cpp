#include "estimate/highlight_light.h"

namespace vitrine {

std::vector<ViewLight> highlight_lights(const Highlights& highlights, const Relief& relief) {
    const Image<Vec3f>& normals =
        relief.base_normals.empty() ? relief.normals : relief.base_normals;
    double total = 0;
    for (const HighlightBlob& blob : highlights.blobs) total += blob.weight;
    std::vector<ViewLight> lights;
    for (const HighlightBlob& blob : highlights.blobs) {
        Vec3 sum = Vec3::Zero();
        for (const std::size_t i : blob.pixels) {
            if (highlights.core[i] <= 127) continue;
            const Vec3 n = normals[i].cast<double>();
            const Vec3 w = 2 * n.z() * n - Vec3(0, 0, 1);
            sum += luminance(highlights.residual[i]) * w;
        }
        if (sum.norm() < 1e-9) continue;
        lights.push_back({sum.normalized(), blob.colour.cast<double>() * (blob.weight / total)});
    }
    return lights;
}

}  // namespace vitrine
