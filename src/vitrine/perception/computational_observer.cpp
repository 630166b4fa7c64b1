#include "perception/computational_observer.h"

#include "base/error.h"
#include "base/json_reader.h"
#include "base/parallel.h"
#include "image/colour.h"
#include "image/filter.h"
#include "math/statistics.h"

#include <cmath>
#include <limits>

namespace vitrine {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// What the observer compares: lightness of the blurred picture; NaN-free, clipped pixels apart.
struct Percept {
    ImageF lightness;
    std::vector<bool> is_clipped;
};

Percept perceive(const ImageRgb& picture, double sigma_px) {
    ImageRgb displayed = picture;
    Percept percept;
    percept.is_clipped.resize(picture.size());
    for (std::size_t i = 0; i < picture.size(); ++i) {
        percept.is_clipped[i] = (picture[i] >= 1.0f).any();
        displayed[i] = picture[i].max(0.0f).min(1.0f);
    }
    const ImageRgb blurred = gaussian_blur(displayed, sigma_px);
    percept.lightness = ImageF(picture.width(), picture.height());
    for (std::size_t i = 0; i < blurred.size(); ++i) {
        percept.lightness[i] = lab_from_linear(blurred[i]).x();
    }
    return percept;
}

double compare(const Percept& a, const Percept& b, double q) {
    if (!a.lightness.same_size(b.lightness)) {
        throw InputError({"pictures", "one size", "different sizes", ""});
    }
    std::vector<double> differences;
    for (std::size_t i = 0; i < a.lightness.size(); ++i) {
        if (a.is_clipped[i] || b.is_clipped[i]) continue;
        differences.push_back(std::abs(a.lightness[i] - b.lightness[i]));
    }
    return differences.empty() ? 0.0 : quantile(std::move(differences), q);
}

/// Distance from stimulus `from` in direction `step` at which the difference reaches `delta_l`.
double crossing(const std::vector<std::vector<double>>& difference, std::span<const double> ior,
                std::size_t from, int step, double delta_l) {
    double distance = 0, value = 0;
    for (int j = static_cast<int>(from) + step; j >= 0 && j < static_cast<int>(ior.size());
         j += step) {
        const auto to = static_cast<std::size_t>(j);
        const double next = difference[from][to], next_distance = std::abs(ior[to] - ior[from]);
        if (next >= delta_l) {
            return distance + (next_distance - distance) * (delta_l - value) / (next - value);
        }
        value = next;
        distance = next_distance;
    }
    return kNever;
}

}  // namespace

double visible_difference(const ImageRgb& a, const ImageRgb& b,
                          const ComputationalObserverOptions& options) {
    return compare(perceive(a, options.blur_sigma_px), perceive(b, options.blur_sigma_px),
                   options.quantile);
}

PredictedThreshold predict_thresholds(std::span<const ImageRgb> pictures,
                                      std::span<const double> ior,
                                      const ComputationalObserverOptions& options) {
    if (pictures.size() < 2 || pictures.size() != ior.size()) {
        throw InputError({"pictures", fmt::format("one picture for each of {} indices", ior.size()),
                          std::to_string(pictures.size()), ""});
    }
    std::vector<Percept> percepts(pictures.size());
    parallel_for(pictures.size(), 1, [&](std::size_t i) {
        percepts[i] = perceive(pictures[i], options.blur_sigma_px);
    });
    std::vector<std::vector<double>> difference(pictures.size(),
                                                std::vector<double>(pictures.size(), 0.0));
    parallel_for(pictures.size(), 1, [&](std::size_t i) {
        for (std::size_t j = 0; j < pictures.size(); ++j) {
            if (i != j) difference[i][j] = compare(percepts[i], percepts[j], options.quantile);
        }
    });
    PredictedThreshold prediction;
    prediction.value = kNever;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        const double local = std::min(crossing(difference, ior, i, 1, options.delta_l),
                                      crossing(difference, ior, i, -1, options.delta_l));
        prediction.local.push_back({ior[i], local});
        prediction.value = std::min(prediction.value, local);
    }
    return prediction;
}

std::string prediction_to_json(const PredictedThreshold& prediction,
                               const ComputationalObserverOptions& options) {
    const auto or_null = [](double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); };
    Json root;
    root["schema"] = "vitrine.mlds_prediction/1";
    root["label"] = "computed from the pictures, not measured with people";
    root["lambda"] = or_null(prediction.value);
    root["local"] = Json::array();
    for (const auto& [n, local] : prediction.local) {
        root["local"].push_back(Json::array({n, or_null(local)}));
    }
    root["blur_sigma_px"] = options.blur_sigma_px;
    root["quantile"] = options.quantile;
    root["delta_l"] = options.delta_l;
    return root.dump(2) + "\n";
}

PredictedThreshold prediction_from_json(const std::string& text, const std::string& name) {
    const JsonObject root = read_json_text(text, name);
    root.choice("schema", {"vitrine.mlds_prediction/1"});
    for (const char* key : {"label", "blur_sigma_px", "quantile", "delta_l"}) root.ignore(key);
    const auto value = [&](const Json& v) {
        if (!v.is_null() && !v.is_number()) root.fail("local", "numbers or null", v.dump());
        return v.is_null() ? kNever : v.get<double>();
    };
    PredictedThreshold prediction;
    prediction.value = value(root.raw("lambda"));
    for (const Json& pair : root.raw("local")) {
        if (!pair.is_array() || pair.size() != 2) root.fail("local", "pairs", pair.dump());
        prediction.local.push_back({value(pair[0]), value(pair[1])});
    }
    root.finish();
    return prediction;
}

}  // namespace vitrine
