// render/path_group.h: paths of rows of pixels, gathered and followed many together.
#pragma once

#include "base/pool.h"
#include "render/camera_rays.h"

#include <array>
#include <vector>

namespace vitrine {

/// Paths that wait until there are enough, and memory of those under way: costs about as much to
/// make as a hundred paths.
class PathGroup {
  public:
    /// @param tracers of which each path names one: they differ in their photons alone
    PathGroup(std::span<const PathTracer> tracers, const CameraRays& rays)
        : tracers_(tracers),
          rays_(rays),
          lists_(tracers.size()),
          is_mixed_(tracers.size() > 1),
          workspace_(tracers.front()) {}

  private:
    template <typename Use>
    friend class PathRow;
    static constexpr std::size_t kTogether = 128;
    struct List {
        std::array<int, kTogether> columns;
        std::array<PathTask, kTogether> tasks;
        std::array<PathPair, kTogether> pairs;
        std::size_t count = 0;  // that wait, then that are given away
        void add(int x, const PathSampler& sampler, const PathWish& wish) {
            columns[count] = x;
            tasks[count++] = {sampler, wish};
        }
        bool is_full() const { return count == kTogether; }
    };
    std::span<const PathTracer> tracers_;
    const CameraRays& rays_;
    std::vector<List> lists_;
    bool is_mixed_;                   // of several tracers
    std::vector<std::size_t> turns_;  // tracer of each path, where it is
    PathTracer::Workspace workspace_;
};

/// Gives every path that is added to `use(x, wish, pair)`, in the order in which they come.
template <typename Use>
class PathRow {
  public:
    /// @param y row of the pixels
    PathRow(PathGroup& group, int y, const Use& use) : group_(group), y_(y), use_(use) {}

    /// @param x of the path's pixel; @param sampler of stream_key(seed, x, y) and the sample's
    /// index
    void add(std::size_t tracer, int x, const PathSampler& sampler, const PathWish& wish) {
        PathGroup::List& list = group_.lists_[tracer];
        if (group_.is_mixed_) group_.turns_.push_back(tracer);
        list.add(x, sampler, wish);
        if (list.is_full()) finish();
    }
    /// Samples `begin` to `end` of a pixel, by the first tracer.
    /// @param soft_count the first so many look for soft light
    void add(int x, const PathSampler& pixel, int begin, int end, int soft_count) {
        PathGroup::List& list = group_.lists_[0];
        const int soft_end = begin + soft_count;
        while (begin < end) {
            const int room = static_cast<int>(PathGroup::kTogether - list.count);
            const int last = std::min(end, begin + room);
            for (; begin < last; ++begin) {
                list.add(x, pixel.at(static_cast<std::uint32_t>(begin)), {begin < soft_end, 1});
            }
            if (list.is_full()) finish();
        }
    }
    /// Follows those that wait: to be called at the end.
    void finish() {
        std::vector<PathGroup::List>& lists = group_.lists_;
        for (std::size_t t = 0; t < lists.size(); ++t) {
            PathGroup::List& list = lists[t];
            const std::span tasks = std::span(list.tasks).first(list.count);
            group_.rays_.aim(list.columns, y_, tasks, group_.workspace_.start(list.count));
            group_.tracers_[t].trace_both(tasks, std::span(list.pairs).first(list.count),
                                          group_.workspace_);
        }
        if (group_.is_mixed_) {
            for (PathGroup::List& list : lists) list.count = 0;
            for (const std::size_t turn : group_.turns_) use(lists[turn], lists[turn].count++);
            group_.turns_.clear();
        } else {
            for (std::size_t k = 0; k < lists[0].count; ++k) use(lists[0], k);
        }
        for (PathGroup::List& list : lists) list.count = 0;
    }

  private:
    void use(const PathGroup::List& list, std::size_t k) {
        use_(list.columns[k], list.tasks[k].wish, list.pairs[k]);
    }
    PathGroup& group_;
    int y_;
    const Use& use_;
};

}  // namespace vitrine
