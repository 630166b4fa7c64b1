#include "reconstruct/candidates.h"

#include "base/log.h"
#include "base/text.h"
#include "image/filter.h"
#include "reconstruct/candidate_views.h"
#include "reconstruct/revolution.h"
#include "reconstruct/support_doubt.h"
#include "reconstruct/visual_hull.h"
#include "reconstruct/vote_grid.h"
#include "trace/depth_map.h"

#include <algorithm>

namespace vitrine {
namespace {

constexpr double kGrowth_m = 0.010;  // the first guess of a body may be this much too small
constexpr double kMargin_m = 0.025;  // of the carved box around the voted voxels
constexpr double kMaxVoxels = 4e7;   // of the voting grid: 160 MB
constexpr double kMaxBase_m = 0.03;  // objects stand on the plane; what floats is no object
constexpr double kMaxDepth_m = 2.0;
constexpr int kOccupiedMargin_px = 5;  // blur and misregistration beside an object
constexpr int kBoxMargin_px = 25;      // of background around an object, to learn from

/// Everything about one object while it takes shape.
struct Growing {
    std::string id;
    VoxelCluster cluster;
    ScalarGrid body;                ///< negative inside
    std::vector<BodyImage> images;  ///< of the body, per view
    std::vector<SilhouetteView> views;
    std::vector<Mask> silhouettes;
    std::vector<Mask> hidden;  ///< of the round that drew the silhouettes
    std::vector<OutlineView> outlines;
};

Box3 grown(const Box3& box, double by) {
    Box3 result = box;
    result.min.array() -= by;
    result.max.array() += by;
    return result;
}

/// Space above the support surface where objects can stand.
Box3 workspace(const SupportSurface& support, double max_height_m) {
    Box3 box;
    const Rigid3 world_from_plane = support.plane_from_world.inverse();
    for (int y = 0; y < support.rows; ++y) {
        for (int x = 0; x < support.columns; ++x) {
            if (!support.is_filled[static_cast<std::size_t>(y * support.columns + x)]) continue;
            const Vec3 p(support.origin.x() + x * support.cell_m,
                         support.origin.y() + y * support.cell_m, 0);
            box.extend(world_from_plane * p);
            box.extend(world_from_plane * (p + Vec3(0, 0, max_height_m)));
        }
    }
    return box;
}

Votes vote(const SceneViews& views, const CandidateOptions& options) {
    std::vector<Mask> bad, known;
    for (const DepthClasses& classes : views.classes) {
        bad.push_back(bad_regions(classes));
        Mask can_tell = bad.back();
        for (std::size_t p = 0; p < can_tell.size(); ++p) {
            if (classes[p] == DepthClass::Ok) can_tell[p] = 255;
        }
        known.push_back(std::move(can_tell));
    }
    std::vector<VoteView> votes;
    for (std::size_t i = 0; i < views.count(); ++i) {
        votes.push_back({&views.scan->cameras[i], &views.capture->frames[i].depth_m,
                         &views.background_depth_m[i], &bad[i], &known[i]});
    }
    const Box3 box = workspace(views.support, options.max_height_m);
    if (box.is_empty()) return {};
    const double voxel = std::max(options.voxel_m, std::cbrt(box.size().prod() / kMaxVoxels));
    return vote_for_bad_depth(
        votes, box, views.scan->support_plane,
        {voxel, options.min_bad_fraction, std::min<int>(options.min_views, int(views.count())),
         options.min_volume_m3});
}

double base_height(const VoxelCluster& cluster, const Plane& support) {
    double lowest = 1e9;
    for (int c = 0; c < 8; ++c) {
        Vec3 corner;
        for (int k = 0; k < 3; ++k) corner[k] = (c >> k & 1 ? cluster.box.max : cluster.box.min)[k];
        lowest = std::min(lowest, support.height(corner));
    }
    return lowest;
}

/// The voted voxels as a smooth field, negative inside.
ScalarGrid body_of_cluster(const ScalarGrid& grid, const VoxelCluster& cluster) {
    ScalarGrid body(grown(cluster.box, kMargin_m), grid.spacing_m, 1.0f);
    for (const std::size_t node : cluster.nodes) {
        const Eigen::Vector3i c = grid.node_of(node);
        const Vec3 at = (grid.node(c.x(), c.y(), c.z()) - body.origin) / body.spacing_m;
        body.at(int(std::lround(at.x())), int(std::lround(at.y())), int(std::lround(at.z()))) =
            -1.0f;
    }
    ScalarGrid smooth = gaussian_blur(body, 1.0);
    // Scaled to metres near the surface, so that offsets mean something.
    for (float& v : smooth.values) v *= static_cast<float>(1.5 * body.spacing_m);
    return smooth;
}

/// A box that the user gives counts as voted.
VoxelCluster cluster_of_box(const ScalarGrid& grid, const Box3& box) {
    VoxelCluster cluster;
    for (std::size_t i = 0; i < grid.values.size(); ++i) {
        const Eigen::Vector3i c = grid.node_of(i);
        const Vec3 p = grid.node(c.x(), c.y(), c.z());
        if (!box.contains(p)) continue;
        cluster.nodes.push_back(i);
        cluster.box.extend(p);
    }
    cluster.volume_m3 = double(cluster.nodes.size()) * std::pow(grid.spacing_m, 3);
    return cluster;
}

/// Does most of a region lie in one of the boxes?
bool is_in_a_box(const ScalarGrid& grid, const VoxelCluster& cluster,
                 const std::vector<Box3>& boxes) {
    return std::any_of(boxes.begin(), boxes.end(), [&](const Box3& box) {
        const auto inside =
            std::count_if(cluster.nodes.begin(), cluster.nodes.end(), [&](std::size_t node) {
                const Eigen::Vector3i c = grid.node_of(node);
                return box.contains(grid.node(c.x(), c.y(), c.z()));
            });
        return 2 * static_cast<std::size_t>(inside) > cluster.nodes.size();
    });
}

void render(const SceneViews& views, double growth_m, Growing& object) {
    const Plane& support = views.scan->support_plane;
    object.images = render_body(views, hull_mesh(object.body, 0.0, 0.0, support),
                                hull_mesh(object.body, -growth_m, 0.0, support));
}

/// A nearer candidate hides a farther one.
void hide_behind_each_other(std::vector<Growing>& objects) {
    for (std::size_t a = 0; a < objects.size(); ++a) {
        for (std::size_t i = 0; i < objects[a].images.size(); ++i) {
            BodyImage& image = objects[a].images[i];
            if (image.expected.empty()) continue;
            for (std::size_t b = 0; b < objects.size(); ++b) {
                if (a == b || objects[b].images[i].expected.empty()) continue;
                const ImageF& other = objects[b].images[i].depth_m;
                for (std::size_t p = 0; p < other.size(); ++p) {
                    if (other[p] <= 0) continue;
                    if (image.depth_m[p] <= 0 || image.depth_m[p] <= other[p]) continue;
                    image.hidden[p] = 255;
                    image.expected[p] = 0;
                }
            }
        }
    }
}

std::vector<Mask> occupied_pixels(const std::vector<Growing>& objects, std::size_t view_count) {
    std::vector<Mask> occupied(view_count);
    for (std::size_t i = 0; i < view_count; ++i) {
        for (const Growing& object : objects) {
            const ImageF& depth = object.images[i].depth_m;
            if (occupied[i].empty()) occupied[i] = Mask(depth.width(), depth.height());
            for (std::size_t p = 0; p < depth.size(); ++p) {
                if (depth[p] > 0) occupied[i][p] = 255;
            }
        }
        occupied[i] = dilate(occupied[i], kOccupiedMargin_px);
    }
    return occupied;
}

void look_behind(const SceneViews& views, std::vector<Growing>& objects) {
    const std::vector<Mask> occupied = occupied_pixels(objects, views.count());
    for (Growing& object : objects) {
        object.views.resize(views.count());
        for (std::size_t i = 0; i < views.count(); ++i) {
            SilhouetteView& view = object.views[i];
            view.colour = &views.capture->frames[i].colour;
            view.classes = &views.classes[i];
            const BodyImage& image = object.images[i];
            if (image.expected.empty()) continue;
            view.box = PixelBox::of(image.expected)
                           .grown(kBoxMargin_px, view.colour->width(), view.colour->height());
            predict_background(views, occupied, i, view.box, view.background, view.has_background);
        }
    }
}

/// The user's silhouette is taken as it is: all visible pixels, nothing hidden.
void use_edit(const Mask& edit, const std::string& id, SilhouetteView& view) {
    if (!edit.same_size(*view.colour)) {
        throw InputError({"edited silhouette of " + id,
                          fmt::format("{}x{} pixels", view.colour->width(), view.colour->height()),
                          fmt::format("{}x{}", edit.width(), edit.height()),
                          "edit the silhouette at the size of the pictures"});
    }
    view.expected = edit;
    view.hidden = Mask(edit.width(), edit.height());
    view.box = PixelBox::of(edit).grown(kBoxMargin_px, edit.width(), edit.height());
    view.is_fixed = true;
}

/// An edit of an object that does not exist would be lost without a word.
void require_known_edits(const CandidateOptions& options, const std::vector<Growing>& objects) {
    std::vector<std::string> ids;
    for (const Growing& object : objects) ids.push_back(object.id);
    for (const auto& [key, mask] : options.edited_silhouettes) {
        if (std::find(ids.begin(), ids.end(), key.first) != ids.end()) continue;
        throw InputError(
            {"edited silhouette " + key.second + "_" + key.first + ".png",
             ids.empty() ? "no edits: there is no candidate" : "one of " + join(ids, ", "),
             key.first, "a box in edits/boxes.json makes a candidate"});
    }
}

void draw_outlines(const SceneViews& views, const CandidateOptions& options,
                   const std::vector<Growing>& all, double slack_px, Growing& object) {
    for (std::size_t i = 0; i < views.count(); ++i) {
        SilhouetteView& view = object.views[i];
        view.expected = view.box.is_empty() ? Mask() : object.images[i].expected;
        view.hidden = object.images[i].hidden;
        view.other = Mask();
        for (const Growing& other : all) {
            if (&other == &object || other.images[i].expected.empty()) continue;
            view.other = view.other.empty() ? other.images[i].expected
                                            : mask_or(view.other, other.images[i].expected);
        }
        const auto edit = options.edited_silhouettes.find({object.id, views.capture->frames[i].id});
        if (edit != options.edited_silhouettes.end()) use_edit(edit->second, object.id, view);
    }
    object.silhouettes = cut_silhouettes(object.views, views.capture->saturation_level,
                                         {.outline_slack_px = slack_px});
}

void carve_body(const SceneViews& views, double spacing_m, Growing& object) {
    object.outlines.clear();
    object.hidden.clear();
    for (std::size_t i = 0; i < views.count(); ++i) {
        object.outlines.push_back(
            outline_view(views.scan->cameras[i], object.silhouettes[i], object.images[i].hidden));
        object.hidden.push_back(object.images[i].hidden);
    }
    object.body = carve(object.outlines, grown(object.cluster.box, kMargin_m), spacing_m);
}

/// How the outlines of a body lie to those of the silhouettes: differing area over the length of
/// the outline, in pixels.
struct OutlineResidual {
    double absolute_px = 1e9;
    double signed_px = 0.0;  ///< positive: the body is too large
};

OutlineResidual outline_residual(const Growing& object) {
    double too_large = 0, too_small = 0, length = 0;
    for (std::size_t i = 0; i < object.images.size(); ++i) {
        const Mask& silhouette = object.silhouettes[i];
        if (silhouette.empty()) continue;
        const Mask rim = erode(silhouette, 1);
        for (std::size_t p = 0; p < rim.size(); ++p) {
            if (object.hidden[i][p] > 127 || object.images[i].hidden[p] > 127) continue;
            const bool is_wanted = silhouette[p] > 127, is_there = object.images[i].depth_m[p] > 0;
            length += is_wanted && rim[p] < 128 ? 1 : 0;
            too_large += is_there && !is_wanted ? 1 : 0;
            too_small += is_wanted && !is_there ? 1 : 0;
        }
    }
    if (length == 0) return {};
    return {(too_large + too_small) / length, (too_large - too_small) / length};
}

/// Size of a pixel at the object, mean over the views.
double pixel_size_m(const SceneViews& views, const Vec3& centre) {
    double sum = 0;
    for (const Camera& camera : views.scan->cameras) sum += camera.depth(centre) / camera.fx;
    return sum / double(views.count());
}

/// Replaces the body by one of revolution if that explains the silhouettes as well.
Revolution try_revolution(const SceneViews& views, double hull_residual_px, Growing& object) {
    constexpr double kMaxExcess_px = 0.3;  // what symmetry may cost: noise of the outlines
    const Plane& support = views.scan->support_plane;
    const Mesh hull = hull_mesh(object.body, 0.0, 1.0, support);
    Revolution result;
    if (hull.empty()) return result;
    const Box3 box = bounds(hull);
    const double radius = 0.6 * box.size().head<2>().maxCoeff() + 0.01;
    double height = 0;
    for (const Vec3f& v : hull.vertices) {
        height = std::max(height, support.height(v.cast<double>()));
    }
    const Vec3 foot = find_axis_foot(object.outlines, support, box.centre(), radius, height + 0.01);
    ProfileField profile = carve_profile(object.outlines, support, foot, radius, height + 0.01,
                                         0.5 * object.body.spacing_m, 96);
    const ScalarGrid carved = object.body;
    const std::vector<BodyImage> images = object.images;
    // The largest of noisy outlines cuts a little too deep: set right by the area of the outlines.
    object.body = revolve(profile, support, foot, carved);
    render(views, kGrowth_m, object);
    const double excess_m = outline_residual(object).signed_px * pixel_size_m(views, box.centre());
    for (float& v : profile.values) v += static_cast<float>(excess_m);
    complete_poles(profile);
    object.body = revolve(profile, support, foot, carved);
    render(views, kGrowth_m, object);
    result.residual_px = outline_residual(object).absolute_px;
    log_debug("revolution: residual {:.2f} px, hull {:.2f} px, size was off by {:.2f} mm",
              result.residual_px, hull_residual_px, 1e3 * excess_m);
    result.is_found = result.residual_px < hull_residual_px + kMaxExcess_px;
    result.axis_point = foot;
    result.axis = support.normal;
    if (!result.is_found) {
        object.body = carved;
        object.images = images;
    }
    return result;
}

void note_doubtful_support(const SceneViews& views, const CandidateOptions& options,
                           Candidates& result) {
    constexpr double kMinShare = 0.15;  // an object's own footprint is less
    const SupportDoubt doubt = doubt_support(views, options.min_views, options.min_bad_fraction);
    if (doubt.doubtful_m2 < kMinShare * doubt.seen_m2) return;
    result.notes.push_back(
        fmt::format("{:.0f} % of the support surface ({:.0f} cm2) has no or wrong depth in most "
                    "views: polished metal, glass or a glossy varnish; a plane stands for it",
                    100 * doubt.doubtful_m2 / doubt.seen_m2, 1e4 * doubt.doubtful_m2));
}

Candidates outlines_only(const Capture& capture, const Scan& scan) {
    constexpr double kMinUpright = 0.5;  // 60 degrees off
    Candidates result;
    if (scan.support_plane.normal.dot(likely_up(scan.cameras)) < kMinUpright) {
        result.notes.push_back(
            "the plane with the most depth faces aside, as a wall does: no surface was seen that "
            "carries things. Take the picture from above, or put a cloth under what stands on a "
            "polished surface");
    }
    for (std::size_t i = 0; i < capture.frames.size(); ++i) {
        for (Outline& outline : find_outlines(capture.frames[i], scan.cameras[i],
                                              scan.support_plane, capture.saturation_level)) {
            result.outlines.push_back(std::move(outline));
        }
    }
    result.notes.push_back(
        fmt::format("{} view{}: {} outline{} only. A shape takes at least 3 views from around the "
                    "scene, a good "
                    "one 12; what an object is made of takes its shape",
                    capture.frames.size(), capture.frames.size() == 1 ? "" : "s",
                    result.outlines.size(), result.outlines.size() == 1 ? "" : "s"));
    return result;
}

std::string evidence_of(const Candidate& candidate, std::size_t views) {
    return fmt::format("{:.0f} % of its pixels have no or wrong depth, agreed by {} views",
                       100 * candidate.bad_depth_fraction, views);
}

Candidate finish(const SceneViews& views, const CandidateOptions& options, Growing& object) {
    Candidate candidate;
    render(views, kGrowth_m, object);
    candidate.outline_residual_px = outline_residual(object).absolute_px;
    if (options.use_symmetry) {
        candidate.revolution = try_revolution(views, candidate.outline_residual_px, object);
        if (candidate.revolution.is_found) {
            candidate.outline_residual_px = candidate.revolution.residual_px;
        }
    }
    candidate.hull = hull_mesh(object.body, 0.0, 1.0, views.scan->support_plane);
    candidate.box = bounds(candidate.hull);
    candidate.silhouettes = object.silhouettes;
    std::size_t bad = 0, all = 0, seen = 0;
    for (std::size_t i = 0; i < views.count(); ++i) {
        candidate.hidden.push_back(object.hidden[i]);
        const Mask& mask = object.silhouettes[i];
        seen += mask.empty() ? 0 : 1;
        for (std::size_t p = 0; p < mask.size(); ++p) {
            if (mask[p] < 128) continue;
            ++all;
            bad += is_bad(views.classes[i][p]) ? 1 : 0;
        }
    }
    candidate.bad_depth_fraction = all > 0 ? double(bad) / double(all) : 0.0;
    candidate.evidence = evidence_of(candidate, seen);
    return candidate;
}

}  // namespace

Candidates find_candidates(const Capture& capture, const Scan& scan,
                           const CandidateOptions& options, const Progress& progress) {
    VITRINE_CHECK_EQ(capture.frames.size(), scan.cameras.size());
    Candidates result;
    if (static_cast<int>(capture.frames.size()) < options.min_views) {
        return outlines_only(capture, scan);
    }
    progress.update(0.0, "voting for bad depth");
    SceneViews views = make_scene_views(capture, scan, {}, kMaxDepth_m);
    const Votes votes = vote(views, options);
    note_doubtful_support(views, options, result);
    std::vector<Growing> objects;
    std::vector<Box3> bodies;
    const auto add = [&](VoxelCluster cluster) {
        Growing object;
        object.cluster = std::move(cluster);
        object.body = body_of_cluster(votes.fraction, object.cluster);
        object.id = fmt::format("object_{}", objects.size());
        bodies.push_back(grown(object.cluster.box, kGrowth_m));
        objects.push_back(std::move(object));
    };
    for (const VoxelCluster& cluster : votes.clusters) {
        if (base_height(cluster, scan.support_plane) > kMaxBase_m) continue;
        if (!is_in_a_box(votes.fraction, cluster, options.boxes)) add(cluster);
    }
    for (const Box3& box : options.boxes) {
        VoxelCluster cluster = cluster_of_box(votes.fraction, box);
        if (!cluster.nodes.empty()) {
            add(std::move(cluster));
            continue;
        }
        const Vec3 centre = box.centre();
        result.notes.push_back(
            fmt::format("the box around ({:.3f}, {:.3f}, {:.3f}) m is not above the support "
                        "surface and is left out",
                        centre.x(), centre.y(), centre.z()));
    }
    require_known_edits(options, objects);
    if (objects.empty()) {
        result.notes.push_back("no region where depth is missing or wrong in several views");
        return result;
    }
    views = make_scene_views(capture, scan, bodies, kMaxDepth_m);
    for (Growing& object : objects) render(views, kGrowth_m, object);
    hide_behind_each_other(objects);
    progress.update(0.3, "predicting what is behind the candidates");
    look_behind(views, objects);
    for (int round = 0; round < options.rounds; ++round) {
        progress.update(0.5 + 0.4 * round / options.rounds, "drawing outlines");
        for (Growing& object : objects) {
            draw_outlines(views, options, objects, round == 0 ? 10.0 : 6.0, object);
            const bool is_last = round + 1 == options.rounds;
            carve_body(views, is_last ? options.hull_spacing_m : 0.003, object);
            render(views, kGrowth_m, object);
        }
        hide_behind_each_other(objects);
    }
    for (Growing& object : objects) {
        Candidate candidate = finish(views, options, object);
        candidate.id = object.id;
        if (!candidate.hull.empty()) result.objects.push_back(std::move(candidate));
    }
    progress.update(1.0, "candidates done");
    return result;
}

}  // namespace vitrine
