#include "compose/composite.h"

#include "image/colour.h"
#include "image/image_io.h"

namespace vitrine {

namespace {

/// Where the photo is this much brighter than the model, something else shines there (a highlight,
/// a caustic the model lacks) that the shadow says nothing about.
constexpr float kMaxShare = 2.0f;

ImageRgb compose_fitted(const ImageRgb& plate, const DifferentialImage& difference) {
    ImageRgb picture(plate.width(), plate.height());
    const ImageRgb delta = difference.delta();
    for (std::size_t i = 0; i < picture.size(); ++i) {
        picture[i] = (1.0f - difference.coverage[i]) * (plate[i] + delta[i]) + difference.object[i];
    }
    return picture;
}

}  // namespace

DifferentialImage fitted_to_plate(const ImageRgb& plate, DifferentialImage difference) {
    VITRINE_CHECK(plate.same_size(difference.coverage));
    for (std::size_t i = 0; i < plate.size(); ++i) {
        const Rgb share = (plate[i] / difference.without[i].max(1e-6f)).max(0.0f).min(kMaxShare);
        // Light that the object takes away, direct or focused by glass: the photo knows how much of
        // it there was better than the model.
        for (Rgb* lost : {&difference.shadow[i], &difference.caustics[i]}) {
            *lost = (*lost < 0).select(*lost * share, *lost);
        }
    }
    const ImageRgb delta = difference.delta();
    for (std::size_t i = 0; i < plate.size(); ++i) {
        difference.shadow[i] += (-(plate[i] + delta[i])).max(0.0f);
    }
    return difference;
}

ImageRgb composite(const ImageRgb& plate, const DifferentialImage& difference) {
    return compose_fitted(plate, fitted_to_plate(plate, difference));
}

void write_composite_exr(const std::filesystem::path& path, const ImageRgb& plate,
                         const DifferentialImage& unfitted, const Camera& camera,
                         const CompositeWriteOptions& options) {
    const DifferentialImage difference = fitted_to_plate(plate, unfitted);
    const ImageRgb picture = compose_fitted(plate, difference);
    ExrImage exr;
    add_rgb(exr, "", picture);
    exr.channels["A"] = ImageF(picture.width(), picture.height(), 1.0f);
    add_rgb(exr, "object", difference.object);
    exr.channels["object.A"] = difference.coverage;
    add_rgb(exr, "delta", difference.delta());
    add_rgb(exr, "shadow", difference.shadow);
    add_rgb(exr, "caustics", difference.caustics);
    add_rgb(exr, "reflection", difference.reflection);
    add_rgb(exr, "refraction", difference.refraction);
    add_rgb(exr, "diffuse", difference.diffuse);
    exr.channels["Z"] = difference.geometry.z_m;
    add_rgb(exr, "albedo", difference.geometry.albedo);
    const char* axes[3] = {"normal.X", "normal.Y", "normal.Z"};
    for (int c = 0; c < 3; ++c) {
        ImageF plane(picture.width(), picture.height());
        for (std::size_t i = 0; i < plane.size(); ++i) plane[i] = difference.geometry.normal[i][c];
        exr.channels[axes[c]] = std::move(plane);
    }
    exr.matrices["worldToCamera"] = camera.cam_from_world.matrix();
    exr.attributes["software"] = "vitrine";
    exr.attributes["seed"] = fmt::format("{}", options.seed);
    write_exr(path, exr);
}

void write_composite_png(const std::filesystem::path& path, const ImageRgb& picture,
                         double linear_scale) {
    write_png(path, linear_to_srgb8(picture, static_cast<float>(1.0 / linear_scale)));
}

}  // namespace vitrine
