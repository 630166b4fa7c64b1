#include "capture/photo.h"

#include "base/scratch_folder.h"
#include "image/colour.h"
#include "image/filter.h"
#include "image/image_io.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace vitrine {
namespace {

class PhotoTest : public ::testing::Test {
  protected:
    ScratchFolder folder_{"photo"};

    /// A red disc with a soft shade on blue.
    static ImageRgb disc_picture(int size, double radius) {
        ImageRgb image(size, size);
        for (int y = 0; y < size; ++y) {
            for (int x = 0; x < size; ++x) {
                const double r = std::hypot(x - size / 2, y - size / 2) / radius;
                image(x, y) = r < 1 ? Rgb(0.7f - 0.3f * static_cast<float>(r), 0.1f, 0.08f)
                                    : Rgb(0.05f, 0.1f, 0.3f);
            }
        }
        return image;
    }
    static Mask disc_mask(int size, double radius) {
        Mask mask(size, size);
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x)
                if (std::hypot(x - size / 2, y - size / 2) < radius) mask(x, y) = 255;
        return mask;
    }
    std::string message(const Mask& mask) {
        write_png(folder_ / "photo.png", linear_to_srgb8(disc_picture(200, 60)));
        write_png(folder_ / "mask.png", mask);
        try {
            PhotoOptions options;
            options.mask = folder_ / "mask.png";
            read_photo(folder_ / "photo.png", options);
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    }
};

TEST_F(PhotoTest, ReadsPhotoAndMask) {
    EXPECT_EQ(message(disc_mask(200, 60)), "");
    PhotoOptions options;
    options.mask = folder_ / "mask.png";
    const Photo photo = read_photo(folder_ / "photo.png", options);
    EXPECT_NEAR(photo.linear(100, 100)[0], 0.7, 0.01);
    EXPECT_NEAR(inradius_px(photo.mask), 60, 1);
    EXPECT_TRUE(photo.warnings.empty());
}

TEST_F(PhotoTest, SaysWhatIsWrongWithAMask) {
    EXPECT_NE(message(Mask(200, 200)).find("empty"), std::string::npos);
    EXPECT_NE(message(Mask(200, 200, 255)).find("full"), std::string::npos);
    EXPECT_NE(message(Mask(100, 200, 255)).find("100 x 200"), std::string::npos);
    EXPECT_NE(message(disc_mask(200, 12)).find("pixels"), std::string::npos);
}

TEST_F(PhotoTest, NeedsAMaskOrABox) {
    write_png(folder_ / "photo.png", linear_to_srgb8(disc_picture(200, 60)));
    EXPECT_THROW(read_photo(folder_ / "photo.png"), InputError);
    EXPECT_THROW(read_photo(folder_ / "missing.png"), InputError);
}

TEST_F(PhotoTest, GrabCutFindsTheDisc) {
    const ImageRgb picture = disc_picture(240, 70);
    const Mask found = segment_box(picture, {40, 40, 200, 200}, "disc");
    EXPECT_GT(intersection_over_union(found, disc_mask(240, 70)), 0.96);
    EXPECT_THROW(segment_box(picture, {200, 200, 300, 300}, "disc"), InputError);
}

TEST_F(PhotoTest, LargestPieceIsKeptAndFilled) {
    Mask mask = disc_mask(100, 30);
    mask(50, 50) = 0;
    mask(2, 2) = 255;
    const Mask clean = largest_piece_filled(mask);
    EXPECT_TRUE(is_inside(clean, 50, 50));
    EXPECT_FALSE(is_inside(clean, 2, 2));
}

TEST_F(PhotoTest, WarnsAboutClippingBlackChannelsAndCutObjects) {
    ImageRgb picture(200, 200, Rgb(2.0f, 2.0f, 2.0f));
    write_png(folder_ / "white.png", linear_to_srgb8(picture));
    write_png(folder_ / "mask.png", disc_mask(200, 60));
    PhotoOptions options;
    options.mask = folder_ / "mask.png";
    EXPECT_NE(read_photo(folder_ / "white.png", options).warnings.front().find("over-exposed"),
              std::string::npos);
    picture = ImageRgb(200, 200, Rgb(0.5f, 0.4f, 0.0f));
    write_png(folder_ / "yellow.png", linear_to_srgb8(picture));
    write_png(folder_ / "mask.png", disc_mask(200, 101));
    const std::vector<std::string> warnings = read_photo(folder_ / "yellow.png", options).warnings;
    ASSERT_EQ(warnings.size(), 2u);
    EXPECT_NE(warnings[0].find("blue"), std::string::npos);
    EXPECT_NE(warnings[1].find("edge"), std::string::npos);
}

}  // namespace
}  // namespace vitrine
