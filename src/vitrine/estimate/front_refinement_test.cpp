#include "estimate/front_refinement.h"

#include "estimate/translucent_world.h"
#include "reconstruct/relief.h"
#include "render/render_object.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

constexpr int kSize = 220;

double squared_difference(const ImageRgb& a, const ImageRgb& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]).matrix().squaredNorm();
    return sum;
}

double normals_deg(const Relief& a, const Relief& b) {
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < a.mask.size(); ++i) {
        if (a.mask[i] <= 127) continue;
        sum += degrees(angle_between(a.normals[i].cast<double>(), b.normals[i].cast<double>()));
        count += 1;
    }
    return sum / count;
}

struct BumpyWorld {
    Relief smooth = testing_world::ellipsoid(kSize, 100, 80);
    Relief bumpy = smooth;
    ViewLights lights = testing_world::key_and_back(smooth, 1.0);
    RadialProfile profile = testing_world::apple(3);

    BumpyWorld() {
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                if (!is_inside(bumpy.mask, x, y)) continue;
                const double bump = 10 * std::sin(0.06 * x) * std::cos(0.07 * y);
                bumpy.depth_px(x, y) +=
                    static_cast<float>(bump * std::sqrt(smooth.depth_px(x, y) / 80));
            }
        }
        bumpy.normals = relief_normals(bumpy.depth_px, bumpy.mask);
        lights.lights.push_back({Vec3(0.6, -0.3, 0.74).normalized(), Rgbd::Constant(0.8)});
    }
    ImageRgb render(const Relief& relief) const {
        TranslucentRenderOptions options;
        options.eta = 1;
        return render_object(relief, lights, profile, options);
    }
    Relief refined(const ImageRgb& picture) const {
        return refine_front(smooth, smooth, picture, Mask(), lights, 6, 1.0,
                            [&](const Relief& relief) { return render(relief); })
            .relief;
    }
};

TEST(FrontRefinement, RenderingComesToShowThePicture) {
    const BumpyWorld world;
    const ImageRgb picture = world.render(world.bumpy);
    const Relief found = world.refined(picture);
    EXPECT_LT(squared_difference(world.render(found), picture),
              0.15 * squared_difference(world.render(world.smooth), picture));
    EXPECT_LT(normals_deg(found, world.bumpy), 0.7 * normals_deg(world.smooth, world.bumpy));
}

TEST(FrontRefinement, WhatIsExplainedStays) {
    const BumpyWorld world;
    const Relief same = world.refined(world.render(world.smooth));
    EXPECT_LT(normals_deg(same, world.smooth), 1.0);
}

}  // namespace
}  // namespace vitrine
