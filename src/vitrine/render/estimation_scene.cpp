#include "render/estimation_scene.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {
// A fused depth map is rough by one to two millimetres on a scene of a metre: shadow rays that
// start lower than that would shade the table with its own noise.
constexpr double kOffsetPerRadius = 0.003;
}  // namespace

std::uint32_t object_mask(int object) { return 2u << std::min(object, 30); }

bool is_candidate(const Part& part) { return part.name.rfind("object_", 0) == 0; }

EstimationScene::EstimationScene(const Scene& scene) {
    std::vector<AccelPart> parts;
    for (std::size_t i = 0; i < scene.parts.size(); ++i) {
        const Part& part = scene.parts[i];
        int object = -1;
        if (is_candidate(part)) {
            object = object_count();
            object_parts_.push_back(static_cast<int>(i));
            object_bounds_.push_back(bounds(*part.mesh));
        }
        object_of_part_.push_back(object);
        parts.push_back({part.mesh, object < 0 ? kScanMask : object_mask(object)});
    }
    accel_ = Accel(std::move(parts));
    Box3 box;
    for (const Camera& camera : scene.cameras) box.extend(camera.centre_in_world());
    const double radius = box.is_empty() ? 0.5 : std::clamp(box.radius(), 0.05, 1.0);
    offset_m_ = static_cast<float>(kOffsetPerRadius * radius);
}

std::optional<Rgb> EstimationScene::scan_radiance(const Hit& hit, const Vec3f& direction) const {
    if (!hit.is_hit() || object_of_part(hit.part) >= 0) return std::nullopt;
    const Mesh& scan = mesh(hit.part);
    if (scan.colours.empty() || hit.normal.dot(direction) > 0.0f) return Rgb(Rgb::Zero());
    return interpolate_colour(scan, hit);
}

}  // namespace vitrine
