#include "pipeline/transfer_recipe.h"

#include "base/file.h"
#include "image/colour.h"
#include "image/image_io.h"
#include "scene/scene_json.h"

#include <gtest/gtest.h>

#include <unistd.h>

namespace vitrine {
namespace {

namespace fs = std::filesystem;

class TransferRecipeTest : public ::testing::Test {
  protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / fmt::format("vitrine_transfer_{}", ::getpid());
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    MediumEstimate medium() const {
        MediumEstimate result;
        result.inradius_px = 60;
        for (std::size_t c = 0; c < 3; ++c) {
            result.fit[c] = {2e-3, -0.1, 1e-4, -0.03};
            result.channels[c].albedo = result.fit[c].total();
            result.channels[c].mean_radius_px = result.fit[c].mean_radius();
        }
        return result;
    }
    void write_photo(const std::string& name, const Rgb& colour) const {
        ImageRgb picture(160, 160, Rgb(0.2f, 0.2f, 0.25f));
        Mask mask(160, 160);
        for (int y = 0; y < 160; ++y) {
            for (int x = 0; x < 160; ++x) {
                const double u = (x - 80) / 60.0, v = (80 - y) / 60.0;
                const double rest = 1 - u * u - v * v;
                if (rest <= 0) continue;
                mask(x, y) = 255;
                const double shade = std::max(0.0, -0.5 * u + 0.5 * v + 0.7 * std::sqrt(rest));
                picture(x, y) = colour * static_cast<float>(0.1 + 0.8 * shade);
            }
        }
        write_png(folder_ / (name + ".png"), linear_to_srgb8(picture));
        write_png(folder_ / (name + "_mask.png"), mask);
    }
    fs::path folder_;
};

TEST_F(TransferRecipeTest, MaterialFileComesBackAndServesScenes) {
    write_material_json(folder_ / "material.json", medium(), 4000);
    const StoredMaterial stored = read_material_json(folder_ / "material.json");
    EXPECT_DOUBLE_EQ(stored.scale_px_per_m, 4000);
    EXPECT_DOUBLE_EQ(stored.medium.fit[1].a, 2e-3);
    EXPECT_DOUBLE_EQ(stored.medium.inradius_px, 60);
    // The bridge to inserted objects: the scene reader takes the same file, in metres.
    const Translucent translucent = read_translucent_file(folder_ / "material.json", 0);
    RadialProfile profile{translucent.r_m, translucent.rd_per_m2};
    EXPECT_NEAR(profile.total()[0], medium().fit[0].total(), 0.01);
    EXPECT_NEAR(profile.mean_radius()[0], medium().fit[0].mean_radius() / 4000, 2e-4);
}

TEST_F(TransferRecipeTest, MaterialOfUnknownScaleNeedsOneInAScene) {
    write_material_json(folder_ / "material.json", medium(), 0);
    EXPECT_THROW(read_translucent_file(folder_ / "material.json", 0), InputError);
    EXPECT_NO_THROW(read_translucent_file(folder_ / "material.json", 3000));
}

TEST_F(TransferRecipeTest, WritesEveryFile) {
    write_photo("source", Rgb(0.5f, 0.7f, 0.2f));
    write_photo("target", Rgb(0.7f, 0.7f, 0.7f));
    TransferRequest request;
    request.source = folder_ / "source.png";
    request.source_options.mask = folder_ / "source_mask.png";
    request.target = folder_ / "target.png";
    request.target_options.mask = folder_ / "target_mask.png";
    request.out = folder_ / "out";
    run_transfer(request);
    for (const char* name :
         {"transfer.png", "transfer.exr", "material.json", "relief_source.exr", "relief_target.exr",
          "lights_source.json", "lights_target.json", "report.html"}) {
        EXPECT_TRUE(fs::exists(request.out / name)) << name;
    }
    const ImageRgb picture = read_linear_rgb(request.out / "transfer.png");
    EXPECT_GT(picture(80, 80)[1], 1.5f * picture(80, 80)[2]);  // green now
    // The file takes the photo's place and gives the same picture.
    TransferRequest again = request;
    again.source.clear();
    again.material = request.out / "material.json";
    again.out = folder_ / "again";
    run_transfer(again);
    EXPECT_EQ(hash_file(request.out / "transfer.png"), hash_file(again.out / "transfer.png"));
}

TEST_F(TransferRecipeTest, PaperMethodRunsAndSequencesDoNotFlicker) {
    write_material_json(folder_ / "material.json", medium(), 0);
    fs::create_directories(folder_ / "clip");
    write_photo("clip/a", Rgb(0.7f, 0.7f, 0.7f));
    write_photo("clip/b", Rgb(0.7f, 0.7f, 0.7f));
    TransferRequest request;
    request.material = folder_ / "material.json";
    request.target_frames = folder_ / "clip";
    request.out = folder_ / "out";
    EXPECT_EQ(run_transfer_sequence(request).frame_count, 2);
    EXPECT_EQ(hash_file(request.out / "frames" / "a.png"),
              hash_file(request.out / "frames" / "b.png"));
    set_paper_method(request);
    request.target = folder_ / "clip" / "a.png";
    request.target_options.mask = folder_ / "clip" / "a_mask.png";
    EXPECT_NO_THROW(run_transfer(request));
}

}  // namespace
}  // namespace vitrine
