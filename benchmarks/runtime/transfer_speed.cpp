// vitrine_transfer_speed: how long a material transfer takes when everything that can be held is
// held, against the plain sum over all pixels on the same machine. Wall and processor time,
// medians.
#include "base/timer.h"
#include "capture/photo.h"
#include "compose/transfer.h"
#include "image/image.h"

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>

namespace vitrine {
namespace {

struct Seconds {
    double wall = 0, processor = 0;
};

Seconds timed(const std::function<void()>& work) {
    const Timer timer;
    const std::clock_t start = std::clock();
    work();
    return {timer.seconds(), static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC};
}

Seconds median_of(int count, const std::function<void(int)>& work) {
    std::vector<double> wall, processor;
    for (int i = 0; i < count; ++i) {
        const Seconds s = timed([&] { work(i); });
        wall.push_back(s.wall);
        processor.push_back(s.processor);
    }
    const auto middle = [](std::vector<double> v) {
        std::sort(v.begin(), v.end());
        return v[v.size() / 2];
    };
    return {middle(wall), middle(processor)};
}

/// The photo at another size: `pixels` in all.
Photo resized(const Photo& photo, double pixels) {
    const double factor = std::sqrt(pixels / static_cast<double>(photo.mask.size()));
    Photo result = photo;
    const int width = static_cast<int>(std::lround(photo.mask.width() * factor));
    const int height = static_cast<int>(std::lround(photo.mask.height() * factor));
    result.linear = ImageRgb(width, height);
    result.mask = Mask(width, height);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double u = (x + 0.5) / factor - 0.5, v = (y + 0.5) / factor - 0.5;
            result.linear(x, y) = bilinear(photo.linear, u, v);
            const int column =
                std::clamp(static_cast<int>(std::lround(u)), 0, photo.mask.width() - 1);
            const int row =
                std::clamp(static_cast<int>(std::lround(v)), 0, photo.mask.height() - 1);
            result.mask(x, y) = photo.mask(column, row);
        }
    }
    return result;
}

void print(const char* what, const Seconds& s, const char* bar) {
    std::printf("  %-34s %7.3f s wall %7.3f s processor   %s\n", what, s.wall, s.processor, bar);
}

/// Mean relative difference over the receivers that the plain sum visited.
double relative_error(const ImageRgb& image, const ImageRgb& truth) {
    double difference = 0, sum = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (!(truth[i] > 0).any()) continue;
        difference += (image[i] - truth[i]).abs().sum();
        sum += truth[i].sum();
    }
    return difference / sum;
}

void run_size(const Photo& source, const Photo& target, double megapixels) {
    const Photo material_photo = resized(source, 1e6 * megapixels);
    const Photo object_photo = resized(target, 1e6 * megapixels);
    std::size_t inside = 0;
    for (const auto m : object_photo.mask) inside += m > 127;
    std::printf("%.2f megapixel photos, object of %zu pixels\n", megapixels, inside);

    LiftedMaterial material;
    std::unique_ptr<TransferSession> session;
    RadialProfile profile;
    TransferLook look;
    print("first result", timed([&] {
              AnalysedPair pair = analyse_pair(material_photo, object_photo);
              material = std::move(pair.material);
              PhotoAnalysis object = std::move(pair.object);
              const double ratio =
                  length_ratio(material.medium.inradius_px, object.relief.inradius_px, 0, 0);
              profile = material.medium.profile().scaled(ratio);
              session = std::make_unique<TransferSession>(std::move(object));
              session->render(profile, look);
          }),
          "bar 5 s at 1 megapixel");
    const auto change = [&](const char* what, const auto& edit) {
        print(what,
              median_of(5,
                        [&](int i) {
                            TransferLook changed = look;
                            edit(changed, i);
                            session->render(profile, changed);
                        }),
              "bar 0.15 s");
    };
    change("change of scale", [](TransferLook& l, int i) { l.scale = 1.3 + 0.1 * i; });
    change("change of exposure", [](TransferLook& l, int i) { l.exposure = 1.1 + 0.1 * i; });
    change("change of gloss", [](TransferLook& l, int i) { l.added_gloss = 0.1 + 0.1 * i; });

    const ViewLights lights = session->object().lights.lights;
    print("change of light",
          median_of(5,
                    [&](int i) {
                        ViewLights turned = lights;
                        const Eigen::AngleAxisd turn(0.1 * (i + 1), Vec3(0, 1, 0));
                        for (ViewLight& light : turned.lights)
                            light.direction = turn * light.direction;
                        session->set_lights(turned);
                        session->render(profile, look);
                    }),
          "bar 0.3 s");

    // The plain sum, for one receiver in stride^2.
    const PhotoAnalysis& object = session->object();
    const int stride = std::max(4, static_cast<int>(24 * megapixels));
    const ReliefIrradiance irradiance = session->irradiance();
    ImageRgb fast, plain;
    const TranslucentRelief renderer(object.relief);
    const Seconds fast_time = timed([&] { fast = renderer.render(irradiance, profile); });
    const Seconds plain_time = timed([&] {
        plain = render_translucent_brute_force(object.relief, irradiance, profile, {}, stride);
    });
    const double whole = plain_time.processor * stride * stride;
    print("the integral alone", fast_time, "");
    std::printf(
        "  plain sum over all pixels: %.0f s of processor time (one receiver in %d measured), "
        "ratio %.0f; difference %.2f %% (bar 1 %%)\n",
        whole, stride * stride, whole / fast_time.processor, 100 * relative_error(fast, plain));
}

int run(int argc, char** argv) {
    std::vector<double> sizes;
    for (int i = 2; i < argc; ++i) sizes.push_back(std::atof(argv[i]));
    const bool is_size_wrong =
        std::any_of(sizes.begin(), sizes.end(), [](double s) { return s <= 0; });
    if (argc < 2 || is_size_wrong) {
        std::printf("usage: vitrine_transfer_speed PHOTOS [MEGAPIXELS ...]   (data/photos)\n");
        return 2;
    }
    const std::filesystem::path folder = argv[1];
    const auto photo = [&](const std::string& name) {
        PhotoOptions options;
        options.mask = folder / (name + "_mask.png");
        return read_photo(folder / (name + ".png"), options);
    };
    const Photo source = photo("grapes"), target = photo("bust");
    if (sizes.empty()) sizes = {0.25, 1.0, 4.0};
    for (const double size : sizes) run_size(source, target, size);
    return 0;
}

}  // namespace
}  // namespace vitrine

int main(int argc, char** argv) { return vitrine::run(argc, argv); }
