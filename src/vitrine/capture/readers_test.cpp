#include "base/file.h"
#include "capture/capture_listing.h"
#include "capture/check.h"
#include "capture/colmap_model.h"
#include "capture/made_capture.h"
#include "image/image_io.h"

#include <gtest/gtest.h>

#include <cstring>

namespace vitrine {
namespace {

namespace fs = std::filesystem;

/// The same made world as every layout writes it; what is read back must be that world.
class Readers : public testing::Test {
  protected:
    ScratchFolder folder_{"readers"};
    MadeCapture made_;

    void expect_the_made_world(const std::string& format, double pose_tolerance_m = 1e-5) {
        const Capture capture = read_capture(folder_);
        EXPECT_EQ(find_capture_reader(folder_).name, format);
        ASSERT_EQ(capture.frames.size(), 8u);
        ASSERT_TRUE(capture.has_poses);
        // Up to one rigid motion: some layouts turn the world.
        const Rigid3 made_from_ours =
            made_.camera(0).cam_from_world.inverse() * capture.frames[0].camera.cam_from_world;
        for (int i = 0; i < made_.frames; ++i) {
            const RgbdFrame& frame = capture.frames[static_cast<std::size_t>(i)];
            const Camera truth = made_.camera(i);
            EXPECT_NEAR(frame.camera.fx, truth.fx, 1e-9);
            EXPECT_NEAR(frame.camera.cx, truth.cx, 1e-9);
            const Vec3 centre = made_from_ours * frame.camera.centre_in_world();
            EXPECT_LT((centre - truth.centre_in_world()).norm(), pose_tolerance_m) << frame.id;
            const Vec3 axis = made_from_ours.rotation * frame.camera.ray_in_world(5, 9);
            EXPECT_LT((axis - truth.ray_in_world(5, 9)).norm(), 1e-5) << frame.id;
            EXPECT_NEAR(frame.depth_m(20, 55), look_at_made_world(truth, 20, 55).depth_m, 2e-3);
            EXPECT_NEAR(frame.colour(20, 55)[1], look_at_made_world(truth, 20, 55).brightness,
                        0.01);
        }
        EXPECT_GT(depth_consistency(capture, 1.0), 0.9);
    }
    std::string error() const { return capture_error(folder_); }
    void expect_error(const std::string& words) const {
        EXPECT_NE(error().find(words), std::string::npos) << error();
    }
    void replace(const fs::path& file, const std::string& old_text, const std::string& new_text) {
        std::string text = read_text_file(folder_ / file);
        const std::size_t at = text.find(old_text);
        ASSERT_NE(at, std::string::npos) << old_text;
        write_text_file(folder_ / file, text.replace(at, old_text.size(), new_text));
    }
};

// Redwood / Open3D.

class Redwood : public Readers {
  protected:
    void SetUp() override {
        made_.write_pictures(folder_ / "color", folder_ / "depth", 1000);
        std::string log;
        for (int i = 0; i < made_.frames; ++i) {
            const Mat4 m = made_.camera(i).cam_from_world.inverse().matrix();
            log += fmt::format("{} {} {}\n", i, i, i + 1);
            for (int r = 0; r < 4; ++r) {
                log += fmt::format("{} {} {} {}\n", m(r, 0), m(r, 1), m(r, 2), m(r, 3));
            }
        }
        write_text_file(folder_ / "trajectory.log", log);
        write_text_file(folder_ / "camera_intrinsic.json",
                        R"({"width": 96, "height": 64,
                            "intrinsic_matrix": [80, 0, 0, 0, 80, 0, 47.5, 31.5, 1]})");
    }
};

TEST_F(Redwood, IsRead) { expect_the_made_world("Redwood/Open3D"); }

TEST_F(Redwood, FaultsAreNamed) {
    replace("trajectory.log", "0 0 1", "0 0");
    expect_error("blocks of three indices and a 4 x 4 matrix");
    fs::remove(folder_ / "trajectory.log");
    EXPECT_FALSE(read_capture(folder_).has_poses);
    for (const int i : {2, 5, 6}) fs::remove(folder_ / "depth" / (made_frame_name(i) + ".png"));
    expect_error("5 of 8");
}

TEST_F(Redwood, WithoutIntrinsicsItsOwnCameraIsTaken) {
    fs::remove(folder_ / "camera_intrinsic.json");
    expect_error("640 x 480");
}

// nerfstudio.

class Nerfstudio : public Readers {
  protected:
    void SetUp() override {
        made_.write_pictures(folder_ / "images", folder_ / "depths", 1000);
        // Their pixel centres lie at +0.5.
        std::string text =
            R"({"camera_model": "OPENCV", "fl_x": 80, "fl_y": 80, "cx": 48, "cy": 32,
                "w": 96, "h": 64, "k1": 0, "ply_file_path": "sparse.ply", "frames": [)";
        for (int i = 0; i < made_.frames; ++i) {
            text += fmt::format(
                "{}{{\"file_path\": \"./images/{}.png\", \"depth_file_path\": \"depths/{}.png\", "
                "\"transform_matrix\": {}}}",
                i ? ",\n" : "", made_frame_name(i), made_frame_name(i), made_.gl_rows(i));
        }
        write_text_file(folder_ / "transforms.json", text + "]}");
    }
};

TEST_F(Nerfstudio, IsRead) { expect_the_made_world("nerfstudio"); }

TEST_F(Nerfstudio, FaultsAreNamed) {
    replace("transforms.json", "./images/000002.png", "../images/000002.png");
    expect_error("a path within the folder");
    replace("transforms.json", "../images/000002.png", "./images/000002.png");
    replace("transforms.json", "\"fl_x\": 80", "\"fl_x\": -80");
    expect_error("focal lengths > 0");
    replace("transforms.json", "\"fl_x\": -80", "\"fl_x\": 80");
    replace("transforms.json", "\"w\": 96", "\"w\": 9600000");
    expect_error("\"w\"");
    replace("transforms.json", "\"w\": 9600000", "\"w\": 96");
    replace("transforms.json", "OPENCV", "OPENCV_FISHEYE");
    expect_error("Undistort the pictures first");
    replace("transforms.json", "OPENCV_FISHEYE", "OPENCV");
    replace("transforms.json", "\"transform_matrix\": [[", "\"transform_matrix\": [[3");
    expect_error("transform_matrix of 000000");
    const std::string text = read_text_file(folder_ / "transforms.json");
    write_text_file(folder_ / "transforms.json", text.substr(0, text.size() / 2));
    expect_error("transforms.json:");
}

TEST_F(Nerfstudio, ColourAloneIsRefused) {
    std::string text = read_text_file(folder_ / "transforms.json");
    for (std::size_t at; (at = text.find("depth_file_path")) != std::string::npos;) {
        text.replace(at, 15, "mask_path");
    }
    write_text_file(folder_ / "transforms.json", text);
    expect_error("0 of 8");
}

// Polycam raw: depth of half the size.

class Polycam : public Readers {
  protected:
    void SetUp() override {
        const fs::path root = folder_ / "keyframes";
        made_.write_pictures(root / "images", folder_ / "unused", 1000);
        for (int i = 0; i < made_.frames; ++i) {
            const Camera camera = made_.camera(i);
            Image<std::uint16_t> depth(made_.width / 2, made_.height / 2);
            for (int v = 0; v < depth.height(); ++v) {
                for (int u = 0; u < depth.width(); ++u) {
                    depth(u, v) = static_cast<std::uint16_t>(std::lround(
                        1000 * look_at_made_world(camera, 2 * u + 0.5, 2 * v + 0.5).depth_m));
                }
            }
            const std::string name = made_frame_name(i);
            write_png16(root / "depth" / (name + ".png"), depth);
            // ARKit: camera as in OpenGL, world y up: our (x, y, z) is their (y, z, x).
            Mat4 m = camera.cam_from_world.inverse().matrix();
            m.col(1) *= -1;
            m.col(2) *= -1;
            std::string text = R"({"fx": 80, "fy": 80, "cx": 47.5, "cy": 31.5, "width": 96,
                                   "height": 64, "blur_score": 100, "timestamp": 1)";
            for (int r = 0; r < 3; ++r) {
                for (int c = 0; c < 4; ++c) {
                    text += fmt::format(", \"t_{}{}\": {}", r, c, m((r + 1) % 3, c));
                }
            }
            write_text_file(root / "cameras" / (name + ".json"), text + "}");
        }
    }
};

TEST_F(Polycam, IsReadWithItsCoarserDepth) {
    expect_the_made_world("Polycam raw");
    const Capture capture = read_capture(folder_);
    EXPECT_LT(
        (capture.frames[2].camera.centre_in_world() - made_.camera(2).centre_in_world()).norm(),
        1e-6);
}

TEST_F(Polycam, FaultsAreNamed) {
    replace("keyframes/cameras/000001.json", "\"t_11\"", "\"t_99\"");
    expect_error("t_11");
    for (int i = 0; i < 4; ++i)
        fs::remove(folder_ / "keyframes/depth" / (made_frame_name(i) + ".png"));
    expect_error("4 of 8");
}

// COLMAP, text and binary; its unit is not the metre.

constexpr double kUnit_m = 0.37;

class Colmap : public Readers {
  protected:
    std::vector<Vec3> points_;  ///< on the world's surfaces, metres

    void SetUp() override {
        made_.write_pictures(folder_ / "images", folder_ / "depth", 1000);
        for (int v = 4; v < 60; v += 5) {
            for (int u = 5; u < 90; u += 7) {
                points_.push_back(made_.camera(0).unproject(
                    u, v, look_at_made_world(made_.camera(0), u, v).depth_m));
            }
        }
    }
    void write_text(const std::string& model = "PINHOLE 96 64 80 80 48 32") {
        const fs::path sparse = folder_ / "sparse/0";
        write_text_file(sparse / "cameras.txt", "# comment\n1 " + model + "\n");
        std::string images = "# two lines each\n", points;
        for (int i = 0; i < made_.frames; ++i) {
            const Rigid3 pose = made_.camera(i).cam_from_world;
            const Eigen::Quaterniond q = pose.quaternion();
            const Vec3 t = pose.translation / kUnit_m;
            images += fmt::format("{} {} {} {} {} {} {} {} 1 {}.png\n", i + 1, q.w(), q.x(), q.y(),
                                  q.z(), t.x(), t.y(), t.z(), made_frame_name(i));
            if (i == 0) {
                for (std::size_t k = 0; k < points_.size(); ++k)
                    images += fmt::format("1 1 {} ", k);
                images += "2 2 -1";
            }
            images += "\n";
        }
        for (std::size_t k = 0; k < points_.size(); ++k) {
            const Vec3 p = points_[k] / kUnit_m;
            points += fmt::format("{} {} {} {} 9 9 9 0.5 1 0\n", k, p.x(), p.y(), p.z());
        }
        write_text_file(sparse / "images.txt", images);
        write_text_file(sparse / "points3D.txt", points);
    }
    template <typename T>
    static void put(std::string& bytes, T value) {
        char raw[sizeof(T)];
        std::memcpy(raw, &value, sizeof(T));
        bytes.append(raw, sizeof(T));
    }
    void write_binary() {
        const fs::path sparse = folder_ / "sparse/0";
        std::string cameras, images, points;
        put(cameras, std::uint64_t(1));
        put(cameras, std::uint32_t(1));
        put(cameras, std::int32_t(1));
        put(cameras, std::uint64_t(96));
        put(cameras, std::uint64_t(64));
        for (const double v : {80.0, 80.0, 48.0, 32.0}) put(cameras, v);
        put(images, std::uint64_t(made_.frames));
        for (int i = 0; i < made_.frames; ++i) {
            const Rigid3 pose = made_.camera(i).cam_from_world;
            const Eigen::Quaterniond q = pose.quaternion();
            put(images, std::uint32_t(i + 1));
            for (const double v : {q.w(), q.x(), q.y(), q.z()}) put(images, v);
            for (int k = 0; k < 3; ++k) put(images, pose.translation[k] / kUnit_m);
            put(images, std::uint32_t(1));
            images += made_frame_name(i) + ".png";
            images += '\0';
            put(images, std::uint64_t(i == 0 ? points_.size() : 0));
            for (std::size_t k = 0; i == 0 && k < points_.size(); ++k) {
                put(images, 1.0);
                put(images, 1.0);
                put(images, std::int64_t(k));
            }
        }
        put(points, std::uint64_t(points_.size()));
        for (std::size_t k = 0; k < points_.size(); ++k) {
            put(points, std::uint64_t(k));
            for (int c = 0; c < 3; ++c) put(points, points_[k][c] / kUnit_m);
            points += "abc";
            put(points, 0.5);
            put(points, std::uint64_t(1));
            put(points, std::uint64_t(0));
        }
        write_text_file(sparse / "cameras.bin", cameras);
        write_text_file(sparse / "images.bin", images);
        write_text_file(sparse / "points3D.bin", points);
    }
};

TEST_F(Colmap, TextIsReadAndItsUnitFound) {
    write_text();
    expect_the_made_world("COLMAP", 1e-3);  // the unit comes from depth in millimetres
    const std::string said = read_capture(folder_).warnings.at(0);
    EXPECT_NE(said.find("the model's unit is 0.37"), std::string::npos) << said;
}

TEST_F(Colmap, BinaryIsReadAndAGivenUnitTaken) {
    write_binary();
    write_text_file(folder_ / "capture.json", "{\"metres_per_unit\": 0.37}");
    expect_the_made_world("COLMAP");
}

TEST_F(Colmap, WithoutPointsTheUnitIsAskedFor) {
    points_.clear();
    write_text();
    expect_error("metres_per_unit");
}

TEST_F(Colmap, FaultsAreNamed) {
    write_text("OPENCV_FISHEYE 96 64 80 80 48 32 0 0 0 0");
    expect_error("a camera model out of SIMPLE_PINHOLE");
    write_text("PINHOLE 96 64 80 nan 48 32");
    expect_error("cameras.txt:2: expected a finite number");
    write_text("PINHOLE 96 64 80");
    expect_error("the end of the line");
    write_text("PINHOLE 99999999 64 80 80 48 32");
    expect_error("65536 pixels");
    write_text("PINHOLE 96 64 80 80 48 32");
    replace("sparse/0/images.txt", " 1 000003.png", " 7 000003.png");
    expect_error("camera 7");
}

TEST_F(Colmap, CutOffOrLyingBinariesAreRefused) {
    write_binary();
    const fs::path sparse = folder_ / "sparse/0";
    for (const char* file : {"images.bin", "points3D.bin", "cameras.bin"}) {
        const std::string whole = read_text_file(sparse / file);
        for (const double share : {0.9, 0.5, 0.1}) {
            write_text_file(
                sparse / file,
                whole.substr(0, static_cast<std::size_t>(share * double(whole.size()))));
            expect_error("cut off");
        }
        std::string lying = whole;
        for (std::size_t i = 0; i < 8; ++i) lying[i] = '\xff';
        write_text_file(sparse / file, lying);
        expect_error("records");
        write_text_file(sparse / file, whole);
    }
}

TEST(CaptureReaders, AFolderOfNothingKnownNamesThemAll) {
    const ScratchFolder folder("no_reader");
    write_text_file(folder / "notes.txt", "hello");
    const std::string text = capture_error(folder);
    for (const CaptureReader& reader : capture_readers()) {
        EXPECT_NE(text.find(reader.name), std::string::npos) << text;
    }
}

TEST(CaptureReaders, LongRecordingsAreThinnedToFitMemory) {
    const ScratchFolder folder("long");
    MadeCapture made;
    made.frames = 12;
    made.write_tum(folder);
    const Capture capture = read_capture(folder, {.max_bytes = 5 * 96 * 64 * 16}, {});
    ASSERT_EQ(capture.frames.size(), 4u);
    EXPECT_EQ(capture.frames[1].id, "000003");
    EXPECT_NE(capture.warnings.at(0).find("4 of 12 frames are used"), std::string::npos);
}

}  // namespace
}  // namespace vitrine
