#include "reconstruct/scan.h"

#include "base/log.h"
#include "base/parallel.h"
#include "base/text.h"
#include "capture/exposure_gains.h"
#include "capture/read_capture.h"
#include "image/filter.h"
#include "math/statistics.h"
#include "reconstruct/appearance.h"
#include "reconstruct/depth_classes.h"
#include "reconstruct/fusion.h"
#include "reconstruct/pose_refinement.h"
#include "reconstruct/tracking.h"
#include "trace/depth_map.h"

#include <algorithm>
#include <optional>

namespace vitrine {
namespace {

constexpr std::size_t kMaxRefinedFrames = 300;  // one dense system of six unknowns a frame
constexpr double kMaxDisagreement = 1.0;        // robust cost per comparison; noise alone gives 0.3
constexpr double kMinTrackedShare = 0.6;        // fewer frames are another capture
constexpr std::size_t kMinTracked = 5;
constexpr int kBadMargin_px = 3;  // silhouettes are a little wider than their bad depth

std::vector<ImageF> depth_images(const Capture& capture) {
    std::vector<ImageF> depth;
    for (const RgbdFrame& frame : capture.frames) depth.push_back(frame.depth_m);
    return depth;
}

/// Fuses, then leaves out the regions where depth is missing or disagrees with what was fused, and
/// fuses again: readings through glass and on metal pull the surfaces around them along.
Mesh fuse_twice(const std::vector<ImageF>& depth, const std::vector<Camera>& cameras,
                const FusionOptions& options) {
    const auto first = std::make_shared<const Mesh>(fuse_depth(depth, cameras, options));
    if (first->empty()) return {};
    const Accel accel(std::vector<AccelPart>{{first}});
    std::vector<ImageF> trusted = depth;
    for (std::size_t i = 0; i < depth.size(); ++i) {
        const ImageF model = render_depth(accel, cameras[i]);
        const Mask bad =
            bad_regions(classify_depth(depth[i], model, cameras[i], options.max_depth_m));
        for (std::size_t p = 0; p < bad.size(); ++p) {
            if (bad[p] > 127) trusted[i][p] = 0.0f;
        }
    }
    return fuse_depth(trusted, cameras, options);
}

/// Depth pixels of all views as points, thinned out.
std::vector<Vec3> sample_points(const Capture& capture, const std::vector<Camera>& cameras,
                                double max_depth_m) {
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const ImageF& depth = capture.frames[i].depth_m;
        for (int y = 0; y < depth.height(); y += 4) {
            for (int x = 0; x < depth.width(); x += 4) {
                const double z = depth(x, y);
                if (z > 0 && z < max_depth_m) points.push_back(cameras[i].unproject(x, y, z));
            }
        }
    }
    if (points.size() < 100) {
        throw InputError(
            {capture.name, "depth images with valid readings",
             fmt::format("{} usable depth pixels", 16 * points.size()),
             "check depth_scale in capture.json (5000 for TUM, 1000 for millimetres)"});
    }
    return points;
}

/// The plane that carries things: of the largest planes, one that faces up rather than a wall.
Plane find_support_plane(const Capture& capture, const std::vector<Camera>& cameras,
                         double max_depth_m) {
    constexpr int kPlanes = 4;
    constexpr double kMinShare = 0.03;  // of the points: smaller ones carry nothing
    std::vector<Vec3> points = sample_points(capture, cameras, max_depth_m);
    Vec3 eye = Vec3::Zero();
    for (const Camera& camera : cameras) eye += camera.centre_in_world() / double(cameras.size());
    const Vec3 up = likely_up(cameras);
    const double tolerance = 2.5 * depth_noise_m(0.5 * max_depth_m);
    const std::size_t all = points.size();
    Plane best;
    double best_score = -1;
    for (int k = 0; k < kPlanes && points.size() >= 100; ++k) {
        Plane plane = fit_plane(points, tolerance).plane;
        if (plane.height(eye) < 0) plane = {-plane.normal, -plane.offset_m};
        const std::size_t before = points.size();
        std::erase_if(points, [&](const Vec3& p) { return std::abs(plane.height(p)) < tolerance; });
        const double share = double(before - points.size()) / double(all);
        if (k > 0 && share < kMinShare) break;
        const double score = share * (0.05 + std::max(0.0, plane.normal.dot(up)));
        if (score > best_score) {
            best_score = score;
            best = plane;
        }
    }
    return best;
}

double depth_residual(const Capture& capture, const std::vector<ImageF>& model,
                      std::vector<FramePose>& poses) {
    std::vector<double> all;
    for (std::size_t i = 0; i < model.size(); ++i) {
        std::vector<double> own;
        const ImageF& depth = capture.frames[i].depth_m;
        for (std::size_t p = 0; p < depth.size(); p += 7) {
            if (depth[p] > 0 && model[i][p] > 0) own.push_back(depth[p] - model[i][p]);
        }
        poses[i].residual_m = own.empty() ? 0.0 : robust_sd(own);
        all.insert(all.end(), own.begin(), own.end());
    }
    return all.empty() ? 0.0 : robust_sd(all);
}

/// Finds the poses from the frames.
/// @throws InputError naming the frames that do not connect to the others, when too few do
void track(const Capture& capture, const Progress& progress, Scan& scan) {
    const Tracking tracking = track_poses(capture, {}, progress);
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < tracking.is_tracked.size(); ++i) {
        if (tracking.is_tracked[i]) {
            kept.push_back(i);
        } else {
            scan.dropped.push_back(capture.frames[i].id);
        }
    }
    const std::size_t all = capture.frames.size();
    const bool has_enough =
        kept.size() >= kMinTracked && double(kept.size()) >= kMinTrackedShare * double(all);
    if (!scan.dropped.empty() && !has_enough) {
        const std::size_t shown = std::min<std::size_t>(10, scan.dropped.size());
        throw InputError(
            {capture.name, "frames that share enough texture to find their poses",
             fmt::format("{} of {} frames without a connection to the others: {}{}",
                         scan.dropped.size(), all, join(std::span(scan.dropped).first(shown), ", "),
                         shown < scan.dropped.size() ? ", ..." : ""),
             "take more views between them, add texture, or give a trajectory"});
    }
    scan.cameras.clear();
    scan.poses.clear();
    for (const std::size_t i : kept) {
        scan.cameras.push_back(tracking.cameras[i]);
        scan.poses.push_back({.id = capture.frames[i].id});
    }
    scan.notes.push_back("poses found from the frames alone");
    if (scan.dropped.empty()) return;
    scan.notes.push_back(fmt::format("{} of {} frames dropped, no connection to the others: {}",
                                     scan.dropped.size(), all, join(scan.dropped, ", ")));
    log_warning("{}", scan.notes.back());
}

/// Turns the world so that the support plane is z = 0 and up is +z.
void set_upright(Scan& scan) {
    const Rigid3 upright_from_world = plane_from_world(scan.support_plane);
    for (Camera& camera : scan.cameras) {
        camera.cam_from_world = camera.cam_from_world * upright_from_world.inverse();
    }
    scan.support_plane = Plane();
}

/// Improves the poses and writes down how far they moved.
void refine(const Capture& capture, const Progress& progress, Scan& scan) {
    if (scan.cameras.size() > kMaxRefinedFrames) {
        scan.notes.push_back(
            fmt::format("poses kept: {} frames are more than the {} that are refined together",
                        scan.cameras.size(), kMaxRefinedFrames));
        return;
    }
    const std::vector<Camera> before = scan.cameras;
    const PoseRefinement refinement = refine_poses(capture, before, {}, {}, progress);
    scan.cameras = refinement.cameras;
    for (std::size_t i = 0; i < before.size(); ++i) {
        const Rigid3 motion = scan.cameras[i].cam_from_world * before[i].cam_from_world.inverse();
        scan.poses[i].moved_m =
            (scan.cameras[i].centre_in_world() - before[i].centre_in_world()).norm();
        scan.poses[i].turned_rad = std::abs(Eigen::AngleAxisd(motion.rotation).angle());
    }
    if (refinement.comparisons > 0 && refinement.cost_after > kMaxDisagreement) {
        scan.notes.push_back(fmt::format(
            "the views still disagree after refinement ({:.2f}, good is below {:.1f}): poses, "
            "intrinsics or depth are wrong",
            refinement.cost_after, kMaxDisagreement));
        log_warning("{}", scan.notes.back());
    }
    scan.notes.push_back(
        refinement.is_accepted
            ? fmt::format("poses refined: disagreement of the views {:.3f} -> {:.3f}",
                          refinement.cost_before, refinement.cost_after)
            : "poses kept: refining them would not make the views agree better");
}

/// Writes down how much brighter each frame is than the others, if that is sure.
bool find_exposures(const Capture& capture, Scan& scan) {
    const ExposureGains gains = estimate_exposure_gains(capture, scan.cameras);
    if (!gains.is_significant) return false;
    for (std::size_t i = 0; i < gains.gain.size(); ++i) scan.poses[i].exposure_gain = gains.gain[i];
    const auto [low, high] = std::minmax_element(gains.gain.begin(), gains.gain.end());
    scan.notes.push_back(
        fmt::format("exposures evened out: gains of {:.2f} to {:.2f}, disagreement in brightness "
                    "{:.1f} % -> {:.1f} %",
                    *low, *high, 100 * gains.disagreement_before, 100 * gains.disagreement_after));
    return true;
}

}  // namespace

Vec3 likely_up(std::span<const Camera> cameras) {
    Vec3 up = Vec3::Zero();
    for (const Camera& camera : cameras) {
        // A camera that looks down sees the table's normal half in its -y, half in its -z.
        up -= camera.cam_from_world.rotation.transpose() * Vec3(0, 1, 0.5);
    }
    return up.normalized();
}

Capture frames_of_scan(Capture capture, const Scan& scan) {
    std::vector<RgbdFrame> frames;
    std::vector<double> gain;
    for (RgbdFrame& frame : capture.frames) {
        const std::size_t k = frames.size();
        if (k >= scan.poses.size() || scan.poses[k].id != frame.id) continue;
        gain.push_back(scan.poses[k].exposure_gain);
        frames.push_back(std::move(frame));
    }
    VITRINE_CHECK_EQ(frames.size(), scan.poses.size());
    capture.frames = std::move(frames);
    const auto is_reference = [&](const RgbdFrame& frame) {
        return frame.id == capture.reference_albedo->frame;
    };
    if (capture.reference_albedo &&
        std::none_of(capture.frames.begin(), capture.frames.end(), is_reference)) {
        capture.warnings.push_back("the frame of the reference albedo has no pose: it is not used");
        capture.reference_albedo.reset();
    }
    if (std::any_of(gain.begin(), gain.end(), [](double g) { return g != 1.0; })) {
        apply_exposure_gains(gain, capture);
    }
    return capture;
}

Scan make_scan(const Capture& given, const ScanOptions& options, const Progress& progress) {
    if (given.frames.empty()) {
        throw InputError({given.name, "at least one frame", "none", ""});
    }
    Scan scan;
    scan.cameras = cameras_of(given);
    for (const RgbdFrame& frame : given.frames) scan.poses.push_back({.id = frame.id});
    std::optional<Capture> changed;  // a copy only when the frames do not stay as they came
    const auto now = [&]() -> const Capture& { return changed ? *changed : given; };
    const bool has_start = given.has_poses && options.poses != PoseMode::Track;
    if (!has_start) track(given, progress.part(0.0, 0.15), scan);
    if (!scan.dropped.empty()) changed = frames_of_scan(given, scan);
    if (!has_start || options.poses == PoseMode::Refine) {
        refine(now(), progress.part(0.15, 0.3), scan);
    }
    if (find_exposures(now(), scan)) changed = frames_of_scan(given, scan);
    const Capture& capture = now();
    const FusionOptions fusion{options.voxel_m, options.truncation_m, options.max_depth_m};
    scan.support_plane = find_support_plane(capture, scan.cameras, options.max_depth_m);
    if (!has_start) set_upright(scan);
    progress.update(0.3, "fusing depth");
    const std::vector<ImageF> depth = depth_images(capture);
    scan.mesh =
        without_small_pieces(fuse_twice(depth, scan.cameras, fusion), options.min_component_m2);
    scan.mesh.normals = vertex_normals(scan.mesh);
    progress.update(0.6, "rendering the surface");
    const Accel accel(std::vector<AccelPart>{{std::make_shared<const Mesh>(scan.mesh)}});
    std::vector<ImageF> model;
    for (const Camera& camera : scan.cameras) model.push_back(render_depth(accel, camera));
    scan.depth_residual_m = depth_residual(capture, model, scan.poses);
    progress.update(0.8, "colouring the surface");
    // What stands before the surface without being in it (glass, metal) must not colour it.
    std::vector<Mask> excluded;
    std::vector<ViewOfScene> views;
    for (std::size_t i = 0; i < model.size(); ++i) {
        excluded.push_back(dilate(
            bad_regions(classify_depth(depth[i], model[i], scan.cameras[i], options.max_depth_m)),
            kBadMargin_px));
    }
    for (std::size_t i = 0; i < model.size(); ++i) {
        views.push_back({&capture.frames[i], &scan.cameras[i], &model[i], &excluded[i]});
    }
    scan.mesh.colours = vertex_colours(scan.mesh, views);
    log_info("scan: {} vertices, depth residual {:.2f} mm", scan.mesh.vertices.size(),
             1e3 * scan.depth_residual_m);
    progress.update(1.0, "scan done");
    return scan;
}

}  // namespace vitrine
