#include "geometry/scalar_grid.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace vitrine {
namespace {

// Corner c of a cell sits at (c & 1, c >> 1 & 1, c >> 2 & 1). All six tetrahedra share the diagonal
// 0-7, so that neighbouring cells cut their common face along the same line.
constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

/// Collects the triangles of one tetrahedron after another, with shared vertices.
class SurfaceBuilder {
  public:
    explicit SurfaceBuilder(const ScalarGrid& grid) : grid_(grid) {}

    void add(const std::array<Eigen::Vector3i, 4>& corners) {
        std::array<int, 4> inside{}, outside{};
        int inside_count = 0, outside_count = 0;
        for (int k = 0; k < 4; ++k) {
            const Eigen::Vector3i& c = corners[static_cast<std::size_t>(k)];
            if (value(c) < 0) {
                inside[static_cast<std::size_t>(inside_count++)] = k;
            } else {
                outside[static_cast<std::size_t>(outside_count++)] = k;
            }
        }
        const auto cut = [&](int a, int b) {
            return vertex(corners[static_cast<std::size_t>(a)],
                          corners[static_cast<std::size_t>(b)]);
        };
        if (inside_count == 1) {
            emit(cut(inside[0], outside[0]), cut(inside[0], outside[1]), cut(inside[0], outside[2]),
                 corners, inside[0], outside[0]);
        } else if (inside_count == 3) {
            emit(cut(outside[0], inside[0]), cut(outside[0], inside[1]), cut(outside[0], inside[2]),
                 corners, inside[0], outside[0]);
        } else if (inside_count == 2) {
            const int a = cut(inside[0], outside[0]), b = cut(inside[0], outside[1]);
            const int c = cut(inside[1], outside[1]), d = cut(inside[1], outside[0]);
            emit(a, b, c, corners, inside[0], outside[0]);
            emit(a, c, d, corners, inside[0], outside[0]);
        }
    }

    Mesh finish() {
        mesh_.normals.reserve(mesh_.vertices.size());
        for (const Vec3f& v : mesh_.vertices) {
            const Vec3 g = grid_.gradient(v.cast<double>());
            mesh_.normals.push_back(g.norm() > 0 ? Vec3f(g.normalized().cast<float>())
                                                 : Vec3f(0, 0, 1));
        }
        return std::move(mesh_);
    }

  private:
    float value(const Eigen::Vector3i& c) const { return grid_.at(c.x(), c.y(), c.z()); }

    int vertex(Eigen::Vector3i a, Eigen::Vector3i b) {
        std::size_t ia = grid_.index(a.x(), a.y(), a.z()), ib = grid_.index(b.x(), b.y(), b.z());
        if (ia > ib) {
            std::swap(ia, ib);
            std::swap(a, b);
        }
        const auto [it, is_new] =
            vertices_.try_emplace({ia, ib}, static_cast<int>(mesh_.vertices.size()));
        if (is_new) {
            // Off the nodes by a little, so that no triangle collapses to a point.
            const double t =
                std::clamp(double(value(a)) / (double(value(a)) - value(b)), 0.02, 0.98);
            const Vec3 p = (1 - t) * a.cast<double>() + t * b.cast<double>();
            mesh_.vertices.push_back((grid_.origin + grid_.spacing_m * p).cast<float>());
        }
        return it->second;
    }

    void emit(int a, int b, int c, const std::array<Eigen::Vector3i, 4>& corners, int in, int out) {
        const auto at = [&](int v) { return mesh_.vertices[static_cast<std::size_t>(v)]; };
        const Vec3f outward =
            (corners[static_cast<std::size_t>(out)] - corners[static_cast<std::size_t>(in)])
                .cast<float>();
        const bool faces_out = (at(b) - at(a)).cross(at(c) - at(a)).dot(outward) > 0;
        mesh_.triangles.push_back(faces_out ? Triangle(a, b, c) : Triangle(a, c, b));
    }

    const ScalarGrid& grid_;
    Mesh mesh_;
    std::map<std::pair<std::size_t, std::size_t>, int> vertices_;
};

}  // namespace

ScalarGrid::ScalarGrid(const Box3& box, double spacing, float fill)
    : origin(box.min), spacing_m(spacing) {
    VITRINE_CHECK_GT(spacing, 0.0);
    double count = 1;
    for (int k = 0; k < 3; ++k) {
        size[k] = std::max(2, static_cast<int>(std::ceil(box.size()[k] / spacing)) + 1);
        count *= size[k];
    }
    VITRINE_CHECK_LT(count, 4e8);
    values.assign(static_cast<std::size_t>(count), fill);
}

Eigen::Vector3i ScalarGrid::node_of(std::size_t i) const {
    const auto nx = static_cast<std::size_t>(size.x()), ny = static_cast<std::size_t>(size.y());
    return {static_cast<int>(i % nx), static_cast<int>(i / nx % ny),
            static_cast<int>(i / (nx * ny))};
}

float ScalarGrid::sample(const Vec3& p) const {
    const Vec3 g = (p - origin) / spacing_m;
    Eigen::Vector3i base;
    Vec3 t;
    for (int k = 0; k < 3; ++k) {
        const double c = std::clamp(g[k], 0.0, double(size[k] - 1));
        base[k] = std::min(static_cast<int>(c), size[k] - 2);
        t[k] = c - base[k];
    }
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
        const int dx = c & 1, dy = c >> 1 & 1, dz = c >> 2;
        sum += (dx ? t.x() : 1 - t.x()) * (dy ? t.y() : 1 - t.y()) * (dz ? t.z() : 1 - t.z()) *
               at(base.x() + dx, base.y() + dy, base.z() + dz);
    }
    return static_cast<float>(sum);
}

Vec3 ScalarGrid::gradient(const Vec3& p) const {
    Vec3 g;
    for (int k = 0; k < 3; ++k) {
        const Vec3 step = Vec3::Unit(k) * spacing_m;
        g[k] = (double(sample(p + step)) - double(sample(p - step))) / (2 * spacing_m);
    }
    return g;
}

ScalarGrid gaussian_blur(const ScalarGrid& grid, double sigma_nodes) {
    if (sigma_nodes <= 0) return grid;
    const int radius = std::max(1, static_cast<int>(std::ceil(3 * sigma_nodes)));
    std::vector<float> kernel;
    double sum = 0;
    for (int i = -radius; i <= radius; ++i) {
        kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma_nodes * sigma_nodes))));
        sum += kernel.back();
    }
    for (float& w : kernel) w = static_cast<float>(w / sum);
    ScalarGrid from = grid, to = grid;
    for (int axis = 0; axis < 3; ++axis) {
        parallel_for(static_cast<std::size_t>(grid.size.z()), 4, [&](std::size_t slice) {
            const int z = static_cast<int>(slice);
            for (int y = 0; y < grid.size.y(); ++y) {
                for (int x = 0; x < grid.size.x(); ++x) {
                    float value = 0;
                    Eigen::Vector3i c(x, y, z);
                    for (int k = -radius; k <= radius; ++k) {
                        Eigen::Vector3i n = c;
                        n[axis] = std::clamp(c[axis] + k, 0, grid.size[axis] - 1);
                        value += kernel[static_cast<std::size_t>(k + radius)] *
                                 from.at(n.x(), n.y(), n.z());
                    }
                    to.at(x, y, z) = value;
                }
            }
        });
        std::swap(from.values, to.values);
    }
    return from;
}

Mesh zero_surface(const ScalarGrid& grid) {
    SurfaceBuilder builder(grid);
    for (int z = 0; z + 1 < grid.size.z(); ++z) {
        for (int y = 0; y + 1 < grid.size.y(); ++y) {
            for (int x = 0; x + 1 < grid.size.x(); ++x) {
                int inside = 0;
                for (int c = 0; c < 8; ++c) {
                    inside += grid.at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)) < 0 ? 1 : 0;
                }
                if (inside == 0 || inside == 8) continue;
                for (const auto& tetrahedron : kTetrahedra) {
                    std::array<Eigen::Vector3i, 4> corners;
                    for (std::size_t k = 0; k < 4; ++k) {
                        const int c = tetrahedron[k];
                        corners[k] = {x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)};
                    }
                    builder.add(corners);
                }
            }
        }
    }
    return builder.finish();
}

}  // namespace vitrine
