#include "base/progress.h"

#include "base/error.h"

#include <algorithm>

namespace vitrine {

void Progress::update(double fraction, std::string_view what) const {
    if (!callback_) return;
    const double whole = begin_ + (end_ - begin_) * std::clamp(fraction, 0.0, 1.0);
    if (!callback_(whole, what)) throw Cancelled();
}

Progress Progress::part(double begin, double end) const {
    Progress slice = *this;
    slice.begin_ = begin_ + (end_ - begin_) * begin;
    slice.end_ = begin_ + (end_ - begin_) * end;
    return slice;
}

}  // namespace vitrine
