// pipeline/transfer_report.h: the page that shows what a material transfer saw and did.
#pragma once

#include "pipeline/transfer_recipe.h"

namespace vitrine {

/// Writes report.html: both photos, result with slider, lights on a ball, profile per channel,
/// shape, residual, warnings in plain words. One file, opens from disk.
/// @param source nullptr when a ready material was used
void write_transfer_report(const std::filesystem::path& path, const LiftedMaterial* source,
                           const MediumEstimate& medium, const PhotoAnalysis& target,
                           const TransferPicture& result, const TransferSummary& summary);

}  // namespace vitrine
