#include "reconstruct/relief.h"

#include "base/parallel.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

struct Ellipsoid {
    Relief truth;
    ImageRgb shaded;
};

/// A half ellipsoid (a along x, b along y and z), Lambertian from the upper left.
Ellipsoid make_ellipsoid(double a, double b) {
    const int size = 320;
    Ellipsoid world;
    world.truth.mask = Mask(size, size);
    world.truth.depth_px = ImageF(size, size);
    world.truth.normals = Image<Vec3f>(size, size, Vec3f(0, 0, 1));
    world.shaded = ImageRgb(size, size);
    const Vec3f light = Vec3f(-0.4f, 0.5f, 0.76f).normalized();
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double u = x - 159.5, v = 159.5 - y;
            const double rest = 1 - u * u / (a * a) - v * v / (b * b);
            if (rest <= 0) continue;
            world.truth.mask(x, y) = 255;
            world.truth.depth_px(x, y) = static_cast<float>(b * std::sqrt(rest));
            world.truth.normals(x, y) =
                Vec3f(static_cast<float>(u / (a * a)), static_cast<float>(v / (b * b)),
                      world.truth.depth_px(x, y) / static_cast<float>(b * b))
                    .normalized();
            const float shade = std::max(0.0f, world.truth.normals(x, y).dot(light));
            world.shaded(x, y) = Rgb::Constant(0.1f + 0.6f * shade);
        }
    }
    return world;
}

double mean_normal_error_deg(const Relief& found, const Relief& truth) {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < truth.mask.size(); ++i) {
        if (truth.mask[i] <= 127) continue;
        sum += degrees(
            angle_between(found.normals[i].cast<double>(), truth.normals[i].cast<double>()));
        ++count;
    }
    return sum / static_cast<double>(count);
}

TEST(Relief, AShadedEllipsoidComesBack) {
    const Ellipsoid world = make_ellipsoid(140, 95);
    const Relief found = shade_to_shape(world.shaded, world.truth.mask);
    EXPECT_NEAR(found.inradius_px, 95, 1.5);
    EXPECT_LT(mean_normal_error_deg(found, world.truth), 4.0);
}

TEST(Relief, NormalsStayGoodUpToTheRim) {
    const Ellipsoid world = make_ellipsoid(120, 120);
    Relief found = world.truth;
    found.normals = relief_normals(world.truth.depth_px, world.truth.mask);
    EXPECT_LT(mean_normal_error_deg(found, world.truth), 1.5);
}

TEST(Relief, DarkIsDeep) {
    Ellipsoid world = make_ellipsoid(140, 140);
    for (int y = 150; y < 170; ++y)
        for (int x = 60; x < 260; ++x) world.shaded(x, y) = world.shaded(x, y) * 0.5f;
    ReliefOptions flat;
    flat.alpha = 0;
    const Relief with = shade_to_shape(world.shaded, world.truth.mask);
    const Relief without = shade_to_shape(world.shaded, world.truth.mask, flat);
    EXPECT_LT(with.depth_px(160, 160) / with.depth_px(160, 120),
              without.depth_px(160, 160) / without.depth_px(160, 120) - 0.01);
}

TEST(Relief, SameBitsOnAnyThreadCount) {
    const Ellipsoid world = make_ellipsoid(140, 95);
    set_thread_count(1);
    const Relief one = shade_to_shape(world.shaded, world.truth.mask);
    set_thread_count(0);
    const Relief all = shade_to_shape(world.shaded, world.truth.mask);
    EXPECT_TRUE(std::equal(one.depth_px.begin(), one.depth_px.end(), all.depth_px.begin()));
}

}  // namespace
}  // namespace vitrine
