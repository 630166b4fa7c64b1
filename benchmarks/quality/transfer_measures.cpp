#include "transfer_measures.h"

#include "image/colour.h"
#include "image/filter.h"

namespace vitrine {
namespace {

ImageRgb scaled(const ImageRgb& image, double factor) {
    ImageRgb result = image;
    for (Rgb& pixel : result) pixel *= static_cast<float>(factor);
    return result;
}

double encoded_error(const ImageRgb& a, const ImageRgb& b, const Mask& mask, double factor) {
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] <= 127) continue;
        for (int c = 0; c < 3; ++c) {
            const double d =
                linear_to_srgb(a[i][c] * static_cast<float>(factor)) - linear_to_srgb(b[i][c]);
            sum += d * d;
            count += 1;
        }
    }
    return sum / count;
}

}  // namespace

ObjectScore score_object(const ImageRgb& picture, const ImageRgb& truth, const Mask& mask) {
    ObjectScore score;
    // Golden section on log exposure.
    double low = -2.5, high = 2.5;
    const double golden = 0.5 * (std::sqrt(5.0) - 1);
    for (int i = 0; i < 40; ++i) {
        const double a = high - golden * (high - low), b = low + golden * (high - low);
        if (encoded_error(picture, truth, mask, std::exp(a)) <
            encoded_error(picture, truth, mask, std::exp(b))) {
            high = b;
        } else {
            low = a;
        }
    }
    score.exposure = std::exp(0.5 * (low + high));
    score.psnr_db =
        -10 * std::log10(std::max(encoded_error(picture, truth, mask, score.exposure), 1e-12));
    double linear = 0, count = 0;
    const ImageRgb exposed = scaled(picture, score.exposure);
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] <= 127) continue;
        linear += (exposed[i].min(1.0f) - truth[i].min(1.0f)).square().sum();
        count += 3;
    }
    score.linear_psnr_db = -10 * std::log10(std::max(linear / count, 1e-12));

    ImageF a(mask.width(), mask.height()), b(a), aa(a), bb(a), ab(a);
    for (std::size_t i = 0; i < mask.size(); ++i) {
        a[i] = linear_to_srgb(luminance(exposed[i].min(1.0f).eval()));
        b[i] = linear_to_srgb(luminance(truth[i].min(1.0f).eval()));
        aa[i] = a[i] * a[i];
        bb[i] = b[i] * b[i];
        ab[i] = a[i] * b[i];
    }
    a = gaussian_blur(a, 1.5);
    b = gaussian_blur(b, 1.5);
    aa = gaussian_blur(aa, 1.5);
    bb = gaussian_blur(bb, 1.5);
    ab = gaussian_blur(ab, 1.5);
    constexpr float c1 = 1e-4f, c2 = 9e-4f;  // Wang et al. 2004
    double sum = 0;
    count = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] <= 127) continue;
        const float va = aa[i] - a[i] * a[i], vb = bb[i] - b[i] * b[i], cov = ab[i] - a[i] * b[i];
        sum += (2 * a[i] * b[i] + c1) * (2 * cov + c2) /
               ((a[i] * a[i] + b[i] * b[i] + c1) * (va + vb + c2));
        count += 1;
    }
    score.ssim = sum / count;
    return score;
}

HighlightScore score_highlight(const ImageRgb& picture, const ImageRgb& truth, const Mask& mask) {
    // Reflections of lamps in the truth: connected object pixels whose darkest channel is > 0.9.
    Mask bright(mask.width(), mask.height());
    for (std::size_t i = 0; i < mask.size(); ++i)
        bright[i] = mask[i] > 127 && truth[i].minCoeff() > 0.9f ? 255 : 0;
    std::vector<std::vector<std::size_t>> blobs;
    Mask seen(mask.width(), mask.height());
    for (std::size_t start = 0; start < mask.size(); ++start) {
        if (bright[start] <= 127 || seen[start] > 0) continue;
        std::vector<std::size_t> blob, stack = {start};
        seen[start] = 255;
        while (!stack.empty()) {
            const std::size_t i = stack.back();
            stack.pop_back();
            blob.push_back(i);
            const int x = static_cast<int>(i) % mask.width(),
                      y = static_cast<int>(i) / mask.width();
            for (int j = -1; j <= 1; ++j) {
                for (int k = -1; k <= 1; ++k) {
                    if (!is_inside(bright, x + k, y + j) || seen(x + k, y + j) > 0) continue;
                    seen(x + k, y + j) = 255;
                    stack.push_back(static_cast<std::size_t>(y + j) *
                                        static_cast<std::size_t>(mask.width()) +
                                    static_cast<std::size_t>(x + k));
                }
            }
        }
        if (blob.size() >= 30) blobs.push_back(std::move(blob));
    }
    HighlightScore score;
    double weight_sum = 0;
    for (const std::vector<std::size_t>& blob : blobs) {
        // Centroid of what exceeds the surroundings, in a window 6 pixels wider than the blob.
        Mask window(mask.width(), mask.height());
        for (const std::size_t i : blob) window[i] = 255;
        window = dilate(window, 6);
        const auto centroid = [&](const ImageRgb& image) -> Vec2 {
            float low = 1e9f;
            for (std::size_t i = 0; i < window.size(); ++i)
                if (window[i] > 127 && mask[i] > 127)
                    low = std::min(low, std::min(1.0f, image[i].minCoeff()));
            Vec2 sum = Vec2::Zero();
            double weight = 1e-12;
            for (int y = 0; y < mask.height(); ++y) {
                for (int x = 0; x < mask.width(); ++x) {
                    if (!is_inside(window, x, y) || !is_inside(mask, x, y)) continue;
                    const double w = std::min(1.0f, image(x, y).minCoeff()) - low;
                    sum += w * Vec2(x, y);
                    weight += w;
                }
            }
            return sum / weight;
        };
        Rgbd a = Rgbd::Zero(), b = Rgbd::Zero();
        for (const std::size_t i : blob) {
            a += picture[i].min(1.0f).cast<double>();
            b += truth[i].min(1.0f).cast<double>();
        }
        const auto size = static_cast<double>(blob.size());
        score.centroid_px += size * (centroid(picture) - centroid(truth)).norm();
        score.delta_e += size * delta_e((a / size).cast<float>(), (b / size).cast<float>());
        weight_sum += size;
    }
    if (weight_sum > 0) {
        score.centroid_px /= weight_sum;
        score.delta_e /= weight_sum;
    }
    return score;
}

double mean_normal_error_deg(const Relief& found, const Relief& truth) {
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < truth.mask.size(); ++i) {
        if (truth.mask[i] <= 127) continue;
        sum += degrees(
            angle_between(found.normals[i].cast<double>(), truth.normals[i].cast<double>()));
        count += 1;
    }
    return sum / count;
}

}  // namespace vitrine
