#include "estimate/measured_reflectance.h"

#include "base/error.h"
#include "math/optimise.h"
#include "optics/ward.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

namespace vitrine {

namespace {

constexpr double kMinSigma = 0.02, kMaxSigma = 0.8;
constexpr double kMinGain = 0.02;  // of the residual: without it there is no lobe to speak of

Vec3 direction(double theta, double phi) {
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

bool is_used(const ReflectanceSample& sample, const ReflectanceFitOptions& options) {
    const double least = std::cos(radians(options.max_angle_deg));
    return sample.value > 0.0 && sample.to_light.z() >= least && sample.to_viewer.z() >= least;
}

}  // namespace

std::vector<ReflectanceSample> read_cornell_brdf(const std::filesystem::path& path,
                                                 int wavelength_nm) {
    std::ifstream in(path);
    const auto fail = [&](const std::string& expected, const std::string& found) -> InputError {
        return InputError({path.string(), expected, found, ""});
    };
    if (!in) throw fail("a .brdf file", "no such file");
    std::vector<double> numbers;
    std::string line;
    while (std::getline(in, line)) {
        if (line.empty() || line[0] == '#') continue;
        std::istringstream words(line);
        for (double x = 0; words >> x;) numbers.push_back(x);
    }
    if (numbers.empty() || numbers[0] < 1 || numbers[0] > 1000)
        throw fail("the number of wavelengths first", "something else");
    const auto count = static_cast<std::size_t>(numbers[0]);
    if (numbers.size() < 1 + count) throw fail("a list of wavelengths", "the end of the file");
    const auto begin = numbers.begin() + 1;
    const auto found = std::find(begin, begin + static_cast<long>(count), wavelength_nm);
    if (found == begin + static_cast<long>(count))
        throw fail("wavelength " + std::to_string(wavelength_nm) + " nm", "other wavelengths");
    const auto column = static_cast<std::size_t>(found - begin);
    const std::size_t row = 4 + count;
    std::vector<ReflectanceSample> samples;
    for (std::size_t i = 1 + count; i + row <= numbers.size(); i += row)
        samples.push_back({direction(numbers[i], numbers[i + 1]),
                           direction(numbers[i + 2], numbers[i + 3]), numbers[i + 4 + column]});
    return samples;
}

double ward_value(const MeasuredWard& fit, const ReflectanceSample& sample,
                  const ReflectanceFitOptions& options) {
    return fit.rho_d / kPi + fit.rho_s * ward_lobe(sample.to_viewer, sample.to_light,
                                                   fit.sigma.value, options.is_duer);
}

MeasuredWard fit_measured_ward(const std::vector<ReflectanceSample>& samples,
                               const ReflectanceFitOptions& options) {
    MeasuredWard fit;
    std::vector<ReflectanceSample> used;
    double log_mean = 0.0;
    for (const ReflectanceSample& s : samples)
        if (is_used(s, options)) {
            used.push_back(s);
            log_mean += std::log(s.value);
        }
    fit.sample_count = static_cast<int>(used.size());
    fit.sigma.value = kMaxSigma;
    if (used.size() < 4) {
        fit.sigma.reason = "fewer than four usable measurements";
        return fit;
    }
    log_mean /= static_cast<double>(used.size());
    const auto unpack = [&](const std::vector<double>& x) {
        MeasuredWard trial;
        trial.rho_d = std::exp(x[0]);
        trial.rho_s = std::exp(x[1]);
        trial.sigma.value = std::exp(x[2]);
        return trial;
    };
    const auto error = [&](const std::vector<double>& x) {
        const MeasuredWard trial = unpack(x);
        if (trial.sigma.value < kMinSigma || trial.sigma.value > kMaxSigma) return 1e6;
        double sum = 0.0;
        for (const ReflectanceSample& s : used)
            sum += std::pow(std::log(s.value / std::max(ward_value(trial, s, options), 1e-12)), 2);
        return sum / static_cast<double>(used.size());
    };
    double flat = 0.0;
    for (const ReflectanceSample& s : used)
        flat += std::pow(std::log(s.value) - log_mean, 2) / static_cast<double>(used.size());
    MinimumNd best;
    best.value = 1e9;
    for (const double sigma : {0.06, 0.15, 0.35}) {
        const std::vector<double> start = {log_mean + std::log(kPi), log_mean, std::log(sigma)};
        const MinimumNd found =
            minimise_nelder_mead(error, start, {0.5, 1.0, 0.3},
                                 {.max_evaluations = 600, .tolerance = 1e-10, .min_size = 1e-5});
        if (found.value < best.value) best = found;
    }
    const int sample_count = fit.sample_count;
    fit = unpack(best.x);
    fit.sample_count = sample_count;
    fit.residual_rms = fit.sigma.residual_rms = std::sqrt(best.value);
    const bool is_in_lobe = std::any_of(used.begin(), used.end(), [&](const auto& s) {
        const Vec3 h = s.to_light + s.to_viewer;
        return h.head<2>().squaredNorm() < std::pow(fit.sigma.value * h.z(), 2);
    });
    fit.sigma.outcome = Outcome::Converged;
    if (!is_in_lobe || best.value > (1.0 - kMinGain) * flat) {
        fit.sigma.outcome = Outcome::NotIdentifiable;
        fit.sigma.reason =
            is_in_lobe ? "the reflectance shows no lobe" : "no measurement lies within the lobe";
    } else if (fit.sigma.value < 1.01 * kMinSigma || fit.sigma.value > 0.99 * kMaxSigma) {
        fit.sigma.outcome = Outcome::AtBound;
        fit.sigma.reason = "the best roughness lies at the end of the range";
    }
    return fit;
}

}  // namespace vitrine
