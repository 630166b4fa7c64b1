#include "capture/photo.h"

#include "image/colour.h"
#include "image/filter.h"
#include "image/image_io.h"

#include <opencv2/imgproc.hpp>

#include <fstream>

namespace vitrine {
namespace {

bool is_exr_file(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    unsigned char head[4] = {};
    in.read(reinterpret_cast<char*>(head), 4);
    return in && head[0] == 0x76 && head[1] == 0x2f && head[2] == 0x31 && head[3] == 0x01;
}

ImageRgb to_rgb(const RasterImage& raster, bool is_linear) {
    const float scale = 1.0f / static_cast<float>((1 << raster.bits) - 1);
    ImageRgb image(raster.width, raster.height);
    for (std::size_t i = 0; i < image.size(); ++i) {
        const std::uint16_t* code = &raster.codes[i * static_cast<std::size_t>(raster.channels)];
        for (int c = 0; c < 3; ++c) {
            const float value = static_cast<float>(code[raster.channels < 3 ? 0 : c]) * scale;
            image[i][c] = is_linear ? value : srgb_to_linear(value);
        }
    }
    return image;
}

/// The alpha channel as a mask, when there is one that says something.
std::optional<Mask> alpha_mask(const RasterImage& raster) {
    if (raster.channels != 2 && raster.channels != 4) return std::nullopt;
    Mask mask(raster.width, raster.height);
    const auto channels = static_cast<std::size_t>(raster.channels);
    const int half = (1 << raster.bits) / 2;
    for (std::size_t i = 0; i < mask.size(); ++i)
        mask[i] = raster.codes[i * channels + channels - 1] >= half ? 255 : 0;
    const std::size_t inside = count_inside(mask);
    if (inside == 0 || inside == mask.size()) return std::nullopt;
    return mask;
}

void check_mask(const Photo& photo, const std::string& where, double min_inradius_px) {
    const std::string hint = "Paint the object white on black, at the size of the photo.";
    if (!photo.mask.same_size(photo.linear)) {
        throw InputError({where,
                          fmt::format("a mask of {} x {} pixels like the photo",
                                      photo.linear.width(), photo.linear.height()),
                          fmt::format("{} x {}", photo.mask.width(), photo.mask.height()), hint});
    }
    const std::size_t inside = count_inside(photo.mask);
    if (inside == 0)
        throw InputError({where, "a mask with the object inside", "an empty mask", hint});
    if (inside == photo.mask.size()) {
        throw InputError(
            {where, "a mask that leaves some background", "a mask that is full", hint});
    }
    const double radius = inradius_px(photo.mask);
    if (radius < min_inradius_px) {
        throw InputError(
            {where, fmt::format("an object at least {:.0f} pixels thick", 2 * min_inradius_px),
             fmt::format("one of {:.1f} pixels", 2 * radius),
             "Use a photo in which the object is larger, or enlarge photo and mask."});
    }
}

void add_warnings(Photo& photo) {
    std::size_t inside = 0, clipped = 0, on_border = 0;
    Rgbd sum = Rgbd::Zero();
    for (int y = 0; y < photo.mask.height(); ++y) {
        for (int x = 0; x < photo.mask.width(); ++x) {
            if (!is_inside(photo.mask, x, y)) continue;
            ++inside;
            sum += photo.linear(x, y).cast<double>();
            if ((photo.linear(x, y) >= static_cast<float>(0.98 * photo.saturation_level)).all())
                ++clipped;
            if (x == 0 || y == 0 || x + 1 == photo.mask.width() || y + 1 == photo.mask.height())
                ++on_border;
        }
    }
    const Rgbd mean = sum / static_cast<double>(inside);
    if (clipped > 0.02 * static_cast<double>(inside)) {
        photo.warnings.push_back(fmt::format(
            "{}: over-exposed, {:.0f} % of the object is clipped to white; what is lost there "
            "cannot be recovered.",
            photo.name, 100.0 * static_cast<double>(clipped) / static_cast<double>(inside)));
    }
    const double darkest = 0.02 * std::min(photo.saturation_level, mean.maxCoeff() * 3);
    const char* names[3] = {"red", "green", "blue"};
    for (int c = 0; c < 3; ++c) {
        if (mean[c] < darkest) {
            photo.warnings.push_back(
                fmt::format("{}: the {} channel of the object is almost black; the hue of its "
                            "scattering is unreliable.",
                            photo.name, names[c]));
        }
    }
    if (on_border > 0) {
        photo.warnings.push_back(photo.name +
                                 ": the object is cut off by the edge of the photo; its shape "
                                 "there is guessed.");
    }
}

}  // namespace

double inradius_px(const Mask& mask) {
    Mask padded(mask.width() + 2, mask.height() + 2, 255);
    for (int y = 0; y < mask.height(); ++y)
        for (int x = 0; x < mask.width(); ++x)
            padded(x + 1, y + 1) = is_inside(mask, x, y) ? 0 : 255;
    float radius = 0;
    for (const float distance : distance_to(padded)) radius = std::max(radius, distance);
    return radius;
}

Mask largest_piece_filled(const Mask& mask) {
    const cv::Mat input(mask.height(), mask.width(), CV_8UC1,
                        const_cast<std::uint8_t*>(mask.data()));
    cv::Mat labels, stats, centres;
    const int count = cv::connectedComponentsWithStats(input > 127, labels, stats, centres, 8);
    int largest = 0;
    for (int k = 1; k < count; ++k) {
        if (largest == 0 ||
            stats.at<int>(k, cv::CC_STAT_AREA) > stats.at<int>(largest, cv::CC_STAT_AREA)) {
            largest = k;
        }
    }
    Mask result(mask.width(), mask.height());
    if (largest == 0) return result;
    // Filled: whatever the background cannot reach from the (padded) border.
    cv::Mat outside = labels != largest;
    cv::copyMakeBorder(outside, outside, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(255));
    cv::floodFill(outside, cv::Point(0, 0), cv::Scalar(128));
    for (int y = 0; y < mask.height(); ++y)
        for (int x = 0; x < mask.width(); ++x)
            result(x, y) = outside.at<std::uint8_t>(y + 1, x + 1) == 128 ? 0 : 255;
    return result;
}

Mask segment_box(const ImageRgb& linear, const PixelBox& box, const std::string& name) {
    const int width = linear.width(), height = linear.height();
    if (box.width() < 8 || box.height() < 8 || box.x0 < 0 || box.y0 < 0 || box.x1 > width ||
        box.y1 > height) {
        throw InputError({name, fmt::format("a box x,y,w,h within {} x {} pixels", width, height),
                          fmt::format("{},{},{},{}", box.x0, box.y0, box.width(), box.height()),
                          ""});
    }
    cv::Mat picture(height, width, CV_8UC3);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            cv::Vec3b& pixel = picture.at<cv::Vec3b>(y, x);
            for (int c = 0; c < 3; ++c) {
                pixel[2 - c] = static_cast<std::uint8_t>(
                    std::lround(255.0f * linear_to_srgb(linear(x, y)[c])));
            }
        }
    }
    constexpr double kSegmentedPixels = 3e5;  // GrabCut is slow, and contours are smoothed anyway
    const double shrink =
        std::min(1.0, std::sqrt(kSegmentedPixels / (static_cast<double>(width) * height)));
    cv::Mat small;
    cv::resize(picture, small, cv::Size(), shrink, shrink, cv::INTER_AREA);

    // Background for sure beyond the box; the middle of its ellipse is the object for sure.
    cv::Mat trimap(small.size(), CV_8UC1, cv::Scalar(cv::GC_BGD));
    for (int y = 0; y < small.rows; ++y) {
        for (int x = 0; x < small.cols; ++x) {
            const double u = ((x + 0.5) / shrink - box.x0) / box.width() * 2 - 1;
            const double v = ((y + 0.5) / shrink - box.y0) / box.height() * 2 - 1;
            if (std::max(std::abs(u), std::abs(v)) >= 1) continue;
            const double radius = std::hypot(u, v);
            trimap.at<std::uint8_t>(y, x) = radius < 0.35  ? cv::GC_FGD
                                            : radius < 1.0 ? cv::GC_PR_FGD
                                                           : cv::GC_PR_BGD;
        }
    }
    cv::Mat background_model, object_model;
    cv::theRNG().state = 0x5eed;  // k-means inside GrabCut draws from the global generator
    cv::grabCut(small, trimap, cv::Rect(), background_model, object_model, 6,
                cv::GC_INIT_WITH_MASK);
    cv::Mat inside = (trimap == cv::GC_FGD) | (trimap == cv::GC_PR_FGD);
    cv::Mat full;
    cv::resize(inside, full, cv::Size(width, height), 0, 0, cv::INTER_LINEAR);
    Mask mask(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) mask(x, y) = full.at<std::uint8_t>(y, x) > 127 ? 255 : 0;
    mask = largest_piece_filled(mask);
    if (count_inside(mask) == 0) {
        throw InputError({name, "an object inside the box", "nothing that differs from its border",
                          "Draw the box closer, or give a mask."});
    }
    // Ragged contours would become ragged normals.
    ImageF soft(width, height);
    for (std::size_t i = 0; i < mask.size(); ++i) soft[i] = mask[i] > 127 ? 1.0f : 0.0f;
    soft = gaussian_blur(soft, std::max(1.0, 0.04 * inradius_px(mask)));
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = soft[i] > 0.5f ? 255 : 0;
    return largest_piece_filled(mask);
}

Photo read_photo(const std::filesystem::path& path, const PhotoOptions& options) {
    Photo photo;
    photo.name = path.filename().string();
    std::optional<Mask> alpha;
    if (is_exr_file(path)) {
        photo.linear = read_exr_rgb(path);
        photo.saturation_level = 1e30;
    } else {
        const RasterImage raster = read_raster(path);
        photo.linear = to_rgb(raster, options.is_linear);
        alpha = alpha_mask(raster);
    }
    std::size_t broken = 0;
    for (Rgb& pixel : photo.linear) {
        if (!pixel.isFinite().all()) ++broken;
        for (int c = 0; c < 3; ++c)
            pixel[c] = std::isfinite(pixel[c]) ? std::max(pixel[c], 0.0f) : 0.0f;
    }
    if (broken > 0) {
        photo.warnings.push_back(fmt::format("{}: {} pixels are not numbers and were set to black.",
                                             photo.name, broken));
    }
    std::string mask_name = photo.name;
    if (!options.mask.empty()) {
        photo.mask = read_mask(options.mask);
        mask_name = options.mask.string();
    } else if (options.box) {
        photo.mask = segment_box(photo.linear, *options.box, photo.name);
        const PixelBox& box = *options.box;
        bool touches = false;
        for (int y = box.y0; y < box.y1; ++y) {
            touches =
                touches || is_inside(photo.mask, box.x0, y) || is_inside(photo.mask, box.x1 - 1, y);
        }
        for (int x = box.x0; x < box.x1; ++x) {
            touches =
                touches || is_inside(photo.mask, x, box.y0) || is_inside(photo.mask, x, box.y1 - 1);
        }
        if (touches) {
            photo.warnings.push_back(photo.name +
                                     ": the object found touches the box; draw a larger box if a "
                                     "part is cut off.");
        }
    } else if (alpha) {
        photo.mask = *alpha;
    } else {
        throw InputError({photo.name, "a mask or a box around the object", "neither",
                          "Give a mask picture, a box, or a PNG with an alpha channel."});
    }
    check_mask(photo, mask_name, options.min_inradius_px);
    add_warnings(photo);
    return photo;
}

}  // namespace vitrine
