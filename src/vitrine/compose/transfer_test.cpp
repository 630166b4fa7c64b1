#include "compose/transfer.h"

#include "estimate/translucent_world.h"
#include "image/colour.h"
#include "image/filter.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

/// An ellipsoid of apple flesh on grey, with a highlight, as an 8-bit picture would hold it.
Photo apple_photo(double px_per_mm) {
    const Relief relief = testing_world::ellipsoid(200, 85, 70);
    const ViewLights lights = testing_world::key_and_back(relief, 1.3);
    Photo photo;
    photo.name = "apple";
    photo.mask = relief.mask;
    photo.linear = TranslucentRelief(relief).render(irradiance_from_lights(relief, lights, 1.3),
                                                    testing_world::apple(px_per_mm));
    const Vec3 half = (lights.lights[0].direction + Vec3(0, 0, 1)).normalized();
    for (std::size_t i = 0; i < photo.linear.size(); ++i) {
        Rgb& pixel = photo.linear[i];
        if (relief.mask[i] <= 127) {
            pixel = Rgb(0.2f, 0.25f, 0.3f);
        } else {
            const double n_h = relief.normals[i].cast<double>().dot(half);
            pixel = pixel * 0.7f + static_cast<float>(std::pow(std::max(0.0, n_h), 300));
        }
    }
    photo.linear = srgb_to_linear(linear_to_srgb8(photo.linear));
    return photo;
}

class TransferTest : public ::testing::Test {
  protected:
    static void SetUpTestSuite() {
        photo_ = new Photo(apple_photo(4));
        object_ = new PhotoAnalysis(analyse_object(*photo_));
        lifted_ = new LiftedMaterial(lift_material(*photo_));
    }
    static void TearDownTestSuite() {
        delete photo_;
        delete object_;
        delete lifted_;
    }
    static Photo* photo_;
    static PhotoAnalysis* object_;
    static LiftedMaterial* lifted_;
};
Photo* TransferTest::photo_ = nullptr;
PhotoAnalysis* TransferTest::object_ = nullptr;
LiftedMaterial* TransferTest::lifted_ = nullptr;

TEST_F(TransferTest, MaterialReproducesItsOwnPhoto) {
    EXPECT_GT(lifted_->self_psnr_db, 28);
    EXPECT_GT(lifted_->self_psnr_db, lifted_->flat_psnr_db + 5);
}

TEST_F(TransferTest, NothingOutsideTheFeatheredMaskChanges) {
    const TransferSession session(*object_);
    const TransferPicture result = session.render(lifted_->medium.profile(), {});
    const ImageRgb8 before = linear_to_srgb8(photo_->linear);
    const ImageRgb8 after = linear_to_srgb8(result.picture);
    const Mask touched = dilate(photo_->mask, 5);
    for (std::size_t i = 0; i < touched.size(); ++i) {
        if (touched[i] <= 127) {
            EXPECT_TRUE((before[i] == after[i]).all());
        }
    }
}

TEST_F(TransferTest, HighlightStaysWhereItWas) {
    const TransferSession session(*object_);
    const TransferPicture result = session.render(lifted_->medium.profile(), {});
    ASSERT_FALSE(object_->highlights.blobs.empty());
    const Vec2 spot = object_->highlights.blobs[0].centroid_px;
    const Rgb pixel = result.picture(static_cast<int>(spot.x()), static_cast<int>(spot.y()));
    EXPECT_GT(pixel.minCoeff(), 0.8f);
}

TEST_F(TransferTest, ScalingKeepsTheMeanColourWhenAsked) {
    const TransferSession session(*object_);
    const RadialProfile profile = lifted_->medium.profile();
    TransferLook look;
    const auto mean = [](const ImageRgb& image) {
        Rgbd sum = Rgbd::Zero();
        for (const Rgb& pixel : image) sum += pixel.cast<double>();
        return sum;
    };
    const Rgbd plain = mean(session.render(profile, look).diffuse);
    look.scale = 2.5;
    const Rgbd kept = mean(session.render(profile, look).diffuse);
    EXPECT_LT((kept / plain - 1).abs().maxCoeff(), 1e-3);
    look.keep_colour = false;
    // Light leaves a closed body of longer paths after fewer scatterings, so less of it is
    // absorbed.
    EXPECT_GT(mean(session.render(profile, look).diffuse)[0], 1.01 * plain[0]);
}

TEST_F(TransferTest, ExposureActsOnDiffuseLightOnly) {
    const TransferSession session(*object_);
    TransferLook look;
    const ImageRgb one = session.render(lifted_->medium.profile(), look).diffuse;
    look.exposure = 2;
    const ImageRgb two = session.render(lifted_->medium.profile(), look).diffuse;
    EXPECT_NEAR(two(100, 100)[1] / one(100, 100)[1], 2, 1e-4);
}

TEST_F(TransferTest, WhatIsKeptEqualsWhatIsRenderedAfresh) {
    TransferSession session(*object_);
    const RadialProfile profile = lifted_->medium.profile();
    ViewLights turned = object_->lights.lights;
    for (ViewLight& light : turned.lights) light.direction.x() *= -1;
    for (const double scale : {1.0, 1.5, 1.0}) {
        TransferLook look;
        look.scale = scale;
        const ImageRgb kept = session.render(profile, look).diffuse;
        const ImageRgb fresh = TransferSession(*object_).render(profile, look).diffuse;
        EXPECT_TRUE((kept(100, 100) == fresh(100, 100)).all()) << scale;
    }
    const Rgb before = session.render(profile, {}).diffuse(100, 100);
    session.set_lights(turned);
    EXPECT_FALSE((session.render(profile, {}).diffuse(100, 100) == before).all());
}

TEST_F(TransferTest, LengthsCarryOver) {
    EXPECT_DOUBLE_EQ(length_ratio(50, 100, 0, 0), 2);
    EXPECT_DOUBLE_EQ(length_ratio(50, 100, 1000, 700), 0.7);
}

}  // namespace
}  // namespace vitrine
