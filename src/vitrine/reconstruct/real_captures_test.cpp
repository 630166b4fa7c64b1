#include "reconstruct/real_captures.h"

#include "base/scratch_folder.h"
#include "image/filter.h"
#include "image/image_io.h"
#include "reconstruct/candidates.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

/// Figures are in docs/results.md; these bounds only notice when something breaks.
Candidates candidates_of(const Capture& capture, PoseMode poses, Scan& scan) {
    ScanOptions options;
    options.poses = poses;
    scan = make_scan(capture, options);
    return find_candidates(capture, scan);
}

TEST(RealCaptures, ShelfOfFifteenViewsIsFused) {
    const auto from = real_data("rgbd_shelf_15_views");
    if (!from) GTEST_SKIP() << "VITRINE_REAL_DATA is not set";
    const ScratchFolder folder("shelf");
    convert_shelf(*from, folder);
    Scan scan;
    const Candidates candidates = candidates_of(read_capture(folder), PoseMode::Refine, scan);
    EXPECT_EQ(scan.cameras.size(), 15u);
    EXPECT_LT(scan.depth_residual_m, 0.02);
    EXPECT_FALSE(candidates.objects.empty() && candidates.notes.empty());
}

TEST(RealCaptures, OneViewOfTheDeskGivesOutlines) {
    const auto from = real_data("kinect_v1_glasses");
    if (!from) GTEST_SKIP() << "VITRINE_REAL_DATA is not set";
    const ScratchFolder folder("kinect");
    convert_kinect_glasses(*from, folder);
    Scan scan;
    const Candidates candidates = candidates_of(read_capture(folder), PoseMode::Keep, scan);
    EXPECT_TRUE(candidates.objects.empty());
    ASSERT_EQ(candidates.notes.size(), 1u);
    EXPECT_NE(candidates.notes[0].find("1 view"), std::string::npos);
    // The glass and the cup, by pixels well inside each.
    std::vector<std::size_t> found;
    for (const auto& [x, y] : {std::pair{305, 150}, {287, 225}}) {
        for (std::size_t k = 0; k < candidates.outlines.size(); ++k) {
            if (is_inside(candidates.outlines[k].silhouette, x, y)) found.push_back(k);
        }
    }
    ASSERT_EQ(found.size(), 2u);
    EXPECT_NE(found[0], found[1]) << "one outline around both";
    EXPECT_LE(candidates.outlines.size(), 4u);
}

TEST(RealCaptures, BottlesOfTheD435AreOutlined) {
    const auto from = real_data("d435_transparent_pairs");
    if (!from) GTEST_SKIP() << "VITRINE_REAL_DATA is not set";
    const ScratchFolder folder("d435");
    convert_d435(*from, "000000080", "transparent", folder);
    Scan scan;
    const Candidates candidates = candidates_of(read_capture(folder), PoseMode::Keep, scan);
    const Mask truth = read_mask(*from / "000000080-mask.png");
    Mask all(truth.width(), truth.height());
    for (const Outline& outline : candidates.outlines) all = mask_or(all, outline.silhouette);
    EXPECT_GT(intersection_over_union(all, truth), 0.7);
}

}  // namespace
}  // namespace vitrine
