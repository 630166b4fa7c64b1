#include "render/estimation_irradiance.h"

#include "geometry/primitives.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vitrine {
namespace {

/// A box on a table, and receivers on a line through the border of its shadow.
struct Shadow {
    Scene scene;
    std::vector<SurfacePoint> points;
    TrialLight lamp{Vec3(0.5, 0.1, 0.8), Vec3(-0.5, -0.1, -0.8).normalized(), 0.02};

    Shadow() {
        Mesh scan = make_plane(1.0);
        append(scan, make_box(Vec3(0.1, 0.1, 0.1), Vec3(0, 0, 0.05)));
        scene.parts.push_back({"scan", std::make_shared<const Mesh>(scan), Diffuse{}, "", false});
        for (int k = 0; k <= 40; ++k)
            points.push_back({Vec3f(-0.16f + 0.0025f * static_cast<float>(k), 0, 0)});
    }
    std::vector<float> column(const std::vector<SurfacePoint>& at, int samples) const {
        return direct_column(EstimationScene(scene), at, lamp, samples, kScanMask, 0).clear;
    }
};

TEST(DirectColumn, AFootprintIsTheMeanOverPlacesAround) {
    constexpr float kFootprint = 0.004f;
    constexpr int kPlaces = 24;  // per axis
    const Shadow shadow;
    std::vector<SurfacePoint> wide = shadow.points;
    for (SurfacePoint& point : wide) point.footprint_m = kFootprint;
    const std::vector<float> found = shadow.column(wide, 256);
    const std::vector<float> sharp = shadow.column(shadow.points, 256);
    const float open = *std::max_element(sharp.begin(), sharp.end());
    double blurred_by = 0.0;
    for (std::size_t i = 0; i < wide.size(); ++i) {
        std::vector<SurfacePoint> around;
        for (int y = 0; y < kPlaces; ++y)
            for (int x = 0; x < kPlaces; ++x) {
                const auto offset = [&](int k) {
                    return std::sqrt(3.0f) * kFootprint *
                           (2.0f * (static_cast<float>(k) + 0.5f) / kPlaces - 1.0f);
                };
                around.push_back({wide[i].position + Vec3f(offset(x), offset(y), 0)});
            }
        double sum = 0.0;
        for (const float e : shadow.column(around, 32)) sum += e;
        EXPECT_NEAR(found[i], sum / (kPlaces * kPlaces), 0.03 * open) << i;
        blurred_by = std::max(blurred_by, std::abs(double{found[i]} - sharp[i]));
    }
    EXPECT_GT(blurred_by, 0.1 * open);
}

TEST(DirectColumn, FewSamplesDoNotMoveAShadowsBorder) {
    constexpr float kFootprint = 0.004f, kSpacing = 0.00025f;
    constexpr int kCount = 640;
    const Shadow shadow;
    // Lines through a border each, across the lamp's azimuth and along it.
    for (const auto& [start, step] : {std::pair{Vec3f(-0.16f, 0, 0), Vec3f(kSpacing, 0, 0)},
                                      std::pair{Vec3f(-0.07f, -0.12f, 0), Vec3f(0, kSpacing, 0)}}) {
        std::vector<SurfacePoint> points;
        for (int k = 0; k < kCount; ++k)
            points.push_back({start + static_cast<float>(k) * step, Vec3f(0, 0, 1), kFootprint});
        const auto lit_length_m = [&](int samples) {
            const std::vector<float> e = shadow.column(points, samples);
            double sum = 0.0;
            for (const float x : e) sum += double{x} / *std::max_element(e.begin(), e.end());
            return sum * kSpacing;
        };
        EXPECT_NEAR(lit_length_m(16), lit_length_m(512), 0.06 * kFootprint) << step.transpose();
    }
}

TEST(DirectColumn, AShadowEndsWhereTheRayOverTheEdgeMeetsTheTable) {
    Shadow shadow;
    shadow.lamp.radius_m = 0.0;
    constexpr float kSpacing = 0.0001f, kStart = -0.16f;
    std::vector<SurfacePoint> points;
    for (int k = 0; k < 600; ++k)
        points.push_back({Vec3f(kStart + kSpacing * static_cast<float>(k), 0, 0)});
    const std::vector<float> e = shadow.column(points, 1);
    const auto dark = static_cast<float>(std::find(e.begin(), e.end(), 0.0f) - e.begin());
    // Lamp at (0.5, 0.1, 0.8), upper edge of the box at x = -0.05, z = 0.1.
    EXPECT_NEAR(kStart + kSpacing * dark, -0.05f - 0.55f / 7.0f, 0.0003f);
}

TEST(DirectColumn, OfAPointLampHasPenumbraeOfTheFootprintAlone) {
    Shadow shadow;
    shadow.lamp.radius_m = 0.0;
    const auto partly_lit = [&](float footprint_m) {
        std::vector<SurfacePoint> points = shadow.points;
        for (SurfacePoint& point : points) point.footprint_m = footprint_m;
        const std::vector<float> e = shadow.column(points, 64);
        const float open = *std::max_element(e.begin(), e.end());
        return std::count_if(e.begin(), e.end(),
                             [&](float x) { return x > 0.05f * open && x < 0.9f * open; });
    };
    EXPECT_EQ(partly_lit(0.0f), 0);
    EXPECT_GE(partly_lit(0.004f), 3);
}

}  // namespace
}  // namespace vitrine
