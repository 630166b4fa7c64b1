#include "pipeline/evaluate.h"

#include "base/file.h"
#include "geometry/mesh_io.h"
#include "geometry/primitives.h"
#include "pipeline/insertion_measure.h"

#include <gtest/gtest.h>

#include <unistd.h>

namespace vitrine {
namespace {

namespace fs = std::filesystem;

TEST(InsertionMeasure, TruthIsPerfectAndNothingIsOne) {
    ImageRgb without(120, 80, Rgb::Constant(0.5f));
    ImageRgb with = without;
    Mask mask(120, 80, 0);
    for (int y = 20; y < 50; ++y) {
        for (int x = 20; x < 50; ++x) {
            with(x, y) = Rgb(0.9f, 0.8f, 0.7f);
            mask(x, y) = 255;
        }
        for (int x = 60; x < 80; ++x) with(x, y) *= 0.4f;   // a shadow
        for (int x = 90; x < 100; ++x) with(x, y) *= 1.5f;  // a caustic
    }
    const InsertionError perfect = measure_insertion(with, without, with, without, mask, 1.25);
    EXPECT_DOUBLE_EQ(perfect.all, 0.0);
    const InsertionError nothing = measure_insertion(with, without, without, without, mask, 1.25);
    EXPECT_DOUBLE_EQ(nothing.darker, 1.0);
    EXPECT_DOUBLE_EQ(nothing.brighter, 1.0);
    EXPECT_DOUBLE_EQ(nothing.object, 1.0);
    ImageRgb half = without;
    for (std::size_t i = 0; i < half.size(); ++i) half[i] = 0.5f * (with[i] + without[i]);
    EXPECT_NEAR(measure_insertion(with, without, half, without, mask, 1.25).changed, 0.5, 1e-4);
    EXPECT_NEAR(nothing.all_floor, 0.0, 1e-6);  // a truth without noise
}

TEST(Evaluate, ComparesLightsAndObjects) {
    const fs::path folder =
        fs::temp_directory_path() / ("vitrine_evaluate_" + std::to_string(::getpid()));
    write_text_file(folder / "truth/scene.json", R"({"reference_point": [0, 0, 0], "lights": [
        {"centre": [0, 0.6, 0.8], "radius": 0.04, "point_intensity_W_sr": [2, 2, 2]}],
        "objects": [{"name": "ball", "class": "transparent", "bbox_min": [-0.05, -0.05, 0],
        "bbox_max": [0.05, 0.05, 0.1], "material": {"ior": 1.5, "sigma_a_per_metre": [1, 2, 3]}},
        {"name": "ring", "class": "specular", "bbox_min": [1, 1, 0], "bbox_max": [1.1, 1.1, 0.1],
        "material": {}}]})");
    write_ply(folder / "object_0.ply", make_sphere(0.05, Vec3(0, 0, 0.05)));
    write_text_file(folder / "estimate.json", R"({"lights": [{"kind": "disc",
        "position_m": [0, 0.66, 0.88], "radius_m": 0.05, "intensity_w_per_sr": [1, 2, 3]}],
        "objects": [{"id": "object_0", "class": "transparent", "mesh": "object_0.ply",
        "ior": {"value": 1.52, "stddev": 0.01, "outcome": "converged"},
        "sigma_a_per_m": {"value": [1, 2, 4], "stddev": [0, 0, 0], "outcome": "converged"}}]})");
    const Evaluation evaluation = evaluate_workspace(folder, folder / "truth/scene.json");
    EXPECT_NEAR(evaluation.value("light 0", "direction_error_deg"), 0.0, 1e-6);
    EXPECT_NEAR(evaluation.value("light 0", "distance_error_percent"), 10.0, 1e-6);
    EXPECT_NEAR(evaluation.value("light 0", "radius_error_percent"), 25.0, 1e-6);
    EXPECT_NEAR(evaluation.value("object_0", "ior_error"), 0.02, 1e-9);
    EXPECT_NEAR(evaluation.value("object_0", "sigma_a_error_per_m_blue"), 1.0, 1e-6);
    EXPECT_EQ(evaluation.value("objects", "missing"), 1.0);
    EXPECT_EQ(evaluation.value("objects", "wrong_class"), 0.0);
    EXPECT_NE(evaluation.text().find("direction_error_deg"), std::string::npos);
    fs::remove_all(folder);
}

}  // namespace
}  // namespace vitrine
