#include "reconstruct/labelled_scene.h"

#include "reconstruct/appearance.h"
#include "reconstruct/fusion.h"
#include "reconstruct/support_surface.h"
#include "trace/accel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace vitrine {
namespace {

constexpr double kPlaneAngle_deg = 35.0;  // flatter triangles near the plane are the plane
constexpr double kHiddenBelow_m = 0.05;   // what shows just under a closed surface is noise
constexpr double kMinPiece_m2 = 2e-4;     // crumbs that the cuts leave behind

/// Answers whether a point is inside a hull or near it.
class NearHull {
  public:
    NearHull(const Mesh& hull, double margin_m)
        : margin_(static_cast<float>(margin_m)),
          box_(bounds(hull)),
          accel_(std::vector<AccelPart>{{std::make_shared<const Mesh>(hull)}}) {
        box_.min.array() -= margin_m;
        box_.max.array() += margin_m;
    }

    bool contains(const Vec3f& p) const {
        if (!box_.contains(p.cast<double>())) return false;
        const Hit up = accel_.closest({p, Vec3f(0.02f, 0.01f, 1.0f)});
        return (up.is_hit() && up.normal.z() > 0) || accel_.nearest(p, margin_).is_hit();
    }

  private:
    float margin_;
    Box3 box_;
    Accel accel_;
};

/// The scan without the plane (it is rebuilt), without the candidates and what lies under the
/// plane.
Mesh standing_surface(const Scan& scan, const SupportSurface& support,
                      const std::vector<NearHull>& hulls, const LabelledSceneOptions& options) {
    const double min_cosine = std::cos(radians(kPlaneAngle_deg));
    std::vector<bool> keep(scan.mesh.triangles.size());
    for (std::size_t i = 0; i < keep.size(); ++i) {
        const Triangle& t = scan.mesh.triangles[i];
        Vec3f centre = Vec3f::Zero();
        for (int k = 0; k < 3; ++k) centre += scan.mesh.vertices[std::size_t(t[k])] / 3.0f;
        const double height = scan.support_plane.height(centre.cast<double>());
        const Vec3 normal = triangle_normal(scan.mesh, i).cast<double>();
        const bool is_plane = std::abs(height) < options.plane_tolerance_m &&
                              normal.dot(scan.support_plane.normal) > min_cosine;
        const bool is_below =
            height < 0 && height > -kHiddenBelow_m && support.contains(centre.cast<double>());
        keep[i] = !is_plane && !is_below &&
                  std::none_of(hulls.begin(), hulls.end(),
                               [&](const NearHull& hull) { return hull.contains(centre); });
    }
    return without_small_pieces(with_triangles(scan.mesh, keep), kMinPiece_m2);
}

/// Colours of the plane from the scan's vertices beside it; unknown cells from around.
void colour_support(const Scan& scan, double tolerance_m, double cell_m, Mesh& plane) {
    std::map<std::array<int, 2>, std::pair<Rgb, float>> cells;
    const Rigid3 flat = plane_from_world(scan.support_plane);
    const auto cell = [&](const Vec3f& v) {
        const Vec3 p = flat * v.cast<double>();
        return std::array<int, 2>{static_cast<int>(std::lround(p.x() / cell_m)),
                                  static_cast<int>(std::lround(p.y() / cell_m))};
    };
    for (std::size_t i = 0; i < scan.mesh.vertices.size(); ++i) {
        const Vec3f& v = scan.mesh.vertices[i];
        if (std::abs(scan.support_plane.height(v.cast<double>())) > tolerance_m) continue;
        auto& [sum, count] = cells.try_emplace(cell(v), Rgb::Zero(), 0.0f).first->second;
        sum += scan.mesh.colours[i];
        count += 1.0f;
    }
    plane.colours.assign(plane.vertices.size(), Rgb::Zero());
    std::vector<std::uint8_t> known(plane.vertices.size(), 0);
    for (std::size_t i = 0; i < plane.vertices.size(); ++i) {
        const auto it = cells.find(cell(plane.vertices[i]));
        if (it == cells.end()) continue;
        plane.colours[i] = it->second.first / it->second.second;
        known[i] = 1;
    }
    spread_colours(plane, plane.colours, std::move(known));
}

}  // namespace

Scene build_scene(const Scan& scan, const Candidates& candidates,
                  const LabelledSceneOptions& options) {
    Scene scene;
    scene.cameras = scan.cameras;
    const SupportSurface support = find_support_surface(
        scan.mesh, scan.support_plane, options.plane_cell_m, options.plane_tolerance_m);
    std::vector<NearHull> hulls;
    for (const Candidate& candidate : candidates.objects) {
        hulls.emplace_back(candidate.hull, options.hull_margin_m);
    }
    Mesh mesh = standing_surface(scan, support, hulls, options);
    Mesh plane = support.mesh();
    colour_support(scan, options.plane_tolerance_m, options.plane_cell_m, plane);
    append(mesh, plane);
    Part part;
    part.name = "scan";
    part.mesh = std::make_shared<const Mesh>(std::move(mesh));
    Diffuse diffuse;
    diffuse.use_vertex_colours = true;
    part.material = diffuse;
    scene.parts.push_back(part);
    for (const Candidate& candidate : candidates.objects) {
        Part object;
        object.name = candidate.id;
        object.mesh = std::make_shared<const Mesh>(candidate.hull);
        object.material = Diffuse{};
        scene.parts.push_back(object);
    }
    return scene;
}

}  // namespace vitrine
