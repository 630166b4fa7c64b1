#include "estimate/light_combinations.h"

#include <algorithm>

namespace vitrine {

TwoColumnFit fit_two_columns(double aa, double aw, double ww, double as, double ws, double ss) {
    TwoColumnFit fit;
    const double determinant = aa * ww - aw * aw;
    if (determinant > 1e-12 * aa * ww) {
        fit.d = (as * ww - ws * aw) / determinant;
        fit.s = (ws * aa - as * aw) / determinant;
    }
    if (determinant <= 1e-12 * aa * ww || fit.d < 0.0 || fit.s < 0.0) {
        // On the border: the better of the two one-column fits.
        const double only_d = aa > 0.0 ? std::max(0.0, as / aa) : 0.0;
        const double only_s = ww > 0.0 ? std::max(0.0, ws / ww) : 0.0;
        const bool is_diffuse = only_d * as >= only_s * ws;
        fit.d = is_diffuse ? only_d : 0.0;
        fit.s = is_diffuse ? 0.0 : only_s;
    }
    fit.squared_error = ss - 2.0 * (fit.d * as + fit.s * ws) + fit.d * fit.d * aa +
                        2.0 * fit.d * fit.s * aw + fit.s * fit.s * ww;
    fit.squared_error = std::max(fit.squared_error, 0.0);
    return fit;
}

std::vector<Combination> score_combinations(const CombinationColumns& columns,
                                            std::span<const double> intensities) {
    const Eigen::MatrixXd& a = columns.diffuse;
    const Eigen::MatrixXd aa = a.transpose() * a;
    const Eigen::VectorXd as = a.transpose() * columns.observed;
    const double ss = columns.observed.squaredNorm();
    std::vector<Eigen::MatrixXd> aw, ww;
    std::vector<Eigen::VectorXd> ws;
    for (const Eigen::MatrixXd& w : columns.lobe) {
        aw.push_back(a.transpose() * w);
        ww.push_back(w.transpose() * w);
        ws.push_back(w.transpose() * columns.observed);
    }

    const auto lights = static_cast<std::size_t>(columns.light_count);
    std::vector<Combination> combinations;
    std::vector<int> place(lights, 0);
    for (bool is_more = true; is_more;) {
        Combination best;
        best.place = place;
        best.squared_error = 2.0 * ss + 1.0;
        std::vector<Eigen::Index> at(lights);
        for (std::size_t l = 0; l < lights; ++l)
            at[l] = static_cast<Eigen::Index>(l) * columns.place_count + place[l];
        double sum_aa = 0.0, sum_as = 0.0;
        for (std::size_t p = 0; p < lights; ++p) {
            sum_as += intensities[p] * as[at[p]];
            for (std::size_t q = 0; q < lights; ++q)
                sum_aa += intensities[p] * intensities[q] * aa(at[p], at[q]);
        }
        for (std::size_t m = 0; m < columns.lobe.size(); ++m) {
            double sum_aw = 0.0, sum_ww = 0.0, sum_ws = 0.0;
            for (std::size_t p = 0; p < lights; ++p) {
                sum_ws += intensities[p] * ws[m][at[p]];
                for (std::size_t q = 0; q < lights; ++q) {
                    const double i2 = intensities[p] * intensities[q];
                    sum_aw += i2 * aw[m](at[p], at[q]);
                    sum_ww += i2 * ww[m](at[p], at[q]);
                }
            }
            const TwoColumnFit fit = fit_two_columns(sum_aa, sum_aw, sum_ww, sum_as, sum_ws, ss);
            if (fit.squared_error < best.squared_error) {
                best.roughness = m;
                best.rho_d = fit.d;
                best.rho_s = fit.s;
                best.squared_error = fit.squared_error;
            }
        }
        combinations.push_back(std::move(best));
        is_more = false;
        for (std::size_t l = lights; l-- > 0 && !is_more;) {
            is_more = ++place[l] < columns.place_count;
            if (!is_more) place[l] = 0;
        }
    }
    return combinations;
}

}  // namespace vitrine
