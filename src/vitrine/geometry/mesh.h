// geometry/mesh.h: triangles, plain data.
#pragma once

#include "math/rigid3.h"

#include <cstdint>
#include <vector>

namespace vitrine {

struct Mesh {
    std::vector<Vec3f> vertices;
    std::vector<Triangle> triangles;  ///< counter-clockwise seen from outside
    std::vector<Vec3f> normals;       ///< per vertex, unit; empty: flat shading
    std::vector<Rgb> colours;         ///< per vertex, linear; empty: none
    std::vector<Vec2f> uv;            ///< per vertex, v up; empty: none

    bool empty() const { return triangles.empty(); }
};

Vec3f triangle_normal(const Mesh& mesh, std::size_t triangle);  ///< unit, outward
double triangle_area(const Mesh& mesh, std::size_t triangle);
double surface_area(const Mesh& mesh);
/// Signed volume by the divergence theorem; positive for a closed mesh that faces outward.
double volume(const Mesh& mesh);
Box3 bounds(const Mesh& mesh);

/// Angle-weighted vertex normals (Thuermer and Wuethrich 1998).
std::vector<Vec3f> vertex_normals(const Mesh& mesh);

/// Angle-weighted normals that do not smooth over edges sharper than `crease_deg`: vertices are
/// split there. Keeps colours and uv.
Mesh with_creased_normals(const Mesh& mesh, double crease_deg);

Mesh transformed(const Mesh& mesh, const Mat4& b_from_a);  ///< flips faces of a mirroring matrix
/// Both meshes in one; attributes missing in one are filled (normals computed, colours grey).
void append(Mesh& mesh, const Mesh& other);
/// Merges vertices closer than `distance_m`; attributes of the first are kept.
Mesh welded(const Mesh& mesh, double distance_m);
/// Drops triangles for which `keep` is false, then unused vertices.
Mesh with_triangles(const Mesh& mesh, const std::vector<bool>& keep);
/// Index of the connected component (by shared vertices) of each triangle; components in order of
/// their first triangle.
std::vector<int> triangle_components(const Mesh& mesh);

struct MeshDefects {
    std::size_t boundary_edges = 0;      ///< used by one triangle
    std::size_t non_manifold_edges = 0;  ///< used by more than two, or twice in one direction
    std::size_t degenerate_triangles = 0;
    bool is_closed() const { return boundary_edges == 0 && non_manifold_edges == 0; }
};
/// Looks at edges by vertex position, so split seams (normals, uv) do not count as open.
MeshDefects find_defects(const Mesh& mesh);

/// Points uniformly on the surface, with normals, from a fixed seed.
struct SurfaceSamples {
    std::vector<Vec3f> points, normals;
};
SurfaceSamples sample_surface(const Mesh& mesh, std::size_t count, std::uint64_t seed);

}  // namespace vitrine
