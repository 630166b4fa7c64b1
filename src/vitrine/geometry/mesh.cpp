#include "geometry/mesh.h"

#include "base/error.h"
#include "base/rng.h"
#include "math/sampling.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <unordered_map>

namespace vitrine {
namespace {

struct Cell {
    std::int64_t x, y, z;
    bool operator==(const Cell&) const = default;
};
struct CellHash {
    std::size_t operator()(const Cell& c) const {
        return static_cast<std::size_t>(mix_bits(static_cast<std::uint64_t>(c.x) * 73856093u ^
                                                 static_cast<std::uint64_t>(c.y) * 19349663u ^
                                                 static_cast<std::uint64_t>(c.z) * 83492791u));
    }
};

/// For each vertex the first vertex within `distance` of it.
std::vector<int> merge_map(const std::vector<Vec3f>& vertices, float distance) {
    std::unordered_map<Cell, std::vector<int>, CellHash> grid;
    std::vector<int> target(vertices.size());
    const float cell = std::max(distance, 1e-12f);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        const Vec3f& p = vertices[i];
        const Cell home{std::int64_t(std::floor(p.x() / cell)),
                        std::int64_t(std::floor(p.y() / cell)),
                        std::int64_t(std::floor(p.z() / cell))};
        int found = -1;
        for (int d = 0; d < 27 && found < 0; ++d) {
            const auto it =
                grid.find({home.x + d % 3 - 1, home.y + d / 3 % 3 - 1, home.z + d / 9 - 1});
            if (it == grid.end()) continue;
            for (const int j : it->second) {
                if ((vertices[static_cast<std::size_t>(j)] - p).norm() <= distance) {
                    found = j;
                    break;
                }
            }
        }
        target[i] = found >= 0 ? found : static_cast<int>(i);
        if (found < 0) grid[home].push_back(static_cast<int>(i));
    }
    return target;
}

Mesh compacted(const Mesh& mesh, const std::vector<Triangle>& triangles) {
    std::vector<int> index(mesh.vertices.size(), -1);
    Mesh result;
    for (Triangle t : triangles) {
        for (int k = 0; k < 3; ++k) {
            const auto old = static_cast<std::size_t>(t[k]);
            if (index[old] < 0) {
                index[old] = static_cast<int>(result.vertices.size());
                result.vertices.push_back(mesh.vertices[old]);
                if (!mesh.normals.empty()) result.normals.push_back(mesh.normals[old]);
                if (!mesh.colours.empty()) result.colours.push_back(mesh.colours[old]);
                if (!mesh.uv.empty()) result.uv.push_back(mesh.uv[old]);
            }
            t[k] = index[old];
        }
        result.triangles.push_back(t);
    }
    return result;
}

Vec3f edge_cross(const Mesh& mesh, const Triangle& t) {
    const Vec3f& a = mesh.vertices[static_cast<std::size_t>(t[0])];
    return (mesh.vertices[static_cast<std::size_t>(t[1])] - a)
        .cross(mesh.vertices[static_cast<std::size_t>(t[2])] - a);
}

float corner_angle(const Mesh& mesh, const Triangle& t, int corner) {
    const Vec3f& p = mesh.vertices[static_cast<std::size_t>(t[corner])];
    const Vec3f a = mesh.vertices[static_cast<std::size_t>(t[(corner + 1) % 3])] - p;
    const Vec3f b = mesh.vertices[static_cast<std::size_t>(t[(corner + 2) % 3])] - p;
    return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

Vec3f triangle_normal(const Mesh& mesh, std::size_t triangle) {
    return edge_cross(mesh, mesh.triangles[triangle]).normalized();
}

double triangle_area(const Mesh& mesh, std::size_t triangle) {
    return 0.5 * edge_cross(mesh, mesh.triangles[triangle]).norm();
}

double surface_area(const Mesh& mesh) {
    double area = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) area += triangle_area(mesh, i);
    return area;
}

double volume(const Mesh& mesh) {
    double six = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[static_cast<std::size_t>(t[0])].cast<double>();
        const Vec3 b = mesh.vertices[static_cast<std::size_t>(t[1])].cast<double>();
        const Vec3 c = mesh.vertices[static_cast<std::size_t>(t[2])].cast<double>();
        six += a.dot(b.cross(c));
    }
    return six / 6.0;
}

Box3 bounds(const Mesh& mesh) {
    Box3 box;
    for (const Vec3f& v : mesh.vertices) box.extend(v.cast<double>());
    return box;
}

std::vector<Vec3f> vertex_normals(const Mesh& mesh) {
    std::vector<Vec3f> normals(mesh.vertices.size(), Vec3f::Zero());
    for (const Triangle& t : mesh.triangles) {
        const Vec3f n = edge_cross(mesh, t).normalized();
        if (!n.allFinite()) continue;
        for (int k = 0; k < 3; ++k) {
            normals[static_cast<std::size_t>(t[k])] += n * corner_angle(mesh, t, k);
        }
    }
    for (Vec3f& n : normals) {
        const float length = n.norm();
        n = length > 0 ? Vec3f(n / length) : Vec3f(0, 0, 1);
    }
    return normals;
}

Mesh with_creased_normals(const Mesh& mesh, double crease_deg) {
    const float cos_crease = static_cast<float>(std::cos(radians(crease_deg)));
    const std::vector<int> merged = merge_map(mesh.vertices, 1e-7f);
    std::vector<std::vector<std::pair<std::size_t, int>>> corners(mesh.vertices.size());
    std::vector<Vec3f> face(mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        face[i] = edge_cross(mesh, mesh.triangles[i]).normalized();
        if (!face[i].allFinite()) face[i] = Vec3f::Zero();
        for (int k = 0; k < 3; ++k) {
            corners[static_cast<std::size_t>(
                        merged[static_cast<std::size_t>(mesh.triangles[i][k])])]
                .emplace_back(i, k);
        }
    }
    Mesh result;
    std::map<std::tuple<int, float, float, float>, int> seen;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        Triangle out;
        for (int k = 0; k < 3; ++k) {
            const int vertex = mesh.triangles[i][k];
            Vec3f sum = Vec3f::Zero();
            for (const auto& [j, corner] :
                 corners[static_cast<std::size_t>(merged[static_cast<std::size_t>(vertex)])]) {
                if (face[i].dot(face[j]) >= cos_crease) {
                    sum += face[j] * corner_angle(mesh, mesh.triangles[j], corner);
                }
            }
            const Vec3f n = sum.norm() > 0 ? Vec3f(sum.normalized()) : Vec3f(0, 0, 1);
            const auto [it, is_new] = seen.try_emplace({vertex, n.x(), n.y(), n.z()},
                                                       static_cast<int>(result.vertices.size()));
            if (is_new) {
                const auto v = static_cast<std::size_t>(vertex);
                result.vertices.push_back(mesh.vertices[v]);
                result.normals.push_back(n);
                if (!mesh.colours.empty()) result.colours.push_back(mesh.colours[v]);
                if (!mesh.uv.empty()) result.uv.push_back(mesh.uv[v]);
            }
            out[k] = it->second;
        }
        result.triangles.push_back(out);
    }
    return result;
}

Mesh transformed(const Mesh& mesh, const Mat4& b_from_a) {
    Mesh result = mesh;
    const Mat3 linear = b_from_a.topLeftCorner<3, 3>();
    const Mat3 normal_matrix = linear.inverse().transpose();
    for (Vec3f& v : result.vertices) {
        v = (linear * v.cast<double>() + b_from_a.topRightCorner<3, 1>()).cast<float>();
    }
    for (Vec3f& n : result.normals)
        n = (normal_matrix * n.cast<double>()).normalized().cast<float>();
    if (linear.determinant() < 0) {
        for (Triangle& t : result.triangles) std::swap(t[1], t[2]);
    }
    return result;
}

void append(Mesh& mesh, const Mesh& other) {
    const int offset = static_cast<int>(mesh.vertices.size());
    if (mesh.normals.empty() != other.normals.empty() && offset > 0) {
        if (mesh.normals.empty()) mesh.normals = vertex_normals(mesh);
    }
    const bool has_normals = !mesh.normals.empty() || (offset == 0 && !other.normals.empty());
    const bool has_colours = !mesh.colours.empty() || !other.colours.empty();
    if (has_colours) mesh.colours.resize(mesh.vertices.size(), Rgb::Constant(0.5f));
    if (has_normals) {
        const std::vector<Vec3f> normals =
            other.normals.empty() ? vertex_normals(other) : other.normals;
        mesh.normals.insert(mesh.normals.end(), normals.begin(), normals.end());
    }
    if (has_colours) {
        std::vector<Rgb> colours = other.colours;
        colours.resize(other.vertices.size(), Rgb::Constant(0.5f));
        mesh.colours.insert(mesh.colours.end(), colours.begin(), colours.end());
    }
    if (!mesh.uv.empty() || !other.uv.empty()) {
        mesh.uv.resize(mesh.vertices.size(), Vec2f::Zero());
        std::vector<Vec2f> uv = other.uv;
        uv.resize(other.vertices.size(), Vec2f::Zero());
        mesh.uv.insert(mesh.uv.end(), uv.begin(), uv.end());
    }
    mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
    for (const Triangle& t : other.triangles)
        mesh.triangles.push_back(t + Triangle::Constant(offset));
}

Mesh welded(const Mesh& mesh, double distance_m) {
    const std::vector<int> target = merge_map(mesh.vertices, static_cast<float>(distance_m));
    std::vector<Triangle> triangles;
    for (Triangle t : mesh.triangles) {
        for (int k = 0; k < 3; ++k) t[k] = target[static_cast<std::size_t>(t[k])];
        if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
    }
    return compacted(mesh, triangles);
}

Mesh with_triangles(const Mesh& mesh, const std::vector<bool>& keep) {
    VITRINE_CHECK_EQ(keep.size(), mesh.triangles.size());
    std::vector<Triangle> triangles;
    for (std::size_t i = 0; i < keep.size(); ++i) {
        if (keep[i]) triangles.push_back(mesh.triangles[i]);
    }
    return compacted(mesh, triangles);
}

std::vector<int> triangle_components(const Mesh& mesh) {
    std::vector<int> parent(mesh.vertices.size());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](int v) {
        while (parent[static_cast<std::size_t>(v)] != v) {
            parent[static_cast<std::size_t>(v)] =
                parent[static_cast<std::size_t>(parent[static_cast<std::size_t>(v)])];
            v = parent[static_cast<std::size_t>(v)];
        }
        return v;
    };
    for (const Triangle& t : mesh.triangles) {
        for (int k = 1; k < 3; ++k) parent[static_cast<std::size_t>(root(t[k]))] = root(t[0]);
    }
    std::unordered_map<int, int> number;
    std::vector<int> component;
    for (const Triangle& t : mesh.triangles) {
        component.push_back(
            number.try_emplace(root(t[0]), static_cast<int>(number.size())).first->second);
    }
    return component;
}

MeshDefects find_defects(const Mesh& mesh) {
    const std::vector<int> merged = merge_map(mesh.vertices, 1e-7f);
    MeshDefects defects;
    std::map<std::pair<int, int>, int> directed;
    for (const Triangle& triangle : mesh.triangles) {
        Triangle t;
        for (int k = 0; k < 3; ++k) t[k] = merged[static_cast<std::size_t>(triangle[k])];
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
            ++defects.degenerate_triangles;
            continue;
        }
        for (int k = 0; k < 3; ++k) ++directed[{t[k], t[(k + 1) % 3]}];
    }
    for (const auto& [edge, count] : directed) {
        const auto twin = directed.find({edge.second, edge.first});
        const int back = twin == directed.end() ? 0 : twin->second;
        if (count > 1 || back > 1) {
            ++defects.non_manifold_edges;
        } else if (back == 0) {
            ++defects.boundary_edges;
        }
    }
    return defects;
}

SurfaceSamples sample_surface(const Mesh& mesh, std::size_t count, std::uint64_t seed) {
    std::vector<double> areas(mesh.triangles.size());
    for (std::size_t i = 0; i < areas.size(); ++i) areas[i] = triangle_area(mesh, i);
    const DiscreteDistribution distribution(areas);
    SurfaceSamples samples;
    Rng rng(stream_key(seed, 0x5a5a));
    for (std::size_t i = 0; i < count; ++i) {
        float u = (static_cast<float>(i) + rng.next_float()) / static_cast<float>(count);
        u = std::min(u, 0x1.fffffep-1f);
        const std::size_t triangle = distribution.sample(u);
        const Vec2f b = sample_triangle(Vec2f(rng.next_float(), rng.next_float()));
        const Triangle& t = mesh.triangles[triangle];
        samples.points.push_back(mesh.vertices[static_cast<std::size_t>(t[0])] * b.x() +
                                 mesh.vertices[static_cast<std::size_t>(t[1])] * b.y() +
                                 mesh.vertices[static_cast<std::size_t>(t[2])] *
                                     (1 - b.x() - b.y()));
        samples.normals.push_back(triangle_normal(mesh, triangle));
    }
    return samples;
}

}  // namespace vitrine
