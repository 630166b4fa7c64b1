#include "pipeline/placement.h"

#include "base/error.h"
#include "base/text.h"
#include "scene/virtual_object.h"
#include "trace/accel.h"

#include <algorithm>

namespace vitrine {
namespace {

constexpr double kFlatEnough_deg =
    30.0;  // scans of tables are rarely off by more than a few degrees

}  // namespace

Placement parse_placement(const std::string& text) {
    const std::size_t second = text.rfind(','),
                      first = second == std::string::npos ? second : text.rfind(',', second - 1);
    Placement placement;
    if (first == std::string::npos || first == 0 ||
        !parse_double(text.substr(first + 1, second - first - 1), placement.pixel.x()) ||
        !parse_double(text.substr(second + 1), placement.pixel.y())) {
        throw UsageError("--at needs FRAME,U,V such as 000003,320,180, not \"" + text + "\"");
    }
    placement.frame = text.substr(0, first);
    return placement;
}

Insertion place_on_surface(const std::filesystem::path& mesh_file, const Placement& placement,
                           const Scene& scene, const Vec3& up) {
    const auto camera = std::find_if(scene.cameras.begin(), scene.cameras.end(),
                                     [&](const Camera& c) { return c.id == placement.frame; });
    if (camera == scene.cameras.end() || !camera->sees(placement.pixel)) {
        std::vector<std::string> ids;
        for (const Camera& c : scene.cameras) ids.push_back(c.id);
        throw InputError(
            {"--at", "a frame of the capture and a pixel within it",
             fmt::format("{},{:g},{:g}", placement.frame, placement.pixel.x(), placement.pixel.y()),
             "Frames: " + join(ids, " ")});
    }
    std::vector<AccelPart> parts;
    for (const Part& part : scene.parts) parts.push_back({part.mesh, 1u});
    const Accel accel(parts);
    const Vec3 ray = camera->ray_in_world(placement.pixel.x(), placement.pixel.y());
    const Hit hit = accel.closest({camera->centre_in_world().cast<float>(), ray.cast<float>()});
    if (!hit.is_hit()) {
        throw InputError({"--at", "a pixel that shows the reconstructed scene",
                          fmt::format("nothing at {:g},{:g} of frame {}", placement.pixel.x(),
                                      placement.pixel.y(), placement.frame),
                          "Choose a pixel on the table."});
    }
    const Mesh& surface = *parts[static_cast<std::size_t>(hit.part)].mesh;
    const Vec3 point = hit_point(surface, hit).cast<double>();
    Vec3 normal = shading_normal(surface, hit).cast<double>().normalized();
    if (normal.dot(ray) > 0) normal = -normal;
    const Vec3 axis = angle_between(normal, up) < radians(kFlatEnough_deg) ? up : normal;

    Insertion insertion;
    const std::vector<VirtualMesh> meshes = read_virtual_meshes(mesh_file, insertion.notes);
    Box3 box;
    for (const VirtualMesh& virtual_mesh : meshes) {
        box.extend(bounds(virtual_mesh.mesh).min);
        box.extend(bounds(virtual_mesh.mesh).max);
    }
    const Vec3 foot(box.centre().x(), box.centre().y(), box.min.z());
    Mat4 world_from_mesh = Mat4::Identity();
    world_from_mesh.topLeftCorner<3, 3>() =
        Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), axis).toRotationMatrix();
    world_from_mesh.topRightCorner<3, 1>() = point - world_from_mesh.topLeftCorner<3, 3>() * foot;
    insertion.objects =
        make_virtual_parts(meshes, mesh_file, world_from_mesh, std::nullopt, 0, insertion.notes);
    insertion.frames = {placement.frame};
    return insertion;
}

}  // namespace vitrine
