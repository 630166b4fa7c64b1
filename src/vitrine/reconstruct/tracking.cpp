#include "reconstruct/tracking.h"

#include "base/log.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "capture/read_capture.h"
#include "reconstruct/scan.h"

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include <algorithm>
#include <set>

namespace vitrine {
namespace {

constexpr float kMaxRatio = 0.9f;         // best to second-best descriptor distance
constexpr double kMaxDepthStep_m = 0.01;  // around a feature: beyond, its depth is not its own
constexpr double kBaseTolerance_m = 0.004;
constexpr std::size_t kLostRounds = 4;
constexpr std::size_t kLostPartners = 24;  // tracked frames that a lost one is compared with

struct Features {
    std::vector<Vec3> points;  ///< in the camera
    cv::Mat descriptors;       ///< a row each, Hellinger-normalised
};

/// Depth of a feature: the median around it; 0 at edges and holes.
double depth_at(const ImageF& depth, double u, double v) {
    const int x = static_cast<int>(std::lround(u)), y = static_cast<int>(std::lround(v));
    std::vector<float> values;
    for (int dy = -2; dy <= 2; ++dy) {
        for (int dx = -2; dx <= 2; ++dx) {
            if (!depth.contains(x + dx, y + dy)) return 0;
            if (depth(x + dx, y + dy) > 0) values.push_back(depth(x + dx, y + dy));
        }
    }
    if (values.size() < 18) return 0;
    std::sort(values.begin(), values.end());
    if (values.back() - values.front() > kMaxDepthStep_m) return 0;
    return values[values.size() / 2];
}

Features find_features(const RgbdFrame& frame, int max_features) {
    const ImageRgb& colour = frame.colour;
    // Square-root encoded and stretched: dim scenes have features too.
    std::vector<float> bright;
    for (std::size_t i = 0; i < colour.size(); i += 5) bright.push_back(luminance(colour[i]));
    const auto high = bright.begin() + static_cast<std::ptrdiff_t>(0.98 * double(bright.size()));
    std::nth_element(bright.begin(), high, bright.end());
    const float scale = 255.0f / std::sqrt(std::max(*high, 1e-6f));
    cv::Mat grey(colour.height(), colour.width(), CV_8U);
    for (int y = 0; y < colour.height(); ++y) {
        for (int x = 0; x < colour.width(); ++x) {
            const float value = scale * std::sqrt(std::max(0.0f, luminance(colour(x, y))));
            grey.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(std::min(value, 255.0f));
        }
    }
    std::vector<cv::KeyPoint> keys;
    cv::Mat descriptors;
    // A low contrast threshold: table tops are faint.
    cv::SIFT::create(2 * max_features, 3, 0.01, 12)
        ->detectAndCompute(grey, cv::noArray(), keys, descriptors);
    Features features;
    for (std::size_t i = 0; i < keys.size(); ++i) {
        if (features.points.size() >= static_cast<std::size_t>(max_features)) break;
        const double z = depth_at(frame.depth_m, keys[i].pt.x, keys[i].pt.y);
        if (z <= 0) continue;
        features.points.push_back(z * frame.camera.ray_in_camera(keys[i].pt.x, keys[i].pt.y));
        cv::Mat row = descriptors.row(static_cast<int>(i)).clone();
        cv::Mat root;
        cv::sqrt(row / std::max(cv::norm(row, cv::NORM_L1), 1e-9), root);
        features.descriptors.push_back(root);
    }
    return features;
}

/// Pairs that are each other's best match and clearly better than the second.
std::vector<std::pair<int, int>> match(const Features& a, const Features& b) {
    std::vector<std::pair<int, int>> matches;
    if (a.points.size() < 3 || b.points.size() < 3) return matches;
    // Unit vectors: the distance is 2 - 2 dot.
    const cv::Mat dots = a.descriptors * b.descriptors.t();
    std::vector<int> best_of_b(b.points.size(), -1);
    std::vector<float> best_dot_of_b(b.points.size(), -1.0f);
    for (int i = 0; i < dots.rows; ++i) {
        for (int j = 0; j < dots.cols; ++j) {
            const auto k = static_cast<std::size_t>(j);
            if (dots.at<float>(i, j) > best_dot_of_b[k]) {
                best_dot_of_b[k] = dots.at<float>(i, j);
                best_of_b[k] = i;
            }
        }
    }
    for (int i = 0; i < dots.rows; ++i) {
        float first = -1, second = -1;
        int best = -1;
        for (int j = 0; j < dots.cols; ++j) {
            const float dot = dots.at<float>(i, j);
            if (dot > first) {
                second = first;
                first = dot;
                best = j;
            } else {
                second = std::max(second, dot);
            }
        }
        const float ratio = std::sqrt(std::max(0.0f, 1 - first) / std::max(1e-9f, 1 - second));
        if (ratio < kMaxRatio && best_of_b[static_cast<std::size_t>(best)] == i) {
            matches.emplace_back(i, best);
        }
    }
    return matches;
}

struct Link {
    std::size_t a = 0, b = 0;
    Rigid3 b_from_a;
    int matches = 0, inliers = 0;
};

Link connect(const Features& fa, const Features& fb, Link link, int trials) {
    const std::vector<std::pair<int, int>> matches = match(fa, fb);
    std::vector<Vec3> from, to;
    for (const auto& [i, j] : matches) {
        from.push_back(fa.points[static_cast<std::size_t>(i)]);
        to.push_back(fb.points[static_cast<std::size_t>(j)]);
    }
    if (from.size() < 4) return link;
    link.matches = static_cast<int>(from.size());
    const auto inliers_of = [&](const Rigid3& motion) {
        std::vector<std::size_t> inliers;
        for (std::size_t k = 0; k < from.size(); ++k) {
            const double tolerance = kBaseTolerance_m + 2 * depth_noise_m(to[k].z());
            if ((motion * from[k] - to[k]).norm() < tolerance) inliers.push_back(k);
        }
        return inliers;
    };
    const auto fit = [&](const std::vector<std::size_t>& chosen) {
        std::vector<Vec3> p, q;
        for (const std::size_t k : chosen) p.push_back(from[k]), q.push_back(to[k]);
        return align_points(p, q);
    };
    std::vector<std::size_t> best;
    for (int trial = 0; trial < trials; ++trial) {
        Rng rng(stream_key(0x7ac4, link.a, link.b, trial));
        std::vector<std::size_t> three;
        for (int k = 0; k < 3; ++k) {
            three.push_back(rng.next_index(static_cast<std::uint32_t>(from.size())));
        }
        // Three points on a line, or twice the same, fix no rotation.
        const Vec3 cross = (from[three[1]] - from[three[0]]).cross(from[three[2]] - from[three[0]]);
        if (cross.norm() < 1e-3) continue;
        const std::vector<std::size_t> inliers = inliers_of(fit(three));
        if (inliers.size() > best.size()) best = inliers;
    }
    if (best.size() < 4) return link;
    for (int round = 0; round < 3; ++round) {
        link.b_from_a = fit(best);
        best = inliers_of(link.b_from_a);
        if (best.size() < 4) return link;
    }
    link.inliers = static_cast<int>(best.size());
    return link;
}

/// Neighbours in time and marks from afar; of few frames all pairs.
std::vector<Link> pairs_to_try(std::size_t count, std::size_t all_pairs_up_to) {
    std::vector<Link> links;
    for (std::size_t a = 0; a < count; ++a) {
        for (std::size_t b = a + 1; b < count; ++b) {
            const bool are_near = b - a <= 4, are_marks = a % 10 == 0 && b % 10 == 0;
            if (count <= all_pairs_up_to || are_near || are_marks)
                links.push_back({a, b, {}, 0, 0});
        }
    }
    return links;
}

/// Many points that move as one body; or fewer, when most matches do: wrong ones scatter.
bool is_connection(const Link& link, const TrackingOptions& options) {
    return link.inliers >= options.min_inliers ||
           (link.inliers >= options.min_agreeing &&
            double(link.inliers) >= options.min_agreement * double(link.matches));
}

/// Prim's algorithm from one frame: the strongest link that leaves the tree, again and again.
Tracking grow_tree(const Capture& capture, const std::vector<Link>& links, std::size_t root,
                   const TrackingOptions& options) {
    const std::size_t count = capture.frames.size();
    Tracking tracking;
    tracking.cameras = cameras_of(capture);
    tracking.is_tracked.assign(count, false);
    tracking.inliers.assign(count, 0);
    tracking.is_tracked[root] = true;
    tracking.cameras[root].cam_from_world = Rigid3();
    for (std::size_t placed = 1; placed < count; ++placed) {
        const Link* best = nullptr;
        for (const Link& link : links) {
            if (tracking.is_tracked[link.a] == tracking.is_tracked[link.b]) continue;
            if (is_connection(link, options) && (!best || link.inliers > best->inliers)) {
                best = &link;
            }
        }
        if (!best) break;
        const bool is_forward = tracking.is_tracked[best->a];
        const std::size_t known = is_forward ? best->a : best->b;
        const std::size_t fresh = is_forward ? best->b : best->a;
        const Rigid3 step = is_forward ? best->b_from_a : best->b_from_a.inverse();
        tracking.cameras[fresh].cam_from_world = step * tracking.cameras[known].cam_from_world;
        tracking.is_tracked[fresh] = true;
        tracking.inliers[fresh] = best->inliers;
        log_debug("tracking: frame {} from {} by {} points", capture.frames[fresh].id,
                  capture.frames[known].id, best->inliers);
    }
    return tracking;
}

std::size_t tracked_frames(const Tracking& tracking) {
    return static_cast<std::size_t>(
        std::count(tracking.is_tracked.begin(), tracking.is_tracked.end(), true));
}

/// The largest group of connected frames.
Tracking largest_group(const Capture& capture, const std::vector<Link>& links,
                       const TrackingOptions& options) {
    Tracking best;
    std::size_t most = 0;
    std::vector<bool> is_seen(capture.frames.size(), false);
    for (std::size_t root = 0; root < is_seen.size(); ++root) {
        if (is_seen[root]) continue;
        Tracking tracking = grow_tree(capture, links, root, options);
        for (std::size_t i = 0; i < is_seen.size(); ++i) {
            is_seen[i] = is_seen[i] || tracking.is_tracked[i];
        }
        const std::size_t size = tracked_frames(tracking);
        if (size > most) {
            most = size;
            best = std::move(tracking);
        }
    }
    return best;
}

/// Untried pairs between each lost frame and frames spread over those that are tracked: the camera
/// may come back to a place, and frames next in time may lie far apart in space.
std::vector<Link> pairs_of_lost(const Tracking& tracking, std::size_t partners, std::size_t round,
                                std::set<std::pair<std::size_t, std::size_t>>& tried) {
    std::vector<std::size_t> known;
    for (std::size_t i = 0; i < tracking.is_tracked.size(); ++i) {
        if (tracking.is_tracked[i]) known.push_back(i);
    }
    const std::size_t step = std::max<std::size_t>(1, known.size() / partners);
    std::vector<Link> links;
    for (std::size_t lost = 0; lost < tracking.is_tracked.size(); ++lost) {
        if (tracking.is_tracked[lost]) continue;
        for (std::size_t k = round % step; k < known.size(); k += step) {
            const auto [a, b] = std::pair(std::min(lost, known[k]), std::max(lost, known[k]));
            if (tried.emplace(a, b).second) links.push_back({a, b, {}, 0, 0});
        }
    }
    return links;
}

}  // namespace

Tracking track_poses(const Capture& capture, const TrackingOptions& options,
                     const Progress& progress) {
    const std::size_t count = capture.frames.size();
    cv::setNumThreads(1);  // our own loop is over frames
    std::vector<Features> features(count);
    parallel_for(count, 1, [&](std::size_t i) {
        features[i] = find_features(capture.frames[i], options.max_features);
    });
    progress.update(0.3, "matching views");
    std::vector<Link> links;
    std::set<std::pair<std::size_t, std::size_t>> tried;
    const auto connect_all = [&](std::vector<Link> pairs) {
        parallel_for(pairs.size(), 1, [&](std::size_t k) {
            Link& link = pairs[k];
            link = connect(features[link.a], features[link.b], link, options.trials);
        });
        links.insert(links.end(), pairs.begin(), pairs.end());
    };
    std::vector<Link> first =
        pairs_to_try(count, static_cast<std::size_t>(options.all_pairs_up_to));
    for (const Link& link : first) tried.emplace(link.a, link.b);
    connect_all(std::move(first));
    Tracking tracking = largest_group(capture, links, options);
    for (std::size_t round = 0; round < kLostRounds && tracked_frames(tracking) < count; ++round) {
        progress.update(0.6 + 0.1 * double(round), "looking for lost frames");
        std::vector<Link> pairs = pairs_of_lost(tracking, kLostPartners, round, tried);
        if (pairs.empty()) break;
        connect_all(std::move(pairs));
        tracking = largest_group(capture, links, options);
    }
    return tracking;
}

}  // namespace vitrine
