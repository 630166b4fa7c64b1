// render/path_group.h: paths of neighbouring pixels, gathered and followed many together.
#pragma once

#include "render/path_tracer.h"

#include <vector>

namespace vitrine {

/// Gives every path that was added to `use(x, task, pair)`, in the order in which they came.
template <typename Use>
class PathGroup {
  public:
    /// @param tracers of which each path names one: they differ in their photons alone
    PathGroup(std::span<const PathTracer> tracers, const Vec3f& origin, Use use)
        : tracers_(tracers), origin_(origin), lists_(tracers.size()), use_(std::move(use)) {}

    /// @param x what `use` is told of the path's pixel
    void add(std::size_t tracer, int x, const PathTask& task) {
        List& list = lists_[tracer];
        entries_.push_back({x, tracer, list.tasks.size()});
        list.tasks.push_back(task);
        if (entries_.size() >= kTogether) finish();
    }
    /// Follows those that wait.
    void finish() {
        for (std::size_t t = 0; t < lists_.size(); ++t) {
            List& list = lists_[t];
            list.pairs.resize(list.tasks.size());
            tracers_[t].trace_both(origin_, list.tasks, list.pairs, workspace_);
        }
        for (const Entry& entry : entries_) {
            const List& list = lists_[entry.tracer];
            use_(entry.x, list.tasks[entry.index], list.pairs[entry.index]);
        }
        for (List& list : lists_) list.tasks.clear();
        entries_.clear();
    }

  private:
    static constexpr std::size_t kTogether = 256;
    struct Entry {
        int x;
        std::size_t tracer, index;
    };
    struct List {
        std::vector<PathTask> tasks;
        std::vector<PathPair> pairs;
    };
    std::span<const PathTracer> tracers_;
    Vec3f origin_;
    std::vector<Entry> entries_;
    std::vector<List> lists_;
    PathTracer::Workspace workspace_;
    Use use_;
};

}  // namespace vitrine
