#include "image/image_io.h"

#include "base/file.h"
#include "base/scratch_folder.h"

#include <gtest/gtest.h>

#include <fstream>

namespace vitrine {
namespace {

namespace fs = std::filesystem;

class ImageIo : public testing::Test {
  protected:
    ScratchFolder folder_{"image_io"};
};

TEST_F(ImageIo, Png8And16RoundTrip) {
    ImageRgb8 colour(5, 3);
    Image<std::uint16_t> depth(5, 3);
    for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 5; ++x) {
            colour(x, y) = Rgb8(std::uint8_t(10 * x), std::uint8_t(20 * y), 200);
            depth(x, y) = static_cast<std::uint16_t>(1000 * x + 300 * y);
        }
    }
    write_png(folder_ / "c.png", colour);
    write_png16(folder_ / "d.png", depth);
    const RasterImage back = read_png(folder_ / "c.png");
    EXPECT_EQ(back.channels, 3);
    EXPECT_EQ(back.codes[(1 * 5 + 2) * 3 + 1], 20);
    const Image<std::uint16_t> depth_back = read_png16(folder_ / "d.png");
    EXPECT_TRUE(std::equal(depth.begin(), depth.end(), depth_back.begin()));
}

TEST_F(ImageIo, ExrLayersRoundTrip) {
    ImageRgb colour(4, 3, Rgb(0.5f, 2.0f, -0.25f));
    ExrImage exr;
    add_rgb(exr, "", colour);
    add_rgb(exr, "delta", colour);
    exr.channels["Z"] = ImageF(4, 3, 1.2345678f);
    exr.attributes["software"] = "vitrine";
    write_exr(folder_ / "a.exr", exr);
    const ExrImage back = read_exr(folder_ / "a.exr");
    EXPECT_EQ(back.channels.size(), 7u);
    EXPECT_EQ(back.channels.at("Z")(2, 1), 1.2345678f);
    EXPECT_EQ(back.channels.at("delta.B")(0, 0), -0.25f);
    EXPECT_EQ(back.attributes.at("software"), "vitrine");
    EXPECT_TRUE((read_linear_rgb(folder_ / "a.exr")(1, 1) == Rgb(0.5f, 2.0f, -0.25f)).all());
}

TEST_F(ImageIo, DamagedFilesAreRefused) {
    Image<std::uint16_t> depth(64, 64, 777);
    for (std::size_t i = 0; i < depth.size(); ++i) depth[i] = std::uint16_t(i * 2654435761u >> 8);
    write_png16(folder_ / "d.png", depth);
    fs::resize_file(folder_ / "d.png", fs::file_size(folder_ / "d.png") / 2);
    EXPECT_THROW(read_png16(folder_ / "d.png"), InputError);
    write_exr(folder_ / "a.exr", ImageRgb(64, 64, Rgb(1, 2, 3)));
    fs::resize_file(folder_ / "a.exr", fs::file_size(folder_ / "a.exr") / 2);
    EXPECT_THROW(read_exr(folder_ / "a.exr"), InputError);
    EXPECT_THROW(read_png(folder_ / "missing.png"), InputError);
    std::ofstream(folder_ / "x.jpg") << "not a picture";
    EXPECT_THROW(read_raster(folder_ / "x.jpg"), InputError);
}

TEST_F(ImageIo, HugeHeaderIsRefusedBeforeAllocation) {
    write_png(folder_ / "m.png", Mask(8, 8, 255));
    std::string bytes = read_text_file(folder_ / "m.png");
    // IHDR width and height at bytes 16 to 23, CRC of the chunk at 29 to 32.
    const auto put = [&](std::size_t at, std::uint32_t v) {
        for (int i = 0; i < 4; ++i) bytes[at + i] = static_cast<char>(v >> (24 - 8 * i));
    };
    put(16, 60000);
    put(20, 60000);
    std::uint32_t crc = 0xffffffffu;
    for (std::size_t i = 12; i < 29; ++i) {
        crc ^= static_cast<unsigned char>(bytes[i]);
        for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ (0xedb88320u & (0u - (crc & 1u)));
    }
    put(29, ~crc);
    write_text_file(folder_ / "huge.png", bytes);
    try {
        read_png(folder_ / "huge.png");
        FAIL();
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("60000 x 60000"), std::string::npos)
            << error.what();
    }
}

}  // namespace
}  // namespace vitrine
