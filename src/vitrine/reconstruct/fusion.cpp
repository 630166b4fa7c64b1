#include "reconstruct/fusion.h"

#include "base/error.h"

#include <open3d/camera/PinholeCameraIntrinsic.h>
#include <open3d/geometry/Image.h>
#include <open3d/geometry/RGBDImage.h>
#include <open3d/geometry/TriangleMesh.h>
#include <open3d/pipelines/integration/ScalableTSDFVolume.h>

#include <omp.h>

namespace vitrine {
namespace {

/// Open3D opens a parallel region per block of voxels; its waiting threads burn more time than they
/// save, most of all when other programs run. No active level: every region runs on one thread.
class NoOpenMpThreads {
  public:
    NoOpenMpThreads() : before_(omp_get_max_active_levels()) { omp_set_max_active_levels(0); }
    ~NoOpenMpThreads() { omp_set_max_active_levels(before_); }
    NoOpenMpThreads(const NoOpenMpThreads&) = delete;
    NoOpenMpThreads& operator=(const NoOpenMpThreads&) = delete;

  private:
    int before_;
};

}  // namespace

Mesh fuse_depth(std::span<const ImageF> depth_m, std::span<const Camera> cameras,
                const FusionOptions& options) {
    namespace o3d = open3d;
    VITRINE_CHECK_EQ(depth_m.size(), cameras.size());
    const NoOpenMpThreads no_threads;
    o3d::pipelines::integration::ScalableTSDFVolume volume(
        options.voxel_m, options.truncation_m,
        o3d::pipelines::integration::TSDFVolumeColorType::NoColor);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const ImageF& depth = depth_m[i];
        if (depth.empty()) continue;
        o3d::geometry::RGBDImage image;
        image.depth_.Prepare(depth.width(), depth.height(), 1, 4);
        auto* out = reinterpret_cast<float*>(image.depth_.data_.data());
        for (std::size_t p = 0; p < depth.size(); ++p) {
            out[p] = depth[p] < static_cast<float>(options.max_depth_m) ? depth[p] : 0.0f;
        }
        const Camera& c = cameras[i];
        const o3d::camera::PinholeCameraIntrinsic intrinsic(c.width, c.height, c.fx, c.fy, c.cx,
                                                            c.cy);
        volume.Integrate(image, intrinsic, c.cam_from_world.matrix());
    }
    const auto fused = volume.ExtractTriangleMesh();
    Mesh mesh;
    mesh.vertices.reserve(fused->vertices_.size());
    for (const auto& v : fused->vertices_) mesh.vertices.push_back(v.cast<float>());
    mesh.triangles.assign(fused->triangles_.begin(), fused->triangles_.end());
    return mesh;
}

Mesh without_small_pieces(const Mesh& mesh, double min_area_m2) {
    const std::vector<int> piece = triangle_components(mesh);
    std::vector<double> area;
    for (std::size_t i = 0; i < piece.size(); ++i) {
        const auto p = static_cast<std::size_t>(piece[i]);
        if (p >= area.size()) area.resize(p + 1, 0.0);
        area[p] += triangle_area(mesh, i);
    }
    std::vector<bool> keep(piece.size());
    for (std::size_t i = 0; i < piece.size(); ++i) {
        keep[i] = area[static_cast<std::size_t>(piece[i])] >= min_area_m2;
    }
    return with_triangles(mesh, keep);
}

}  // namespace vitrine
