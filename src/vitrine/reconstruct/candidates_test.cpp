#include "base/parallel.h"
#include "image/filter.h"
#include "reconstruct/labelled_scene.h"
#include "reconstruct/support_doubt.h"
#include "reconstruct/tiny_world.h"
#include "trace/accel.h"

#include <gtest/gtest.h>

#include <cstring>

namespace vitrine {
namespace {

TEST(Candidates, NoneAmongDiffuseThings) {
    TinyWorldOptions options;
    options.has_liar = false;
    const TinyWorld world = make_tiny_world(options);
    const Scan scan = make_scan(world.capture, kept_poses());
    EXPECT_TRUE(find_candidates(world.capture, scan).objects.empty());
}

TEST(Candidates, FindsTheOneObjectWhoseDepthLies) {
    const TinyWorld world = make_tiny_world();
    const Scan scan = make_scan(world.capture, kept_poses());
    CandidateOptions options;
    options.hull_spacing_m = 0.002;
    const Candidates candidates = find_candidates(world.capture, scan, options);
    ASSERT_EQ(candidates.objects.size(), 1u);
    const Candidate& ball = candidates.objects[0];
    double sum = 0;
    for (std::size_t i = 0; i < world.liar_masks.size(); ++i) {
        sum += intersection_over_union(ball.silhouettes[i], world.liar_masks[i]);
    }
    EXPECT_GT(sum / double(world.liar_masks.size()), 0.93);
    EXPECT_TRUE(find_defects(ball.hull).is_closed());
    EXPECT_TRUE(ball.revolution.is_found);
    EXPECT_LT((ball.revolution.axis_point - Vec3(0, 0, 0)).norm(), 1e-3);
    EXPECT_NEAR(volume(ball.hull), 4.0 / 3 * kPi * std::pow(0.04, 3), 0.1 * volume(ball.hull));

    const Scene scene = build_scene(scan, candidates);
    ASSERT_EQ(scene.parts.size(), 2u);
    EXPECT_EQ(scene.parts[0].name, "scan");
    EXPECT_EQ(scene.parts[1].name, ball.id);
    // Under and behind the ball the table is whole and flat.
    const Accel accel(std::vector<AccelPart>{{scene.parts[0].mesh}});
    for (double a = 0; a < 2 * kPi; a += 0.5) {
        const Vec3f from(static_cast<float>(0.03 * std::cos(a)),
                         static_cast<float>(0.03 * std::sin(a)), 0.1f);
        const Hit hit = accel.closest({from, Vec3f(0, 0, -1)});
        ASSERT_TRUE(hit.is_hit());
        EXPECT_NEAR(hit.distance, 0.1f, 1e-3f);
        EXPECT_GT(hit.normal.z(), 0.999f);
    }
}

TEST(Candidates, AnEditedSilhouetteWins) {
    const TinyWorld world = make_tiny_world(small_tiny_world());
    const Scan scan = make_scan(world.capture, kept_poses());
    CandidateOptions options;
    options.hull_spacing_m = 0.004;
    options.edited_silhouettes[{"object_0", "000002"}] = erode(world.liar_masks[2], 2);
    const Candidates candidates = find_candidates(world.capture, scan, options);
    ASSERT_EQ(candidates.objects.size(), 1u);
    EXPECT_EQ(intersection_over_union(candidates.objects[0].silhouettes[2],
                                      erode(world.liar_masks[2], 2)),
              1.0);
    options.edited_silhouettes[{"object_0", "000002"}] = Mask(5, 5);
    EXPECT_THROW(find_candidates(world.capture, scan, options), InputError);
    options.edited_silhouettes.clear();
    options.edited_silhouettes[{"object_7", "000002"}] = world.liar_masks[2];
    try {
        find_candidates(world.capture, scan, options);
        FAIL() << "an edit of nothing was taken";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("one of object_0"), std::string::npos);
    }
}

TEST(Candidates, ABoxMakesOneAndReplacesWhatWasFoundInIt) {
    const TinyWorld world = make_tiny_world(small_tiny_world());
    const Scan scan = make_scan(world.capture, kept_poses());
    CandidateOptions options;
    options.hull_spacing_m = 0.004;
    Box3 ball, painted, nowhere;
    ball.extend(Vec3(-0.05, -0.05, 0.0));
    ball.extend(Vec3(0.05, 0.05, 0.09));
    painted.extend(Vec3(-0.18, -0.22, 0.0));  // around the flat box, whose depth is right
    painted.extend(Vec3(-0.06, -0.10, 0.06));
    nowhere.extend(Vec3(7, 7, 0.0));
    nowhere.extend(Vec3(7.1, 7.1, 0.1));
    options.boxes = {ball, painted, nowhere};
    const Candidates candidates = find_candidates(world.capture, scan, options);
    ASSERT_EQ(candidates.objects.size(), 2u);
    EXPECT_LT((candidates.objects[0].box.centre() - Vec3(0, 0, 0.04)).norm(), 0.01);
    EXPECT_LT((candidates.objects[1].box.centre() - Vec3(-0.12, -0.16, 0.025)).norm(), 0.02);
    ASSERT_EQ(candidates.notes.size(), 1u);
    EXPECT_NE(candidates.notes[0].find("(7.050, 7.050, 0.050)"), std::string::npos);
}

TEST(SupportDoubt, MeasuresTheTableThatGivesNoDepth) {
    TinyWorldOptions options = small_tiny_world();
    options.has_liar = false;
    TinyWorld world = make_tiny_world(options);
    const auto doubt_of = [](const Capture& capture) {
        const Scan scan = make_scan(capture, kept_poses());
        return doubt_support(make_scene_views(capture, scan, {}, 2.0), 3, 0.6);
    };
    const SupportDoubt none = doubt_of(world.capture);
    EXPECT_GT(none.seen_m2, 0.1);
    EXPECT_LT(none.doubtful_m2, 0.002);
    for (RgbdFrame& frame : world.capture.frames) {
        for (int y = 0; y < frame.depth_m.height(); ++y) {
            for (int x = 0; x < frame.depth_m.width(); ++x) {
                const Vec3 p = frame.camera.unproject(x, y, frame.depth_m(x, y));
                if (std::hypot(p.x() + 0.02, p.y() - 0.03) < 0.08 && p.z() < 0.004) {
                    frame.depth_m(x, y) = 0;
                }
            }
        }
    }
    EXPECT_NEAR(doubt_of(world.capture).doubtful_m2, kPi * 0.08 * 0.08, 0.006);
}

TEST(Candidates, OneViewOfAWallSaysSo) {
    TinyWorldOptions options;
    options.views = 1;
    const TinyWorld world = make_tiny_world(options);
    Scan scan = make_scan(world.capture, kept_poses());
    EXPECT_EQ(find_candidates(world.capture, scan).notes.size(), 1u);
    const Camera& camera = scan.cameras[0];
    const Vec3 aside = camera.cam_from_world.rotation.transpose() * Vec3(-0.8, 0, -0.6);
    scan.support_plane = {aside, aside.dot(camera.centre_in_world()) - 0.6};
    const Candidates candidates = find_candidates(world.capture, scan);
    ASSERT_EQ(candidates.notes.size(), 2u);
    EXPECT_NE(candidates.notes[0].find("as a wall does"), std::string::npos);
}

TEST(Candidates, SameBitsForAnyThreadCount) {
    const TinyWorld world = make_tiny_world(small_tiny_world());
    CandidateOptions options;
    options.hull_spacing_m = 0.003;
    std::vector<Vec3f> first;
    for (const int threads : {1, 2}) {
        set_thread_count(threads);
        const Scan scan = make_scan(world.capture);
        const Candidates candidates = find_candidates(world.capture, scan, options);
        std::vector<Vec3f> all = scan.mesh.vertices;
        for (const Candidate& c : candidates.objects) {
            all.insert(all.end(), c.hull.vertices.begin(), c.hull.vertices.end());
        }
        if (threads == 1) {
            first = all;
        } else {
            ASSERT_EQ(all.size(), first.size());
            EXPECT_EQ(std::memcmp(all.data(), first.data(), all.size() * sizeof(Vec3f)), 0);
        }
    }
    set_thread_count(0);
}

}  // namespace
}  // namespace vitrine
