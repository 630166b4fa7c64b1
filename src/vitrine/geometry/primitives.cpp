#include "geometry/primitives.h"

#include <cmath>

namespace vitrine {
namespace {

/// Stitches a (rows + 1) x columns grid of vertices that closes around.
void stitch_tube(Mesh& mesh, int rows, int columns, bool close_rows) {
    const auto at = [&](int r, int c) {
        return (r % (close_rows ? rows : rows + 1)) * columns + c % columns;
    };
    for (int r = 0; r < rows; ++r) {
        for (int c = 0; c < columns; ++c) {
            mesh.triangles.emplace_back(at(r, c), at(r, c + 1), at(r + 1, c + 1));
            mesh.triangles.emplace_back(at(r, c), at(r + 1, c + 1), at(r + 1, c));
        }
    }
}

Mesh without_degenerate(const Mesh& mesh) {
    std::vector<bool> keep(mesh.triangles.size());
    for (std::size_t i = 0; i < keep.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        keep[i] = t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    }
    return with_triangles(mesh, keep);
}

}  // namespace

Mesh make_box(const Vec3& size_m, const Vec3& centre) {
    Mesh mesh;
    for (int axis = 0; axis < 3; ++axis) {
        for (const int sign : {-1, 1}) {
            const int base = static_cast<int>(mesh.vertices.size());
            Vec3f normal = Vec3f::Zero();
            normal[axis] = static_cast<float>(sign);
            for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
                Vec3 p = Vec3::Zero();
                p[axis] = sign;
                p[(axis + 1) % 3] = a * sign;
                p[(axis + 2) % 3] = b;
                mesh.vertices.push_back((centre + 0.5 * p.cwiseProduct(size_m)).cast<float>());
                mesh.normals.push_back(normal);
            }
            mesh.triangles.emplace_back(base, base + 1, base + 2);
            mesh.triangles.emplace_back(base, base + 2, base + 3);
        }
    }
    return mesh;
}

Mesh make_sphere(double radius_m, const Vec3& centre, int rings) {
    Mesh mesh;
    const int columns = 2 * rings;
    mesh.vertices.push_back((centre - Vec3(0, 0, radius_m)).cast<float>());
    mesh.normals.emplace_back(0, 0, -1);
    for (int r = 1; r < rings; ++r) {
        const double theta = kPi * (1.0 - static_cast<double>(r) / rings);
        for (int c = 0; c < columns; ++c) {
            const double phi = 2 * kPi * c / columns;
            const Vec3 n(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                         std::cos(theta));
            mesh.vertices.push_back((centre + radius_m * n).cast<float>());
            mesh.normals.push_back(n.cast<float>());
        }
    }
    const int top = static_cast<int>(mesh.vertices.size());
    mesh.vertices.push_back((centre + Vec3(0, 0, radius_m)).cast<float>());
    mesh.normals.emplace_back(0, 0, 1);
    const auto at = [&](int r, int c) { return 1 + (r - 1) * columns + c % columns; };
    for (int c = 0; c < columns; ++c) {
        mesh.triangles.emplace_back(0, at(1, c + 1), at(1, c));
        for (int r = 1; r + 1 < rings; ++r) {
            mesh.triangles.emplace_back(at(r, c), at(r, c + 1), at(r + 1, c + 1));
            mesh.triangles.emplace_back(at(r, c), at(r + 1, c + 1), at(r + 1, c));
        }
        mesh.triangles.emplace_back(top, at(rings - 1, c), at(rings - 1, c + 1));
    }
    return mesh;
}

Mesh make_torus(double major_radius_m, double minor_radius_m, const Vec3& centre, int segments,
                int sides) {
    Mesh mesh;
    // Rows run around the tube from outside over the bottom, so that faces look outward.
    for (int s = 0; s < sides; ++s) {
        const double t = 2 * kPi * s / sides;
        for (int c = 0; c < segments; ++c) {
            const double phi = 2 * kPi * c / segments;
            const Vec3 n(std::cos(t) * std::cos(phi), std::cos(t) * std::sin(phi), std::sin(t));
            const Vec3 ring(major_radius_m * std::cos(phi), major_radius_m * std::sin(phi), 0);
            mesh.vertices.push_back((centre + ring + minor_radius_m * n).cast<float>());
            mesh.normals.push_back(n.cast<float>());
        }
    }
    stitch_tube(mesh, sides, segments, true);
    return mesh;
}

Mesh make_lathe(const std::vector<Vec2>& profile_m, int segments) {
    Mesh mesh;
    std::vector<Vec2> profile = profile_m;
    if (profile.front().x() > 0) profile.insert(profile.begin(), Vec2(0, profile.front().y()));
    if (profile.back().x() > 0) profile.push_back(Vec2(0, profile.back().y()));
    for (const Vec2& p : profile) {
        for (int c = 0; c < segments; ++c) {
            const double phi = 2 * kPi * c / segments;
            mesh.vertices.push_back(
                Vec3(p.x() * std::cos(phi), p.x() * std::sin(phi), p.y()).cast<float>());
        }
    }
    stitch_tube(mesh, static_cast<int>(profile.size()) - 1, segments, false);
    return with_creased_normals(without_degenerate(welded(mesh, 1e-9)), 40.0);
}

Mesh make_cylinder(double radius_m, double height_m, const Vec3& base_centre, int segments) {
    const Mesh mesh = make_lathe({{radius_m, 0}, {radius_m, height_m}}, segments);
    Mat4 move = Mat4::Identity();
    move.topRightCorner<3, 1>() = base_centre;
    return transformed(mesh, move);
}

Mesh make_plane(double size_m, double z, int cells) {
    Mesh mesh;
    for (int y = 0; y <= cells; ++y) {
        for (int x = 0; x <= cells; ++x) {
            const double u = static_cast<double>(x) / cells, v = static_cast<double>(y) / cells;
            mesh.vertices.push_back(Vec3((u - 0.5) * size_m, (v - 0.5) * size_m, z).cast<float>());
            mesh.normals.emplace_back(0, 0, 1);
            mesh.uv.emplace_back(u, v);
        }
    }
    for (int y = 0; y < cells; ++y) {
        for (int x = 0; x < cells; ++x) {
            const int a = y * (cells + 1) + x, b = a + cells + 1;
            mesh.triangles.emplace_back(a, a + 1, b + 1);
            mesh.triangles.emplace_back(a, b + 1, b);
        }
    }
    return mesh;
}

}  // namespace vitrine
