// vitrine_reconstruction_quality [--out DIR] [--only objects|poses|track] [--threads N] [--verbose]
// [--hires] CAPTURE...
//
// --hires puts the frames of truth/hires (three times as many pixels each way) in the place of the
// frames of the same pose.
//
// Prints, for captures with a truth/ folder, how far the reconstruction is from the truth: fused
// surface, objects, silhouettes, hulls, poses. The library itself never reads truth/.
#include "base/json_reader.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "base/timer.h"
#include "geometry/mesh_io.h"
#include "image/filter.h"
#include "image/image_io.h"
#include "math/statistics.h"
#include "process_cost.h"
#include "reconstruct/labelled_scene.h"
#include "reconstruct/pose_refinement.h"
#include "reconstruct/tracking.h"
#include "reconstruct/visual_hull.h"
#include "trace/accel.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>

namespace fs = std::filesystem;

namespace vitrine {
namespace {

Accel accel_of(const Mesh& mesh) {
    return Accel(std::vector<AccelPart>{{std::make_shared<const Mesh>(mesh)}});
}

bool is_inside_mesh(const Accel& accel, const Vec3& p) {
    Ray ray{p.cast<float>(), Vec3f(0.013f, 0.027f, 1.0f)};
    int crossings = 0;
    for (Hit hit = accel.closest(ray); hit.is_hit() && crossings < 64; hit = accel.closest(ray)) {
        ++crossings;
        ray.min_distance = hit.distance + 1e-5f;
    }
    return crossings % 2 == 1;
}

double volume_iou(const Mesh& a, const Mesh& b) {
    const Accel in_a = accel_of(a), in_b = accel_of(b);
    Box3 box = bounds(a);
    const Box3 other = bounds(b);
    box.extend(other.min);
    box.extend(other.max);
    ScalarGrid grid(box, 0.002, 0.0f);
    parallel_for(grid.values.size(), 512, [&](std::size_t i) {
        const Eigen::Vector3i c = grid.node_of(i);
        const Vec3 p = grid.node(c.x(), c.y(), c.z());
        grid.values[i] = static_cast<float>((is_inside_mesh(in_a, p) ? 1 : 0) +
                                            (is_inside_mesh(in_b, p) ? 2 : 0));
    });
    const auto count = [&](auto&& want) {
        return double(std::count_if(grid.values.begin(), grid.values.end(), want));
    };
    return count([](float v) { return v == 3.0f; }) / count([](float v) { return v > 0.0f; });
}

struct SurfaceError {
    double median_mm, p90_mm, normal_deg, outer_normal_deg;
};

/// From points of the truth to the hull; normals only on the upper half. Outer normals: where
/// nothing of the body stands before its surface. The inner wall of a cup faces itself, is in no
/// silhouette and in no hull.
SurfaceError surface_error(const Mesh& truth, const Mesh& hull) {
    const Accel accel = accel_of(hull), body = accel_of(truth);
    const SurfaceSamples samples = sample_surface(truth, 20000, 1);
    const Box3 box = bounds(truth);
    std::vector<double> distance, angle, outer;
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
        const Hit near = accel.nearest(samples.points[i], 1.0f);
        if (!near.is_hit()) continue;
        distance.push_back(1e3 * near.distance);
        if (samples.points[i].z() < box.centre().z()) continue;
        angle.push_back(degrees(angle_between(samples.normals[i].cast<double>(),
                                              shading_normal(hull, near).cast<double>())));
        const Ray outwards{samples.points[i] + 1e-4f * samples.normals[i], samples.normals[i]};
        if (!body.closest(outwards).is_hit()) outer.push_back(angle.back());
    }
    return {median(distance), quantile(distance, 0.9), angle.empty() ? 180.0 : median(angle),
            outer.empty() ? 180.0 : median(outer)};
}

/// Frames of truth/hires by the id of the frame that they stand for.
std::map<std::string, fs::path> hires_frames(const fs::path& truth) {
    std::map<std::string, fs::path> frames;
    if (!fs::exists(truth / "scene.json") || !fs::is_directory(truth / "hires")) return frames;
    const JsonObject scene = read_json_file(truth / "scene.json");
    for (const JsonObject& view : scene.object("hires").objects("views")) {
        frames[fmt::format("{:06d}", view.integer("same_pose_as_view"))] =
            truth / "hires/rgb" / fmt::format("{:06d}.png", view.integer("index"));
    }
    return frames;
}

void use_hires(const fs::path& truth, Capture& capture) {
    const auto hires = hires_frames(truth);
    for (RgbdFrame& frame : capture.frames) {
        const auto found = hires.find(frame.id);
        if (found == hires.end()) continue;
        frame.colour = read_linear_rgb(found->second);
        for (Rgb& pixel : frame.colour) pixel *= static_cast<float>(capture.saturation_level);
        const auto codes = read_png16(truth / "hires/depth" / found->second.filename());
        frame.depth_m = ImageF(codes.width(), codes.height());
        for (std::size_t p = 0; p < codes.size(); ++p) frame.depth_m[p] = float(codes[p]) / 5000.0f;
        frame.camera = frame.camera.scaled(double(codes.width()) / frame.camera.width);
    }
}

struct TrueObject {
    std::string name;
    std::vector<Mask> masks;
    Mesh mesh;
};

std::vector<TrueObject> read_objects(const fs::path& truth, const Capture& capture) {
    std::set<std::string> names;
    if (fs::is_directory(truth / "mask")) {
        for (const auto& entry : fs::directory_iterator(truth / "mask")) {
            const std::string stem = entry.path().stem().string();
            names.insert(stem.substr(stem.find('_') + 1));
        }
    }
    std::vector<TrueObject> objects;
    for (const std::string& name : names) {
        TrueObject object{name, {}, read_ply(truth / "mesh" / (name + ".ply"))};
        const auto hires = hires_frames(truth);
        for (const RgbdFrame& frame : capture.frames) {
            fs::path path = truth / "mask" / (frame.id + "_" + name + ".png");
            if (frame.camera.width == 1920) {
                path = truth / "hires/mask" /
                       (hires.at(frame.id).stem().string() + "_" + name + ".png");
            }
            object.masks.push_back(
                fs::exists(path) ? read_mask(path) : Mask(frame.camera.width, frame.camera.height));
        }
        objects.push_back(std::move(object));
    }
    return objects;
}

/// The hull that perfect silhouettes give with the same views, hidden pixels and grid.
Mesh ideal_hull(const Capture& capture, const Scan& scan, const Candidate& candidate,
                const TrueObject& truth, double spacing_m) {
    std::vector<OutlineView> outlines;
    for (std::size_t i = 0; i < capture.frames.size(); ++i) {
        outlines.push_back(outline_view(scan.cameras[i], truth.masks[i], candidate.hidden[i]));
    }
    Box3 box = bounds(truth.mesh);
    box.min.array() -= 0.02;
    box.max.array() += 0.02;
    return hull_mesh(carve(outlines, box, spacing_m), 0.0, 1.0, scan.support_plane);
}

void save_masks(const fs::path& out, const Capture& capture, const Candidate& candidate) {
    for (std::size_t i = 0; i < candidate.silhouettes.size(); ++i) {
        if (candidate.silhouettes[i].empty()) continue;
        write_png(out / (candidate.id + "_" + capture.frames[i].id + ".png"),
                  candidate.silhouettes[i]);
    }
}

void report_object(const Capture& capture, const Scan& scan, const Candidate& candidate,
                   const TrueObject& truth) {
    double sum = 0, worst = 1;
    int views = 0;
    for (std::size_t i = 0; i < truth.masks.size(); ++i) {
        if (count_inside(truth.masks[i]) == 0) continue;
        const Mask& own = candidate.silhouettes[i];
        const double iou = own.empty() ? 0.0 : intersection_over_union(own, truth.masks[i]);
        sum += iou;
        worst = std::min(worst, iou);
        ++views;
    }
    const SurfaceError error = surface_error(truth.mesh, candidate.hull);
    const Mesh ideal =
        ideal_hull(capture, scan, candidate, truth, CandidateOptions().hull_spacing_m);
    const double iou = volume_iou(candidate.hull, truth.mesh);
    const double ideal_iou = volume_iou(ideal, truth.mesh);
    const SurfaceError ideal_error = surface_error(truth.mesh, ideal);
    std::printf("  %s = %s: silhouette IoU mean %.3f worst %.3f (%d views)\n", candidate.id.c_str(),
                truth.name.c_str(), sum / views, worst, views);
    std::printf(
        "    hull: distance median %.2f mm p90 %.2f mm; normals, upper half %.2f deg, of its outer "
        "surface %.2f deg; volume IoU %.3f\n",
        error.median_mm, error.p90_mm, error.normal_deg, error.outer_normal_deg, iou);
    std::printf(
        "    true silhouettes give: %.2f mm, %.2f mm; %.2f deg, %.2f deg; %.3f (ratio %.3f)\n",
        ideal_error.median_mm, ideal_error.p90_mm, ideal_error.normal_deg,
        ideal_error.outer_normal_deg, ideal_iou, iou / ideal_iou);
    std::printf("    revolution %s, outline residual %.2f px; bad depth %.2f; closed %s; %s\n",
                candidate.revolution.is_found ? "yes" : "no", candidate.outline_residual_px,
                candidate.bad_depth_fraction,
                find_defects(candidate.hull).is_closed() ? "yes" : "NO",
                candidate.evidence.c_str());
}

void report_objects(const fs::path& folder, const fs::path& out, const Capture& capture,
                    const Scan& scan, const Candidates& candidates) {
    const std::vector<TrueObject> truths = read_objects(folder / "truth", capture);
    std::set<std::string> found;
    for (const Candidate& candidate : candidates.objects) {
        const TrueObject* best = nullptr;
        double best_iou = 0.05;
        for (const TrueObject& truth : truths) {
            const double iou = volume_iou(candidate.hull, truth.mesh);
            if (iou > best_iou) best_iou = iou, best = &truth;
        }
        if (!out.empty()) {
            write_ply(out / (candidate.id + ".ply"), candidate.hull);
            save_masks(out, capture, candidate);
        }
        if (!best) {
            std::printf("  %s: EXTRA, no true object there (%s)\n", candidate.id.c_str(),
                        candidate.evidence.c_str());
            continue;
        }
        found.insert(best->name);
        report_object(capture, scan, candidate, *best);
    }
    for (const TrueObject& truth : truths) {
        if (!found.contains(truth.name)) std::printf("  MISSED %s\n", truth.name.c_str());
    }
}

/// Fused surface against the true depth of every view, outside the special objects.
void report_surface(const fs::path& folder, const Capture& capture, const Scene& scene,
                    double max_depth_m) {
    const fs::path truth = folder / "truth";
    const std::vector<TrueObject> objects = read_objects(truth, capture);
    std::vector<ImageF> depth;
    for (const RgbdFrame& frame : capture.frames) {
        const auto codes = read_png16(truth / "depth_true" / (frame.id + ".png"));
        ImageF image(codes.width(), codes.height());
        for (std::size_t p = 0; p < codes.size(); ++p) image[p] = float(codes[p]) / 5000.0f;
        depth.push_back(std::move(image));
    }
    std::vector<Vec3f> points;
    for (std::size_t i = 0; i < depth.size(); ++i) {
        for (int y = 2; y < depth[i].height(); y += 5) {
            for (int x = 2; x < depth[i].width(); x += 5) {
                const double z = depth[i](x, y);
                bool is_special = z <= 0 || z > max_depth_m;
                for (const TrueObject& o : objects) {
                    is_special = is_special || is_inside(o.masks[i], x, y);
                }
                if (is_special) continue;
                const Vec3 p = capture.frames[i].camera.unproject(x, y, z);
                int seen = 0;
                for (std::size_t j = 0; j < depth.size(); ++j) {
                    const Camera& c = capture.frames[j].camera;
                    const Vec2 q = c.project(p);
                    const double d = c.depth(p);
                    if (d <= 0 || !c.sees(q)) continue;
                    const float there = depth[j](int(std::lround(q.x())), int(std::lround(q.y())));
                    seen += std::abs(there - d) < 0.01 ? 1 : 0;
                }
                if (seen >= 2) points.push_back(p.cast<float>());
            }
        }
    }
    const Accel ours = accel_of(*scene.parts[0].mesh);
    std::vector<double> distance(points.size());
    parallel_for(points.size(), 256, [&](std::size_t i) {
        const Hit hit = ours.nearest(points[i], 0.1f);
        distance[i] = hit.is_hit() ? 1e3 * hit.distance : 100.0;
    });
    const double within =
        double(std::count_if(distance.begin(), distance.end(), [](double d) { return d <= 5.0; }));
    std::printf(
        "  surface: %zu true points in >= 2 views within %.1f m: median %.2f mm, 90 %% "
        "within %.2f mm, within 5 mm %.1f %%\n",
        points.size(), max_depth_m, median(distance), quantile(distance, 0.9),
        100 * within / double(points.size()));
}

struct PoseError {
    double mean_mm, max_mm, mean_deg, max_deg;
};

/// After one rigid alignment of the camera centres and axes.
PoseError pose_error(const Capture& capture, const std::vector<Camera>& cameras) {
    std::vector<Vec3> ours, truth;
    const auto mark = [](const Camera& c, std::vector<Vec3>& points) {
        const Rigid3 world_from_camera = c.cam_from_world.inverse();
        for (int k = -1; k < 3; ++k) {  // centre and a point on each axis: also turns count
            points.push_back(world_from_camera * (k < 0 ? Vec3::Zero() : Vec3(Vec3::Unit(k))));
        }
    };
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        mark(cameras[i], ours);
        mark(capture.frames[i].camera, truth);
    }
    const Rigid3 align = align_points(ours, truth);
    PoseError e{0, 0, 0, 0};
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const double mm = 1e3 * (align * ours[4 * i] - truth[4 * i]).norm();
        const Mat3 turn = align.rotation * cameras[i].cam_from_world.rotation.transpose() *
                          capture.frames[i].camera.cam_from_world.rotation;
        const double deg = degrees(std::abs(Eigen::AngleAxisd(turn).angle()));
        e.mean_mm += mm / double(cameras.size());
        e.mean_deg += deg / double(cameras.size());
        e.max_mm = std::max(e.max_mm, mm);
        e.max_deg = std::max(e.max_deg, deg);
    }
    return e;
}

void print_poses(const char* what, const PoseError& e, double seconds) {
    std::printf("  poses %s: mean %.2f mm %.3f deg, max %.2f mm %.3f deg (%.1f s)\n", what,
                e.mean_mm, e.mean_deg, e.max_mm, e.max_deg, seconds);
}

void report_poses(const Capture& capture) {
    std::vector<Camera> exact, perturbed;
    for (std::size_t i = 0; i < capture.frames.size(); ++i) {
        exact.push_back(capture.frames[i].camera);
        Rng rng(stream_key(11, i));
        const auto direction = [&] {
            const double z = 2 * rng.next_double() - 1, a = 2 * kPi * rng.next_double();
            return Vec3(std::sqrt(1 - z * z) * std::cos(a), std::sqrt(1 - z * z) * std::sin(a), z);
        };
        Camera c = exact.back();
        c.cam_from_world =
            rigid_from_twist(radians(0.7) * direction(), 0.01 * direction()) * c.cam_from_world;
        perturbed.push_back(c);
    }
    print_poses("perturbed by 1 cm, 0.7 deg", pose_error(capture, perturbed), 0);
    Timer timer;
    const PoseRefinement refined = refine_poses(capture, perturbed, {});
    print_poses("  refined", pose_error(capture, refined.cameras), timer.seconds());
    timer = {};
    const PoseRefinement kept = refine_poses(capture, exact, {});
    print_poses(kept.is_accepted ? "exact, refined (accepted)" : "exact, refined (kept)",
                pose_error(capture, kept.cameras), timer.seconds());
    PoseRefinementOptions always;
    always.min_gain = -1;
    print_poses("exact, refinement forced",
                pose_error(capture, refine_poses(capture, exact, {}, always).cameras), 0);
}

void report_tracking(const Capture& capture) {
    const Timer timer;
    const Tracking tracking = track_poses(capture);
    std::string lost;
    for (std::size_t i = 0; i < tracking.is_tracked.size(); ++i) {
        if (!tracking.is_tracked[i]) lost += " " + capture.frames[i].id;
    }
    if (!lost.empty()) {
        std::printf("  tracking: no connection to%s\n", lost.c_str());
        return;
    }
    print_poses("tracked", pose_error(capture, tracking.cameras), timer.seconds());
    const PoseRefinement refined = refine_poses(capture, tracking.cameras, {});
    print_poses("tracked and refined", pose_error(capture, refined.cameras), timer.seconds());
    std::printf("    disagreement of the views %.3f -> %.3f\n", refined.cost_before,
                refined.cost_after);
}

void run(const fs::path& folder, const fs::path& out_root, const std::string& only, bool is_hires) {
    Capture capture = read_capture(folder);
    if (is_hires) use_hires(folder / "truth", capture);
    std::printf("%s%s\n", capture.name.c_str(), is_hires ? ", with frames of 1920 x 1080" : "");
    const fs::path out = out_root.empty() ? fs::path() : out_root / capture.name;
    if (!out.empty()) fs::create_directories(out);
    if (only.empty() || only == "poses") report_poses(capture);
    if (only.empty() || only == "track") report_tracking(capture);
    if (only.empty() || only == "objects") {
        const Timer timer;
        const CpuTimer cpu;
        ScanOptions options;
        options.poses = PoseMode::Keep;
        const Scan scan = make_scan(capture, options);
        const double scanned = timer.seconds();
        const Candidates candidates = find_candidates(capture, scan);
        const double found = timer.seconds();
        const Scene scene = build_scene(scan, candidates);
        std::printf(
            "  time: scan %.1f s, candidates %.1f s, scene %.1f s; depth residual %.2f mm\n",
            scanned, found - scanned, timer.seconds() - found, 1e3 * scan.depth_residual_m);
        std::printf("  in all %.1f s, %.1f CPU s, peak memory of the process %.0f MB\n",
                    timer.seconds(), cpu.seconds(), peak_memory_mb());
        if (!is_hires) report_surface(folder, capture, scene, options.max_depth_m);
        report_objects(folder, out, capture, scan, candidates);
        if (!out.empty()) {
            write_ply(out / "scan.ply", scan.mesh);
            write_ply(out / "labelled.ply", *scene.parts[0].mesh);
        }
    }
}

}  // namespace
}  // namespace vitrine

int main(int argc, char** argv) {
    fs::path out;
    std::string only;
    bool is_hires = false;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        if (argument == "--out" && i + 1 < argc) {
            out = argv[++i];
        } else if (argument == "--only" && i + 1 < argc) {
            only = argv[++i];
        } else if (argument == "--hires") {
            is_hires = true;
        } else if (argument == "--verbose") {
            vitrine::set_log_level(vitrine::LogLevel::Debug);
        } else if (argument == "--threads" && i + 1 < argc) {
            vitrine::set_thread_count(std::atoi(argv[++i]));
        } else {
            vitrine::run(argument, out, only, is_hires);
        }
    }
    return 0;
}
