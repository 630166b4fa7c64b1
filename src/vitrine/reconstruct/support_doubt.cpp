#include "reconstruct/support_doubt.h"

namespace vitrine {

SupportDoubt doubt_support(const SceneViews& views, int min_views, double min_bad_fraction) {
    constexpr double kHiddenMargin_m = 0.01;
    const SupportSurface& support = views.support;
    const Rigid3 world_from_plane = support.plane_from_world.inverse();
    const double cell_m2 = support.cell_m * support.cell_m;
    SupportDoubt doubt;
    for (int row = 0; row < support.rows; ++row) {
        for (int column = 0; column < support.columns; ++column) {
            if (!support.is_filled[static_cast<std::size_t>(row * support.columns + column)]) {
                continue;
            }
            const Vec3 p =
                world_from_plane * Vec3(support.origin.x() + (column + 0.5) * support.cell_m,
                                        support.origin.y() + (row + 0.5) * support.cell_m, 0);
            int seen = 0, bad = 0;
            for (std::size_t i = 0; i < views.count(); ++i) {
                const Camera& camera = views.scan->cameras[i];
                const Vec3 q = camera.cam_from_world * p;
                if (q.z() <= 0.05) continue;
                const Vec2 pixel = camera.project_camera(q);
                if (!camera.sees(pixel)) continue;
                const int x = static_cast<int>(std::lround(pixel.x()));
                const int y = static_cast<int>(std::lround(pixel.y()));
                const double before = views.background_depth_m[i](x, y);
                if (before > 0 && before + kHiddenMargin_m < q.z()) continue;
                const DepthClass there = views.classes[i](x, y);
                if (there == DepthClass::Unknown || there == DepthClass::Shadow) continue;
                ++seen;
                bad += is_bad(there) ? 1 : 0;
            }
            if (seen < min_views) continue;
            doubt.seen_m2 += cell_m2;
            if (bad >= min_bad_fraction * seen) doubt.doubtful_m2 += cell_m2;
        }
    }
    return doubt;
}

}  // namespace vitrine
