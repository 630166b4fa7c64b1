#include "reconstruct/candidate_views.h"

#include "base/parallel.h"
#include "image/filter.h"
#include "trace/depth_map.h"

namespace vitrine {
namespace {

constexpr double kPlaneTolerance_m = 0.006;
constexpr double kSupportCell_m = 0.004;
constexpr double kHiddenMargin_m = 0.01;
constexpr std::size_t kMinPixels = 30;

/// The scan without what it holds inside the bodies, plus the closed support plane.
Mesh background_mesh(const Scan& scan, const SupportSurface& support,
                     const std::vector<Box3>& bodies) {
    std::vector<bool> keep(scan.mesh.triangles.size());
    for (std::size_t i = 0; i < keep.size(); ++i) {
        const Triangle& t = scan.mesh.triangles[i];
        Vec3 centre = Vec3::Zero();
        for (int k = 0; k < 3; ++k) {
            centre += scan.mesh.vertices[static_cast<std::size_t>(t[k])].cast<double>() / 3;
        }
        keep[i] = true;
        if (std::abs(scan.support_plane.height(centre)) < kPlaneTolerance_m) continue;
        for (const Box3& body : bodies) keep[i] = keep[i] && !body.contains(centre);
    }
    Mesh mesh = with_triangles(scan.mesh, keep);
    append(mesh, support.mesh());
    return mesh;
}

}  // namespace

SceneViews make_scene_views(const Capture& capture, const Scan& scan,
                            const std::vector<Box3>& bodies, double max_depth_m) {
    SceneViews views;
    views.capture = &capture;
    views.scan = &scan;
    views.support =
        find_support_surface(scan.mesh, scan.support_plane, kSupportCell_m, kPlaneTolerance_m);
    views.background = Accel(std::vector<AccelPart>{
        {std::make_shared<const Mesh>(background_mesh(scan, views.support, bodies))}});
    for (std::size_t i = 0; i < scan.cameras.size(); ++i) {
        views.background_depth_m.push_back(render_depth(views.background, scan.cameras[i]));
        views.classes.push_back(classify_depth(capture.frames[i].depth_m,
                                               views.background_depth_m.back(), scan.cameras[i],
                                               max_depth_m));
    }
    return views;
}

std::vector<BodyImage> render_body(const SceneViews& views, const Mesh& body, const Mesh& grown) {
    const Accel tight(std::vector<AccelPart>{{std::make_shared<const Mesh>(body)}});
    const Accel wide(std::vector<AccelPart>{{std::make_shared<const Mesh>(grown)}});
    std::vector<BodyImage> images(views.count());
    for (std::size_t i = 0; i < views.count(); ++i) {
        const Camera& camera = views.scan->cameras[i];
        BodyImage& image = images[i];
        image.depth_m = render_depth(tight, camera);
        const ImageF wide_depth = render_depth(wide, camera);
        image.expected = Mask(camera.width, camera.height);
        image.hidden = Mask(camera.width, camera.height);
        std::size_t count = 0;
        for (std::size_t p = 0; p < wide_depth.size(); ++p) {
            const float scene = views.background_depth_m[i][p];
            const float own = image.depth_m[p] > 0 ? image.depth_m[p] : wide_depth[p];
            const bool is_hidden = own > 0 && scene > 0 && scene + kHiddenMargin_m < own &&
                                   views.classes[i][p] != DepthClass::Through;
            if (is_hidden) image.hidden[p] = 255;
            if (image.depth_m[p] > 0 && !is_hidden) {
                image.expected[p] = 255;
                ++count;
            }
        }
        if (count < kMinPixels) image.expected = Mask();
    }
    return images;
}

void predict_background(const SceneViews& views, const std::vector<Mask>& occupied,
                        std::size_t index, const PixelBox& box, ImageRgb& colour, Mask& known) {
    const Camera& camera = views.scan->cameras[index];
    colour = ImageRgb(camera.width, camera.height);
    known = Mask(camera.width, camera.height);
    std::vector<ViewOfScene> others;
    for (std::size_t i = 0; i < views.count(); ++i) {
        if (i == index) continue;
        others.push_back({&views.capture->frames[i], &views.scan->cameras[i],
                          &views.background_depth_m[i], &occupied[i]});
    }
    const Mesh& mesh = *views.background.parts()[0].mesh;
    parallel_for(static_cast<std::size_t>(std::max(0, box.y1 - box.y0)), 4, [&](std::size_t row) {
        const int y = box.y0 + static_cast<int>(row);
        for (int x = box.x0; x < box.x1; ++x) {
            const Hit hit = views.background.closest(camera_ray(camera, x, y));
            if (!hit.is_hit()) continue;
            Rgb c;
            if (!median_colour(hit_point(mesh, hit).cast<double>(),
                               shading_normal(mesh, hit).cast<double>(), others, 2, c)) {
                continue;
            }
            colour(x, y) = c;
            known(x, y) = 255;
        }
    });
}

}  // namespace vitrine
