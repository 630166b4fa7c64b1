// COLMAP: a sparse model (world to camera, in a unit of its own), images/, and a folder of depth
// pictures named after them.
#include "capture/capture_listing.h"
#include "capture/colmap_model.h"

namespace vitrine {
namespace fs = std::filesystem;
namespace {

fs::path model_folder(const fs::path& folder) {
    for (const char* name : {"sparse/0", "sparse"}) {
        for (const char* file : {"cameras.bin", "cameras.txt"}) {
            if (fs::exists(folder / name / file)) return folder / name;
        }
    }
    return {};
}

fs::path depth_folder(const fs::path& folder) {
    for (const char* name : {"depth", "depths", "depth_maps"}) {
        if (fs::is_directory(folder / name)) return folder / name;
    }
    throw InputError({folder.string(), "a folder depth/ with 16-bit PNGs named as the pictures",
                      "none", "Vitrine measures glass against depth: colour alone will not do."});
}

std::vector<Vec3> points_of(const ColmapImage& image, const ColmapModel& model) {
    std::vector<Vec3> points;
    for (const std::uint64_t id : image.point_ids) {
        const auto found = model.points.find(id);
        if (found == model.points.end()) continue;
        const Vec3 p = image.cam_from_world * found->second;
        if (p.z() > 0) points.push_back(p);
    }
    return points;
}

}  // namespace

bool is_colmap(const fs::path& folder) { return !model_folder(folder).empty(); }

CaptureListing list_colmap(const fs::path& folder) {
    CaptureListing listing = start_listing(folder, 1000.0);
    listing.metres_per_unit = listing.config.metres_per_unit;
    listing.allows_scaled_depth = true;
    const ColmapModel model = read_colmap_model(model_folder(folder));
    listing.metadata.insert(listing.metadata.end(), model.files.begin(), model.files.end());
    const fs::path depth = depth_folder(folder);
    if (model.images.empty()) {
        throw InputError({model_folder(folder).string(), "at least one image", "none", ""});
    }
    for (const ColmapImage& image : model.images) {
        ListedFrame frame;
        frame.colour_file =
            path_inside(folder / "images", image.name, model_folder(folder).string());
        const fs::path name = fs::path(image.name).lexically_normal();
        frame.id = name.stem().string();
        frame.depth_file = picture_of_stem((depth / name).parent_path(), frame.id);
        if (frame.depth_file.empty()) {  // some tools append instead of replacing
            frame.depth_file = picture_of_stem((depth / name).parent_path(), name.filename());
        }
        if (frame.depth_file.empty()) continue;
        frame.timestamp_s = static_cast<double>(listing.frames.size());
        frame.intrinsic = model.cameras.at(image.camera_id);
        frame.cam_from_world = image.cam_from_world;
        frame.points = points_of(image, model);
        listing.frames.push_back(std::move(frame));
    }
    require_most(listing.frames.size(), model.images.size(), depth.string(),
                 "a depth picture for at least 80 % of the images",
                 "They are named as the pictures, with the ending .png.");
    if (listing.frames.size() < model.images.size()) {
        listing.warnings.push_back(
            fmt::format("{} of {} images have no depth picture and are left out",
                        model.images.size() - listing.frames.size(), model.images.size()));
    }
    listing.has_poses = listing.config.poses != PoseSource::None;
    return listing;
}

}  // namespace vitrine
