#include "pipeline/mlds_stimuli.h"

#include "base/error.h"
#include "base/file.h"
#include "image/image_io.h"
#include "pipeline/mlds_presets.h"
#include "pipeline/mlds_report.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace vitrine {
namespace {
namespace fs = std::filesystem;

TEST(MldsPresets, StoredScenesAreTheOnesTheCodeMakes) {
    for (const std::string& name : mlds_preset_names()) {
        const SeriesSpec made = make_mlds_preset(name);
        const SeriesSpec stored =
            read_series_spec(fs::path(VITRINE_SOURCE_DIR) / "scenes/mlds" / (name + ".json"));
        EXPECT_EQ(stored.ior, made.ior) << name;
        EXPECT_EQ(stored.part, made.part);
        EXPECT_EQ(stored.scene.cameras.front().fx, made.scene.cameras.front().fx) << name;
        ASSERT_EQ(stored.scene.parts.size(), made.scene.parts.size());
        for (std::size_t i = 0; i < made.scene.parts.size(); ++i) {
            const Mesh &a = *stored.scene.parts[i].mesh, &b = *made.scene.parts[i].mesh;
            ASSERT_EQ(a.vertices.size(), b.vertices.size());
            for (std::size_t v = 0; v < a.vertices.size(); ++v) {
                ASSERT_LT((a.vertices[v] - b.vertices[v]).norm(), 1e-6f) << name;
            }
        }
    }
}

TEST(MldsPresets, GlassIsClosedAndStandsOnTheTable) {
    for (const std::string& name : mlds_preset_names()) {
        const SeriesSpec spec = make_mlds_preset(name);
        ASSERT_EQ(spec.ior.size(), 10u);
        for (const Part& part : spec.scene.parts) {
            if (part.name != "glass") continue;
            EXPECT_TRUE(find_defects(*part.mesh).is_closed()) << name;
            EXPECT_GT(volume(*part.mesh), 1e-6) << name;
            EXPECT_GT(bounds(*part.mesh).min.z(), 0.0) << name;
            EXPECT_LT(bounds(*part.mesh).min.z(), 0.002) << name;
        }
    }
    EXPECT_THROW(make_mlds_preset("sphere"), InputError);
}

TEST(MldsSeries, RefusesWhatCannotBeShown) {
    SeriesSpec spec = make_mlds_preset("sphere_point");
    spec.part = "table";
    EXPECT_THROW(check_series(spec, "x"), InputError);
    spec.part = "glass";
    spec.ior = {1.4, 1.3, 1.5, 1.6};
    EXPECT_THROW(check_series(spec, "x"), InputError);
    spec.ior = {0.9, 1.3, 1.5, 1.6};
    EXPECT_THROW(check_series(spec, "x"), InputError);
    spec.ior = {1.3, 1.4, 1.5, 1.6};
    StimuliOptions options;
    options.use_photons = false;
    EXPECT_THROW(render_stimuli(spec, fs::temp_directory_path() / "vitrine_stimuli", options),
                 InputError);
}

TEST(MldsSeries, RendersASeriesThatDiffersMoreTheFartherApart) {
    SeriesSpec spec = make_mlds_preset("sphere_point");
    spec.ior = {1.40, 1.42, 1.44, 1.46};
    StimuliOptions options;
    options.size_px = 48;
    options.samples_per_pixel = options.max_samples_per_pixel = 4;
    options.photon_count = 30'000;
    options.gather_radius_m = 0.002;
    const fs::path folder = fs::temp_directory_path() / "vitrine_stimuli_test";
    fs::remove_all(folder);
    const StimulusSeries series = render_stimuli(spec, folder, options);
    ASSERT_EQ(series.images.size(), 4u);
    EXPECT_GT(series.exposure, 0.0);
    EXPECT_GT(series.noise.picture, 0.0);
    EXPECT_LT(series.noise.picture_seen, series.noise.picture);
    EXPECT_LT(series.noise.difference_seen, series.noise.picture);
    for (const std::string& file : series.images) {
        EXPECT_EQ(read_png(folder / file).width, 48);
    }
    const StimulusSeries read =
        series_from_json(read_text_file(folder / "stimuli.json"), "stimuli.json");
    EXPECT_EQ(read.ior, series.ior);
    const auto pictures = read_linear_stimuli(folder, read);
    EXPECT_GT(visible_difference(pictures[0], pictures[3]),
              visible_difference(pictures[0], pictures[1]));
    fs::remove_all(folder);
}

TEST(MldsReport, IsOnePageThatNamesWhatItShows) {
    MldsReport report;
    report.title = "A <study>";
    StudyAnalysis& study = report.study;
    study.stimuli = {1.4, 1.41, 1.42, 1.43};
    study.stimuli_are_ior = true;
    study.pooled.name = "pooled";
    study.pooled.scale.stimulus_count = 4;
    study.pooled.scale.beta = study.pooled.scale.se_beta = {0, 0.5, 1.0, 1.5};
    study.pooled.scale.psi = {0, 1 / 3.0, 2 / 3.0, 1};
    study.pooled.lambda = {0.01, {{1.4, 0.01}, {1.41, 0.01}, {1.42, 0.01}, {1.43, kNoThreshold}}};
    study.pooled.lambda_ci95 = {0.008, kNoThreshold};
    report.prediction = PredictedThreshold{{{1.4, 0.006}, {1.43, 0.009}}, 0.006};
    const std::string html = mlds_report_html(report);
    EXPECT_NE(html.find("A &lt;study&gt;"), std::string::npos);
    EXPECT_NE(html.find("lambda = 0.01"), std::string::npos);
    EXPECT_NE(html.find("not measured with people"), std::string::npos);
    // 0.006 computed beside 0.010 measured at 1.4.
    EXPECT_NE(html.find("<td class=\"number\">0.6</td>"), std::string::npos);
    EXPECT_NE(html.find("unbounded"), std::string::npos);
    EXPECT_EQ(html.find("nan"), std::string::npos);
    EXPECT_EQ(html.find("http"), std::string::npos);
}

}  // namespace
}  // namespace vitrine
