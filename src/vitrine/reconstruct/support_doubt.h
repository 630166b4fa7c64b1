// reconstruct/support_doubt.h: is the surface that carries the objects itself glass or metal?
#pragma once

#include "reconstruct/candidate_views.h"

namespace vitrine {

struct SupportDoubt {
    double doubtful_m2 = 0.0;  ///< of the support surface: most views have no or wrong depth there
    double seen_m2 = 0.0;      ///< of it: seen by at least `min_views`
};

/// Votes on the cells of the support surface as the candidates' grid votes on space. A table of
/// glass or metal is no object, but its readings are not to be trusted: the plane stands for it.
/// Cost: about 10 ns a cell and view.
SupportDoubt doubt_support(const SceneViews& views, int min_views, double min_bad_fraction);

}  // namespace vitrine
