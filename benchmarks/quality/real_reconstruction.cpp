// vitrine_real_reconstruction [--out DIR] [--only shelf|kinect|d435|single]
//
// Prints what reconstruction makes of pictures of real sensors, found through VITRINE_REAL_DATA:
// how far the views agree, what is called a candidate, how outlines of glass compare with the masks
// that come with the pictures. With --out the captures (TUM layout) and outlines are kept.
#include "base/log.h"
#include "capture/check.h"
#include "capture/read_capture.h"
#include "geometry/mesh_io.h"
#include "image/colour.h"
#include "image/filter.h"
#include "image/image_io.h"
#include "math/statistics.h"
#include "process_cost.h"
#include "reconstruct/candidates.h"
#include "reconstruct/pose_refinement.h"
#include "reconstruct/real_captures.h"

#include <cstdio>
#include <functional>

namespace fs = std::filesystem;

namespace vitrine {
namespace {

/// Depth of one view against the depth of another where they see the same surface (within 5 cm).
void print_reprojection(const char* what, const Capture& capture,
                        const std::vector<Camera>& cameras) {
    std::vector<double> errors;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        for (std::size_t j = 0; j < cameras.size(); ++j) {
            if (i == j) continue;
            const ImageF &from = capture.frames[i].depth_m, &to = capture.frames[j].depth_m;
            for (int y = 3; y < from.height(); y += 9) {
                for (int x = 3; x < from.width(); x += 9) {
                    if (from(x, y) <= 0) continue;
                    const Vec3 p = cameras[i].unproject(x, y, from(x, y));
                    const double z = cameras[j].depth(p);
                    const Vec2 q = cameras[j].project(p);
                    if (z <= 0 || !cameras[j].sees(q)) continue;
                    const double there = to(int(std::lround(q.x())), int(std::lround(q.y())));
                    if (there > 0 && std::abs(there - z) < 0.05) {
                        errors.push_back(1e3 * std::abs(there - z));
                    }
                }
            }
        }
    }
    std::printf("  depth between views, %s: median %.1f mm, 90 %% within %.1f mm (%zu)\n", what,
                median(errors), quantile(errors, 0.9), errors.size());
}

void print_verdicts(const Capture& capture) {
    for (const Verdict& verdict : check_capture(capture)) {
        if (verdict.severity != Severity::Good)
            std::printf("  check: %s\n", verdict.sentence.c_str());
    }
}

void save_overlay(const fs::path& path, const ImageRgb& colour, const std::vector<Mask>& masks) {
    ImageRgb8 picture = linear_to_srgb8(colour);
    for (const Mask& mask : masks) {
        const Mask inner = erode(mask, 2);
        for (std::size_t i = 0; i < picture.size(); ++i) {
            if (mask[i] > 127 && inner[i] < 128) picture[i] = Rgb8(255, 0, 0);
        }
    }
    write_png(path, picture);
}

void run_shelf(const fs::path& from, const fs::path& out) {
    convert_shelf(from, out / "shelf");
    const Capture capture = read_capture(out / "shelf");
    std::printf("shelf, 15 views (RealSense F200)\n");
    print_verdicts(capture);
    print_reprojection("poses as given", capture, cameras_of(capture));
    const CpuTimer timer;
    const Scan scan = make_scan(capture);
    const double scanned = timer.seconds();
    print_reprojection("refined", capture, scan.cameras);
    std::printf(
        "  fused: %zu vertices, residual of depth to the surface %.1f mm; scan %.0f CPU s\n",
        scan.mesh.vertices.size(), 1e3 * scan.depth_residual_m, scanned);
    for (const std::string& note : scan.notes) std::printf("  %s\n", note.c_str());
    const Vec3& n = scan.support_plane.normal;
    std::printf("  support plane: normal (%.3f, %.3f, %.3f), offset %.3f m\n", n.x(), n.y(), n.z(),
                scan.support_plane.offset_m);
    const Candidates candidates = find_candidates(capture, scan);
    for (const Candidate& c : candidates.objects) {
        const Vec3 size = c.box.size(), centre = c.box.centre();
        std::printf("  %s: %.0f x %.0f x %.0f mm at (%.2f, %.2f, %.2f): %s\n", c.id.c_str(),
                    1e3 * size.x(), 1e3 * size.y(), 1e3 * size.z(), centre.x(), centre.y(),
                    centre.z(), c.evidence.c_str());
    }
    for (const std::string& note : candidates.notes) std::printf("  %s\n", note.c_str());
    std::printf("  candidates %.0f CPU s\n", timer.seconds() - scanned);
    write_ply(out / "shelf.ply", scan.mesh);
    std::vector<Mask> masks;
    for (const Candidate& c : candidates.objects) {
        if (!c.silhouettes[2].empty()) masks.push_back(c.silhouettes[2]);
    }
    save_overlay(out / "shelf_2.png", capture.frames[2].colour, masks);
}

Candidates outlines_of(const fs::path& folder, const char* title, Capture& capture) {
    capture = read_capture(folder);
    std::printf("%s\n", title);
    ScanOptions keep;
    keep.poses = PoseMode::Keep;
    const Scan scan = make_scan(capture, keep);
    const Candidates candidates = find_candidates(capture, scan);
    std::vector<Mask> masks;
    for (const Outline& outline : candidates.outlines) {
        std::printf("  box %d, %d, %d x %d: %s\n", outline.box.x0, outline.box.y0,
                    outline.box.x1 - outline.box.x0, outline.box.y1 - outline.box.y0,
                    outline.evidence.c_str());
        masks.push_back(outline.silhouette);
    }
    for (const std::string& note : candidates.notes) std::printf("  %s\n", note.c_str());
    save_overlay(folder.parent_path() / (folder.filename().string() + ".png"),
                 capture.frames[0].colour, masks);
    return candidates;
}

void run_kinect(const fs::path& from, const fs::path& out) {
    convert_kinect_glasses(from, out / "kinect");
    Capture capture;
    outlines_of(out / "kinect", "desk with a glass and a cup, one view (Kinect v1)", capture);
}

void run_d435(const fs::path& from, const fs::path& out) {
    for (const char* scene : {"000000080", "000000130"}) {
        const Mask truth = read_mask(from / (std::string(scene) + "-mask.png"));
        for (const char* kind : {"transparent", "opaque"}) {
            const fs::path folder = out / fmt::format("d435_{}_{}", scene, kind);
            convert_d435(from, scene, kind, folder);
            Capture capture;
            const Candidates found =
                outlines_of(folder, fmt::format("{} {} (D435)", scene, kind).c_str(), capture);
            Mask all(truth.width(), truth.height());
            for (const Outline& outline : found.outlines) all = mask_or(all, outline.silhouette);
            std::printf("  outlines against the given mask of glass: IoU %.3f\n",
                        intersection_over_union(all, truth));
        }
    }
}

void run_single(const fs::path& from, const fs::path& out) {
    for (const char* name : {"1", "6"}) {
        convert_single_view(from / name, out / fmt::format("single_{}", name));
        Capture capture;
        outlines_of(out / fmt::format("single_{}", name),
                    fmt::format("single view {}", name).c_str(), capture);
    }
}

int run(const fs::path& out, const std::string& only) {
    struct Part {
        const char *name, *folder;
        std::function<void(const fs::path&, const fs::path&)> run;
    };
    const Part parts[] = {{"shelf", "rgbd_shelf_15_views", run_shelf},
                          {"kinect", "kinect_v1_glasses", run_kinect},
                          {"d435", "d435_transparent_pairs", run_d435},
                          {"single", "rgbd_single_views", run_single}};
    for (const Part& part : parts) {
        if (!only.empty() && only != part.name) continue;
        const auto folder = real_data(part.folder);
        if (!folder) {
            std::printf("skipped: no %s below VITRINE_REAL_DATA\n", part.folder);
            continue;
        }
        part.run(*folder, out);
    }
    return 0;
}

}  // namespace
}  // namespace vitrine

int main(int argc, char** argv) {
    fs::path out = fs::temp_directory_path() / "vitrine_real_reconstruction";
    std::string only;
    for (int i = 1; i + 1 < argc; i += 2) {
        if (std::string(argv[i]) == "--out") out = argv[i + 1];
        if (std::string(argv[i]) == "--only") only = argv[i + 1];
    }
    vitrine::set_log_level(vitrine::LogLevel::Warning);
    return vitrine::run(out, only);
}
