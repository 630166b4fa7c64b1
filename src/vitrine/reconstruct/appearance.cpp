#include "reconstruct/appearance.h"

#include "base/parallel.h"
#include "reconstruct/scan.h"

#include <algorithm>
#include <array>

namespace vitrine {
namespace {

constexpr double kMinCosine = 0.26;    // 75 degrees: beyond, a pixel smears over too much surface
constexpr std::size_t kMaxViews = 64;  // nearest in index; a median needs no more

float median_of(std::array<float, kMaxViews>& values, std::size_t count) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(values.begin(), middle, values.begin() + static_cast<std::ptrdiff_t>(count));
    if (count % 2 == 1) return *middle;
    return 0.5f * (*middle + *std::max_element(values.begin(), middle));
}

}  // namespace

bool median_colour(const Vec3& point, const Vec3& normal, std::span<const ViewOfScene> views,
                   std::size_t min_views, Rgb& colour) {
    std::array<std::array<float, kMaxViews>, 3> values;
    std::size_t count = 0;
    for (const ViewOfScene& view : views) {
        const Vec3 p = view.camera->cam_from_world * point;
        if (p.z() <= 0.05) continue;
        const Vec2 pixel = view.camera->project_camera(p);
        if (!view.camera->sees(pixel, 1)) continue;
        const int x = static_cast<int>(std::lround(pixel.x()));
        const int y = static_cast<int>(std::lround(pixel.y()));
        if (view.excluded && is_inside(*view.excluded, x, y)) continue;
        const double model = (*view.model_depth_m)(x, y);
        // A pixel's depth slides along an oblique surface by about z / f per pixel.
        const double slack = 2 * depth_noise_m(p.z()) + 3 * p.z() / view.camera->fx;
        if (model <= 0 || std::abs(model - p.z()) > slack) continue;
        const Vec3 to_camera = (view.camera->centre_in_world() - point).normalized();
        if (to_camera.dot(normal) < kMinCosine) continue;
        const Rgb c = bilinear(view.frame->colour, pixel.x(), pixel.y());
        for (std::size_t k = 0; k < 3; ++k) values[k][count] = c[static_cast<int>(k)];
        if (++count == kMaxViews) break;
    }
    if (count < std::max<std::size_t>(1, min_views)) return false;
    for (int k = 0; k < 3; ++k) colour[k] = median_of(values[static_cast<std::size_t>(k)], count);
    return true;
}

void spread_colours(const Mesh& mesh, std::vector<Rgb>& colours, std::vector<std::uint8_t> known) {
    for (int ring = 0; ring < 200; ++ring) {
        std::vector<Rgb> sum(colours.size(), Rgb::Zero());
        std::vector<int> count(colours.size(), 0);
        for (const Triangle& t : mesh.triangles) {
            for (int k = 0; k < 3; ++k) {
                const auto a = static_cast<std::size_t>(t[k]);
                const auto b = static_cast<std::size_t>(t[(k + 1) % 3]);
                if (known[a] && !known[b]) sum[b] += colours[a], ++count[b];
                if (known[b] && !known[a]) sum[a] += colours[b], ++count[a];
            }
        }
        bool has_changed = false;
        for (std::size_t i = 0; i < colours.size(); ++i) {
            if (count[i] == 0) continue;
            colours[i] = sum[i] / static_cast<float>(count[i]);
            known[i] = 1;
            has_changed = true;
        }
        if (!has_changed) return;
    }
}

std::vector<Rgb> vertex_colours(const Mesh& mesh, std::span<const ViewOfScene> views) {
    std::vector<Rgb> colours(mesh.vertices.size(), Rgb::Zero());
    std::vector<std::uint8_t> known(mesh.vertices.size(), 0);
    const std::vector<Vec3f> computed =
        mesh.normals.empty() ? vertex_normals(mesh) : std::vector<Vec3f>();
    const std::vector<Vec3f>& normals = mesh.normals.empty() ? computed : mesh.normals;
    parallel_for(mesh.vertices.size(), 2048, [&](std::size_t i) {
        known[i] = median_colour(mesh.vertices[i].cast<double>(), normals[i].cast<double>(), views,
                                 1, colours[i])
                       ? 1
                       : 0;
    });
    spread_colours(mesh, colours, std::move(known));
    return colours;
}

}  // namespace vitrine
