#include "reconstruct/support_surface.h"

#include "image/filter.h"

namespace vitrine {
namespace {

constexpr double kBayWidth_m = 0.06;

/// Fills empty regions that do not reach the border.
void fill_holes(Mask& mask) {
    Mask outside(mask.width(), mask.height());
    std::vector<std::pair<int, int>> stack;
    const auto push = [&](int x, int y) {
        if (!mask.contains(x, y) || mask(x, y) > 127 || outside(x, y) > 127) return;
        outside(x, y) = 255;
        stack.emplace_back(x, y);
    };
    for (int x = 0; x < mask.width(); ++x) push(x, 0), push(x, mask.height() - 1);
    for (int y = 0; y < mask.height(); ++y) push(0, y), push(mask.width() - 1, y);
    while (!stack.empty()) {
        const auto [x, y] = stack.back();
        stack.pop_back();
        push(x + 1, y), push(x - 1, y), push(x, y + 1), push(x, y - 1);
    }
    mask = mask_not(outside);
}

}  // namespace

bool SupportSurface::contains(const Vec3& point_in_world) const {
    const Vec3 p = plane_from_world * point_in_world;
    const int x = static_cast<int>(std::floor((p.x() - origin.x()) / cell_m));
    const int y = static_cast<int>(std::floor((p.y() - origin.y()) / cell_m));
    if (x < 0 || y < 0 || x >= columns || y >= rows) return false;
    return is_filled[static_cast<std::size_t>(y * columns + x)] != 0;
}

Mesh SupportSurface::mesh() const {
    Mesh mesh;
    const Rigid3 world_from_plane = plane_from_world.inverse();
    const Vec3f up = (world_from_plane.rotation * Vec3::UnitZ()).cast<float>();
    std::vector<int> vertex(static_cast<std::size_t>((columns + 1) * (rows + 1)), -1);
    const auto at = [&](int x, int y) {
        int& v = vertex[static_cast<std::size_t>(y * (columns + 1) + x)];
        if (v < 0) {
            v = static_cast<int>(mesh.vertices.size());
            const Vec3 p(origin.x() + x * cell_m, origin.y() + y * cell_m, 0);
            mesh.vertices.push_back((world_from_plane * p).cast<float>());
            mesh.normals.push_back(up);
        }
        return v;
    };
    for (int y = 0; y < rows; ++y) {
        for (int x = 0; x < columns; ++x) {
            if (!is_filled[static_cast<std::size_t>(y * columns + x)]) continue;
            const int a = at(x, y), b = at(x + 1, y), c = at(x + 1, y + 1), d = at(x, y + 1);
            mesh.triangles.emplace_back(a, b, c);
            mesh.triangles.emplace_back(a, c, d);
        }
    }
    return mesh;
}

SupportSurface find_support_surface(const Mesh& scan, const Plane& plane, double cell_m,
                                    double tolerance_m) {
    SupportSurface surface;
    surface.plane_from_world = plane_from_world(plane);
    surface.cell_m = cell_m;
    std::vector<Vec2> feet;
    Box3 box;
    for (const Vec3f& v : scan.vertices) {
        const Vec3 p = surface.plane_from_world * v.cast<double>();
        if (std::abs(p.z()) > tolerance_m) continue;
        feet.emplace_back(p.x(), p.y());
        box.extend(Vec3(p.x(), p.y(), 0));
    }
    if (feet.empty()) return surface;
    const int closing = static_cast<int>(std::ceil(0.5 * kBayWidth_m / cell_m));
    const int margin = closing + 1;  // so that closing does not touch the border
    surface.origin = Vec2(box.min.x() - margin * cell_m, box.min.y() - margin * cell_m);
    surface.columns = static_cast<int>(box.size().x() / cell_m) + 2 * margin + 1;
    surface.rows = static_cast<int>(box.size().y() / cell_m) + 2 * margin + 1;
    VITRINE_CHECK_LT(double(surface.columns) * surface.rows, 1e8);
    Mask seen(surface.columns, surface.rows);
    for (const Vec2& f : feet) {
        seen(static_cast<int>((f.x() - surface.origin.x()) / cell_m),
             static_cast<int>((f.y() - surface.origin.y()) / cell_m)) = 255;
    }
    seen = dilate(erode(dilate(seen, 1), 2), 1);  // single stray cells do not make a surface
    Mask closed = erode(dilate(seen, closing), closing);
    fill_holes(closed);
    surface.is_filled.resize(closed.size());
    for (std::size_t i = 0; i < closed.size(); ++i) surface.is_filled[i] = closed[i] > 127 ? 1 : 0;
    return surface;
}

}  // namespace vitrine
