// Recovered glass and metal against the photographs (the paper's Fig. 9 and 10):
//   vitrine_appearance [--picture PNG] CAPTURE LABEL=WORKSPACE...
// For every frame that a workspace rendered without the virtual object: relative error
// ||recovered - photograph|| / ||photograph|| within each true silhouette (eroded by 2 px), both
// clipped to what the sensor shows and blurred by 1 px. PNG: per object, in the first such frame,
// the photograph and the recovered pictures, twice as large.
#include "capture/capture.h"
#include "image/colour.h"
#include "image/filter.h"
#include "image/image_io.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

using namespace vitrine;
namespace fs = std::filesystem;

namespace {

constexpr double kBlur_px = 1.0;  // half a pixel of misalignment must not decide
constexpr int kErode_px = 2;      // true silhouettes are of visible pixels
constexpr int kBorder_px = 10;    // of the crops, around a silhouette
constexpr int kZoom = 2, kGap_px = 6;

struct Labelled {
    std::string label;
    fs::path workspace;
};

ImageRgb as_shown(const ImageRgb& picture, double saturation_level) {
    ImageRgb clipped = picture;
    for (Rgb& pixel : clipped) pixel = pixel.max(0.0f).min(static_cast<float>(saturation_level));
    return gaussian_blur(clipped, kBlur_px);
}

double relative_error(const ImageRgb& recovered, const ImageRgb& photograph, const Mask& inside) {
    double error = 0.0, signal = 1e-12;
    for (std::size_t i = 0; i < inside.size(); ++i) {
        if (inside[i] <= 127) continue;
        error += static_cast<double>((recovered[i] - photograph[i]).square().sum());
        signal += static_cast<double>(photograph[i].square().sum());
    }
    return std::sqrt(error / signal);
}

/// The part of `picture` around a silhouette, every pixel shown as kZoom x kZoom.
ImageRgb crop(const ImageRgb& picture, const Mask& mask) {
    int left = mask.width(), right = 0, top = mask.height(), bottom = 0;
    for (int v = 0; v < mask.height(); ++v)
        for (int u = 0; u < mask.width(); ++u) {
            if (mask(u, v) <= 127) continue;
            left = std::min(left, u), right = std::max(right, u);
            top = std::min(top, v), bottom = std::max(bottom, v);
        }
    left -= kBorder_px, top -= kBorder_px;
    ImageRgb part(kZoom * (right + kBorder_px - left), kZoom * (bottom + kBorder_px - top));
    for (int v = 0; v < part.height(); ++v)
        for (int u = 0; u < part.width(); ++u)
            part(u, v) = picture.clamped(left + u / kZoom, top + v / kZoom);
    return part;
}

/// Rows below each other, the pictures of a row side by side, on white.
ImageRgb montage(const std::vector<std::vector<ImageRgb>>& rows, float white) {
    int width = 0, height = kGap_px;
    for (const auto& row : rows) {
        int across = kGap_px;
        for (const ImageRgb& picture : row) across += picture.width() + kGap_px;
        width = std::max(width, across);
        height += row.front().height() + kGap_px;
    }
    ImageRgb sheet(width, height);
    std::fill(sheet.begin(), sheet.end(), Rgb::Constant(white));
    int top = kGap_px;
    for (const auto& row : rows) {
        int left = kGap_px;
        for (const ImageRgb& picture : row) {
            for (int v = 0; v < picture.height(); ++v)
                for (int u = 0; u < picture.width(); ++u) sheet(left + u, top + v) = picture(u, v);
            left += picture.width() + kGap_px;
        }
        top += row.front().height() + kGap_px;
    }
    return sheet;
}

}  // namespace

int main(int argc, char** argv) {
    fs::path folder, picture_file;
    std::vector<Labelled> sources;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        const std::size_t equals = word.find('=');
        if (word == "--picture" && i + 1 < argc) {
            picture_file = argv[++i];
        } else if (equals != std::string::npos) {
            sources.push_back({word.substr(0, equals), word.substr(equals + 1)});
        } else {
            folder = word;
        }
    }
    if (folder.empty() || sources.empty()) {
        std::fprintf(stderr, "usage: see the first lines of appearance.cpp\n");
        return 2;
    }
    const Capture capture = read_capture(folder);
    std::printf("| %s, object | views |", capture.name.c_str());
    for (const Labelled& source : sources) std::printf(" %s |", source.label.c_str());
    std::printf("\n|---|---|");
    for (std::size_t k = 0; k < sources.size(); ++k) std::printf("---|");
    std::printf("\n");

    std::map<std::string, std::vector<double>> errors;  // by object: sum for each source
    std::map<std::string, int> views;
    std::map<std::string, std::vector<ImageRgb>> pictures;
    for (const RgbdFrame& frame : capture.frames) {
        std::vector<ImageRgb> recovered;
        for (const Labelled& source : sources) {
            const fs::path file = source.workspace / "50_insert" / (frame.id + "_without.exr");
            if (fs::exists(file)) recovered.push_back(read_exr_rgb(file));
        }
        if (recovered.size() != sources.size()) continue;
        const ImageRgb photograph = as_shown(frame.colour, capture.saturation_level);
        for (const auto& entry : fs::directory_iterator(folder / "truth" / "mask")) {
            const std::string name = entry.path().stem().string();
            if (name.rfind(frame.id + "_", 0) != 0) continue;
            const std::string object = name.substr(frame.id.size() + 1);
            const Mask mask = read_mask(entry.path());
            const Mask inside = erode(mask, kErode_px);
            std::vector<double>& sum = errors[object];
            sum.resize(sources.size(), 0.0);
            ++views[object];
            const bool is_first = !pictures.contains(object);
            if (is_first) pictures[object].push_back(crop(frame.colour, mask));
            for (std::size_t k = 0; k < sources.size(); ++k) {
                sum[k] += relative_error(as_shown(recovered[k], capture.saturation_level),
                                         photograph, inside);
                if (is_first) pictures[object].push_back(crop(recovered[k], mask));
            }
        }
    }
    for (const auto& [object, sum] : errors) {
        std::printf("| %s | %d |", object.c_str(), views[object]);
        for (const double error : sum) std::printf(" %.3f |", error / views[object]);
        std::printf("\n");
    }
    if (errors.empty()) std::printf("no glass or metal in a frame that was rendered\n");
    if (picture_file.empty() || pictures.empty()) return 0;
    std::vector<std::vector<ImageRgb>> rows;
    for (auto& [object, row] : pictures) rows.push_back(std::move(row));
    const auto level = static_cast<float>(capture.saturation_level);
    write_png(picture_file, linear_to_srgb8(montage(rows, level), 1.0f / level));
}
