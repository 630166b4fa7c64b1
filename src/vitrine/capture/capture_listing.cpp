#include "capture/capture_listing.h"

#include "base/text.h"

#include <algorithm>
#include <array>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

constexpr double kMinPairedShare = 0.8;  // interfaces.md 8

constexpr std::array<CaptureReader, 5> kReaders = {{
    {"TUM RGB-D", "rgb.txt and depth.txt", is_tum, list_tum},
    {"nerfstudio", "transforms.json", is_nerfstudio, list_nerfstudio},
    {"Polycam raw", "keyframes/", is_polycam, list_polycam},
    {"COLMAP", "sparse/ with images/ and depth/", is_colmap, list_colmap},
    {"Redwood/Open3D", "color/ or image/ with depth/", is_redwood, list_redwood},
}};

bool is_picture(const fs::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension == ".png" || extension == ".jpg" || extension == ".jpeg" ||
           extension == ".exr";
}

}  // namespace

std::span<const CaptureReader> capture_readers() { return kReaders; }

const CaptureReader& find_capture_reader(const fs::path& folder) {
    if (!fs::is_directory(folder)) {
        throw InputError({folder.string(), "a capture folder", "no such folder", ""});
    }
    std::vector<std::string> layouts;
    for (const CaptureReader& reader : kReaders) {
        if (reader.recognises(folder)) return reader;
        layouts.push_back(fmt::format("{} ({})", reader.name, reader.layout));
    }
    throw InputError(
        {folder.string(), "one of these layouts: " + join(layouts, ", "),
         fs::is_empty(folder) ? "an empty folder" : "no rgb.txt and none of the others",
         "docs/reconstruction.md describes each."});
}

CaptureListing start_listing(const fs::path& folder, double default_depth_scale) {
    CaptureListing listing;
    if (fs::exists(folder / "capture.json")) {
        listing.config = read_capture_config(folder / "capture.json");
        listing.metadata.push_back(folder / "capture.json");
    }
    listing.depth_scale = listing.config.depth_scale.value_or(default_depth_scale);
    const fs::path own = folder / "depth_camera_intrinsic.json";
    if (fs::exists(own)) {
        if (!listing.config.colour_from_depth) {
            throw InputError({(folder / "capture.json").string(),
                              "\"colour_from_depth\" (4 x 4, row-major, metres)", "no such key",
                              "depth_camera_intrinsic.json says that depth has a camera of its "
                              "own: where it stands is needed too."});
        }
        listing.depth_camera = {read_camera_intrinsic(own), *listing.config.colour_from_depth};
        listing.metadata.push_back(own);
    } else if (listing.config.colour_from_depth) {
        throw InputError({own.string(), "the intrinsics of the depth camera", "no such file",
                          "\"colour_from_depth\" in capture.json says that depth has a camera of "
                          "its own."});
    }
    return listing;
}

fs::path path_inside(const fs::path& folder, const std::string& name, const std::string& where) {
    const fs::path relative = fs::path(name).lexically_normal();
    if (relative.is_absolute() || relative.empty() || *relative.begin() == "..") {
        throw InputError({where, "a path within the folder", "\"" + name + "\"", ""});
    }
    return folder / relative;
}

void require_most(std::size_t having, std::size_t all, const std::string& where,
                  const std::string& expected, const std::string& hint) {
    if (static_cast<double>(having) < kMinPairedShare * static_cast<double>(all)) {
        throw InputError({where, expected, fmt::format("{} of {}", having, all), hint});
    }
}

Rigid3 cam_from_world_of_gl(const Mat4& world_from_gl, const std::string& where) {
    Mat3 rotation = world_from_gl.topLeftCorner<3, 3>();
    if (!world_from_gl.allFinite() || !is_rotation(rotation, 1e-3)) {
        throw InputError({where, "a pose (a rotation and a translation)",
                          "scale, shear, mirroring or no number", ""});
    }
    rotation.col(1) *= -1;
    rotation.col(2) *= -1;
    return Rigid3::from_quaternion(Eigen::Quaterniond(rotation),
                                   world_from_gl.topRightCorner<3, 1>())
        .inverse();
}

std::vector<fs::path> pictures_in(const fs::path& folder) {
    std::vector<fs::path> files;
    if (!fs::is_directory(folder)) return files;
    for (const auto& entry : fs::directory_iterator(folder)) {
        if (entry.is_regular_file() && is_picture(entry.path())) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

fs::path picture_of_stem(const fs::path& folder, const std::string& stem) {
    for (const char* extension : {".png", ".PNG", ".jpg", ".jpeg", ".JPG", ".exr"}) {
        const fs::path path = folder / (stem + extension);
        if (fs::exists(path)) return path;
    }
    return {};
}

}  // namespace vitrine
