// base/progress.h: how a long function reports how far it is, and learns that it should stop.
#pragma once

#include <functional>
#include <string_view>

namespace vitrine {

/// Handed down by value; cheap to copy. A default one reports to nobody and never cancels.
///
/// The callback gets a fraction in [0, 1] of the whole stage and a few words; it returns false to
/// stop. It may be called from the calling thread only.
class Progress {
  public:
    using Callback = std::function<bool(double fraction, std::string_view what)>;

    Progress() = default;
    explicit Progress(Callback callback) : callback_(std::move(callback)) {}

    /// @throws Cancelled when the callback asked to stop.
    void update(double fraction, std::string_view what = {}) const;

    /// The slice [begin, end] of this progress, for a step within a stage.
    Progress part(double begin, double end) const;

  private:
    Callback callback_;
    double begin_ = 0.0;
    double end_ = 1.0;
};

}  // namespace vitrine
