// pipeline/mlds_report.h: the page about a difference-scaling study.
#pragma once

#include "perception/computational_observer.h"
#include "perception/study.h"

#include <optional>
#include <string>

namespace vitrine {

struct MldsReport {
    std::string title = "Difference scaling";
    StudyAnalysis study;
    std::optional<PredictedThreshold> prediction;  ///< drawn dashed and labelled as computed
};

/// One self-contained HTML page: scales of the observers and their mean (the paper's Fig. 7), the
/// pooled scale with intervals, lambda over the index, residual diagnostics, tables.
std::string mlds_report_html(const MldsReport& report);

}  // namespace vitrine
