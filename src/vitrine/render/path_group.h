// render/path_group.h: paths of a row of pixels, gathered and followed many together.
#pragma once

#include "render/camera_rays.h"

#include <vector>

namespace vitrine {

/// Gives every path that was added to `use(x, wish, pair)`, in the order in which they came.
template <typename Use>
class PathGroup {
  public:
    /// @param tracers of which each path names one: they differ in their photons alone
    /// @param y first row of the pixels
    PathGroup(std::span<const PathTracer> tracers, const CameraRays& rays, const Vec3f& origin,
              int y, Use use)
        : tracers_(tracers),
          rays_(rays),
          origin_(origin),
          y_(y),
          lists_(tracers.size()),
          workspace_(tracers.front()),
          use_(std::move(use)) {}

    /// Those that follow are of row `y`; those that wait are followed.
    void begin_row(int y) {
        finish();
        y_ = y;
    }
    /// @param x of the path's pixel; @param sampler of stream_key(seed, x, y) and the sample's
    /// index
    void add(std::size_t tracer, int x, const PathSampler& sampler, const PathWish& wish) {
        List& list = lists_[tracer];
        if (lists_.size() > 1) turns_.push_back(tracer);
        list.columns[list.count] = x;
        PathTask& task = list.tasks[list.count++];
        task.sample.sampler = sampler;
        task.wish = wish;
        if (++count_ >= kTogether) finish();
    }
    /// Follows those that wait.
    void finish() {
        for (std::size_t t = 0; t < lists_.size(); ++t) {
            List& list = lists_[t];
            const std::span tasks = std::span(list.tasks).first(list.count);
            rays_.aim(list.columns, y_, tasks);
            tracers_[t].trace_both(origin_, tasks, std::span(list.pairs).first(list.count),
                                   workspace_);
            list.count = 0;
        }
        for (std::size_t i = 0; i < count_; ++i) {
            List& list = lists_[lists_.size() > 1 ? turns_[i] : 0];
            const std::size_t k = list.count++;
            use_(list.columns[k], list.tasks[k].wish, list.pairs[k]);
        }
        for (List& list : lists_) list.count = 0;
        turns_.clear();
        count_ = 0;
    }

  private:
    static constexpr std::size_t kTogether = 128;
    struct List {
        std::vector<int> columns = std::vector<int>(kTogether);
        std::vector<PathTask> tasks = std::vector<PathTask>(kTogether);
        std::vector<PathPair> pairs = std::vector<PathPair>(kTogether);
        std::size_t count = 0;  // that wait, then that are given away
    };
    std::span<const PathTracer> tracers_;
    const CameraRays& rays_;
    Vec3f origin_;
    int y_;
    std::vector<List> lists_;
    std::vector<std::size_t> turns_;  // tracer of each path, where there are several
    std::size_t count_ = 0;
    PathTracer::Workspace workspace_;
    Use use_;
};

}  // namespace vitrine
