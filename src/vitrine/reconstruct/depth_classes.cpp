#include "reconstruct/depth_classes.h"

#include "image/filter.h"
#include "reconstruct/scan.h"

namespace vitrine {
namespace {

/// Turns runs without reading into Shadow where the step of depth across them explains their width:
/// a step from z1 to z2 hides baseline * f * |1/z1 - 1/z2| pixels from the projector.
void mark_shadows(const ImageF& measured, double focal_baseline, DepthClasses& classes) {
    constexpr double kSlackPx = 2.0;  // sensors lose a pixel on each side of a step as well
    const auto scan_line = [&](int count, const auto& depth_at, const auto& class_at) {
        int begin = 0;
        while (begin < count) {
            if (depth_at(begin) > 0) {
                ++begin;
                continue;
            }
            int end = begin;
            while (end < count && !(depth_at(end) > 0)) ++end;
            if (begin > 0 && end < count) {
                const double step = std::abs(1.0 / depth_at(begin - 1) - 1.0 / depth_at(end));
                if (end - begin <= focal_baseline * step + kSlackPx) {
                    for (int i = begin; i < end; ++i) {
                        DepthClass& c = class_at(i);
                        if (c == DepthClass::Zero) c = DepthClass::Shadow;
                    }
                }
            }
            begin = end;
        }
    };
    for (int y = 0; y < measured.height(); ++y) {
        scan_line(
            measured.width(), [&](int i) { return measured(i, y); },
            [&](int i) -> DepthClass& { return classes(i, y); });
    }
}

}  // namespace

DepthClasses classify_depth(const ImageF& measured_m, const ImageF& model_m, const Camera& camera,
                            double max_depth_m, double baseline_m) {
    VITRINE_CHECK(measured_m.same_size(model_m));
    DepthClasses classes(measured_m.width(), measured_m.height());
    for (std::size_t i = 0; i < classes.size(); ++i) {
        const double z = measured_m[i], model = model_m[i];
        if (model <= 0 || model > max_depth_m) {
            classes[i] = z > 0 && z < 0.8 * max_depth_m ? DepthClass::Front : DepthClass::Unknown;
        } else if (z <= 0) {
            classes[i] = DepthClass::Zero;
        } else {
            // On oblique surfaces half a pixel of misregistration is depth as well.
            const double slack = 3 * depth_noise_m(model) + 0.5 * model / camera.fx;
            classes[i] = z > model + slack   ? DepthClass::Through
                         : z < model - slack ? DepthClass::Front
                                             : DepthClass::Ok;
        }
    }
    mark_shadows(measured_m, baseline_m * camera.fx, classes);
    return classes;
}

Mask bad_regions(const DepthClasses& classes, int closing_px) {
    Mask bad(classes.width(), classes.height());
    for (std::size_t i = 0; i < bad.size(); ++i) bad[i] = is_bad(classes[i]) ? 255 : 0;
    const Mask opened = dilate(erode(bad, 1), 1);
    return erode(dilate(opened, closing_px), closing_px);
}

}  // namespace vitrine
