// pipeline/insertion_measure.h: how far an inserted object's effect is from the true one.
#pragma once

#include "image/image.h"

namespace vitrine {

/// Relative errors ||D_est - D_true|| / ||D_true|| over the regions of a frame, D = with - without
/// of pictures clipped to what the sensor shows and blurred by 2 px; and the same for the noise of
/// the truth alone (`floor`).
struct InsertionError {
    double object = 0, darker = 0, brighter = 0, changed = 0, all = 0;
    double object_floor = 0, darker_floor = 0, brighter_floor = 0, changed_floor = 0, all_floor = 0;
};

/// `virtual_mask`: pixels of the inserted object. *object* is that mask eroded by 2 px; *darker*
/// and *brighter* are the pixels outside the mask dilated by 4 px where the truth changes by more
/// than 2 % of the picture's mean, by sign; `changed` is both together.
InsertionError measure_insertion(const ImageRgb& true_with, const ImageRgb& true_without,
                                 const ImageRgb& estimated_with, const ImageRgb& estimated_without,
                                 const Mask& virtual_mask, double saturation_level);

}  // namespace vitrine
