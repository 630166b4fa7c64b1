// estimate/light_fields.h: what unit lights send into a translucent object, and what of it a
// scattering kernel shows.
#pragma once

#include "estimate/distance_histogram.h"
#include "render/ball_bounce.h"

#include <optional>
#include <vector>

namespace vitrine {

/// Entering irradiance of L unit lights: at the samples of the surface, times their area, and at
/// the observed points.
struct LightFields {
    Eigen::MatrixXf source, local;
    Eigen::MatrixXf patch;  ///< of a cluster: at BallBounce::patches()
};

/// What a fit of lights knows of the object: where light enters and where it is seen.
class LitRelief {
  public:
    /// @param eta relative index of the surface
    LitRelief(const Relief& relief, ReliefSamples samples, ReliefObservations observations,
              double eta, bool use_shadows);

    const ReliefSamples& samples() const { return samples_; }
    const ReliefObservations& observations() const { return observations_; }

    bool is_cluster() const { return bounce_.has_value(); }

    /// Columns: the directions, then (if asked for) light from everywhere and from below.
    /// Costs about 1 ms per direction and 1000 points, most of it the object's own shadows.
    LightFields fields(const std::vector<Vec3>& directions, bool with_sky) const;

    /// With what balls of this albedo throw on each other; of one body, the same.
    LightFields bounced(const LightFields& direct, double albedo) const;

  private:
    void fill(Eigen::MatrixXf& field, const SurfacePoints& points,
              const std::vector<Vec3>& directions, const SkyShares* sky) const;

    Occluder occluder_;
    ReliefSamples samples_;
    ReliefObservations observations_;
    SurfacePoints sample_points_, observation_points_;
    SkyShares sample_sky_, observation_sky_;
    std::optional<BallBounce> bounce_;  // of a cluster
    /// What samples and observations see of its patches: few each.
    Eigen::SparseMatrix<float, Eigen::RowMajor> sample_view_, observation_view_;
    double eta_;
    bool use_shadows_;
};

/// Between each observation and the samples that send light to it (on a cluster those of its ball):
/// distance and chord rise, which all kernels share.
class LightPaths {
  public:
    explicit LightPaths(const LitRelief& object);

    /// The exitance that each kernel shows at the observations, near * local + far * source as in
    /// DistanceHistogram: one matrix per kernel, one column per light. About 10 ns per path.
    std::vector<Eigen::MatrixXd> images(const std::vector<RadialKernel>& kernels,
                                        const LightFields& fields,
                                        const CurvedBodyFactor& body) const;

  private:
    friend class KernelImage;
    struct Bundle {
        Eigen::Index first_sample, sample_count;
        std::size_t begin;  ///< in distance_ and rise_
    };
    double step_px_;
    float reach_px_ = 0;
    std::vector<Bundle> bundles_;  ///< of each observation
    std::vector<float> distance_, rise_;
};

/// The same for one kernel, kept for lights that move.
class KernelImage {
  public:
    KernelImage(const LightPaths& paths, const RadialKernel& kernel, const CurvedBodyFactor& body);
    /// One column per light.
    Eigen::MatrixXd operator()(const LightFields& fields) const;

  private:
    std::vector<LightPaths::Bundle> bundles_;
    std::vector<float> far_;  ///< of each path
    double near_ = 0;
};

/// Normal equations for the intensities of lights that several channels share:
/// sum_c |w_c (A_c x - y_c)|^2.
struct IntensityEquations {
    Eigen::MatrixXd gram;
    Eigen::VectorXd right;
    double observed = 0;  ///< sum_c |w_c y_c|^2

    explicit IntensityEquations(Eigen::Index light_count);
    void add(const Eigen::MatrixXd& image, const Eigen::VectorXd& y, const Eigen::VectorXd& weight);
    double misfit(const Eigen::VectorXd& intensity) const;
};

}  // namespace vitrine
