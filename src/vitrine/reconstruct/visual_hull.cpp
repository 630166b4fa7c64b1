#include "reconstruct/visual_hull.h"

#include "base/parallel.h"
#include "image/filter.h"

#include <algorithm>

namespace vitrine {
namespace {

constexpr double kContactGap_m = 0.0005;  // faces in one plane would confuse rays

}  // namespace

OutlineView outline_view(const Camera& camera, const Mask& silhouette, const Mask& hidden) {
    OutlineView view;
    view.camera = &camera;
    view.is_used = !silhouette.empty() && count_inside(silhouette) > 0;
    if (!view.is_used) return view;
    const Mask body = hidden.empty() ? silhouette : mask_or(silhouette, hidden);
    view.distance_px = gaussian_blur(signed_distance(body), 1.0);
    return view;
}

bool outline_distance(const OutlineView& view, const Vec3& point, double& distance_m) {
    if (!view.is_used) return false;
    const Camera& camera = *view.camera;
    const Vec3 q = camera.cam_from_world * point;
    if (q.z() <= 0.05) return false;
    const Vec2 pixel = camera.project_camera(q);
    if (!camera.sees(pixel)) return false;
    distance_m = bilinear(view.distance_px, pixel.x(), pixel.y()) * q.z() / camera.fx;
    return true;
}

ScalarGrid carve(std::span<const OutlineView> views, const Box3& box, double spacing_m) {
    ScalarGrid phi(box, spacing_m, 0.0f);
    const float outside = static_cast<float>(box.radius());
    parallel_for(phi.values.size(), 4096, [&](std::size_t i) {
        const Eigen::Vector3i c = phi.node_of(i);
        const Vec3 p = phi.node(c.x(), c.y(), c.z());
        int seen = 0;
        double worst = -1e9, distance = 0;
        for (const OutlineView& view : views) {
            if (!outline_distance(view, p, distance)) continue;
            ++seen;
            worst = std::max(worst, distance);
        }
        const bool is_border = c.minCoeff() == 0 || (c.array() + 1 == phi.size.array()).any();
        if (seen < 2 || is_border) worst = std::max(worst, double(outside) * 0.1);
        phi.values[i] = static_cast<float>(worst);
    });
    return phi;
}

Mesh hull_mesh(const ScalarGrid& phi, double offset_m, double sigma_nodes, const Plane& support) {
    ScalarGrid field = gaussian_blur(phi, sigma_nodes);
    for (std::size_t i = 0; i < field.values.size(); ++i) {
        const Eigen::Vector3i c = field.node_of(i);
        const Vec3 p = field.node(c.x(), c.y(), c.z());
        // The cut by the plane is sharp: it is known, not carved.
        field.values[i] = static_cast<float>(
            std::max(field.values[i] + offset_m, kContactGap_m - support.height(p)));
        if (c.minCoeff() == 0 || (c.array() + 1 == field.size.array()).any()) {
            field.values[i] = std::max(field.values[i], static_cast<float>(field.spacing_m));
        }
    }
    const Mesh mesh = zero_surface(field);
    if (mesh.empty()) return mesh;
    const std::vector<int> piece = triangle_components(mesh);
    std::vector<double> area;
    for (std::size_t i = 0; i < piece.size(); ++i) {
        const auto p = static_cast<std::size_t>(piece[i]);
        if (p >= area.size()) area.resize(p + 1, 0.0);
        area[p] += triangle_area(mesh, i);
    }
    const auto largest = std::max_element(area.begin(), area.end()) - area.begin();
    std::vector<bool> keep(piece.size());
    for (std::size_t i = 0; i < piece.size(); ++i) keep[i] = piece[i] == largest;
    return with_triangles(mesh, keep);
}

}  // namespace vitrine
