// estimate/distance_histogram.h: the light around each observed point, sorted by distance. With it
// the image of any radial kernel is a small product: what makes every fit take milliseconds.
#pragma once

#include "optics/curved_body.h"
#include "render/translucent_samples.h"

#include <Eigen/Core>

#include <functional>
#include <vector>

namespace vitrine {

/// A kernel R(r) of one channel, per area.
using RadialKernel = std::function<double(double r)>;

/// A kernel that a lattice can hold: below `rho` a Gaussian cap with its value and slope there
/// (as in render/translucent_relief), and the albedo that this leaves out.
class CappedKernel {
  public:
    CappedKernel(RadialKernel kernel, double rho);
    double operator()(double r) const;
    double near_share() const { return near_share_; }

  private:
    RadialKernel kernel_;
    double rho_;
    double value_;
    double curvature_;
    double near_share_ = 0;
};

/// Points of a relief at which the picture is compared with the model.
struct ReliefObservations {
    std::vector<Vec3f> position;
    std::vector<Vec3f> normal;
    std::vector<std::size_t> pixel;
    std::vector<std::int16_t> ball;  ///< of a cluster; empty for one body
};

/// Draws `count` pixels without replacement from the mask minus `excluded` minus a rim of
/// `rim_px`, facing the viewer with n_z > `min_cos`, mostly hidden balls left out. Fewer when there
/// are fewer.
ReliefObservations draw_observations(const Relief& relief, const Mask& excluded, std::size_t count,
                                     double rim_px, double min_cos, std::uint64_t seed);

/// The samples [first, last) whose light reaches observation p: all; on a cluster those of its
/// ball.
struct SampleRange {
    std::size_t first, last;
};
SampleRange samples_about(const ReliefSamples& samples, const ReliefObservations& observations,
                          std::size_t p);

/// Irradiance at points as a matrix: points x 3.
Eigen::MatrixXf irradiance_rows(const std::vector<Rgb>& irradiance);

/// The picture as a fit of R_d sees it, observations x 3: pi times the radiance, over the share of
/// light that a surface of index `eta` lets leave.
Eigen::MatrixXd exitance_rows(const ImageRgb& picture, const ReliefObservations& observations,
                              double eta);

/// For L source fields at once: node k of observation p holds sum_i hat_k(r_pi) C(s_pi)
/// value(i, l), the sources spread onto the two radial nodes around their distance. On a cluster
/// only sources of the same ball count.
class DistanceHistogram {
  public:
    /// @param source_values samples x L: entering irradiance times area, per sample and field
    /// @param local_values observations x L: entering irradiance at the observation itself
    /// @param body one factor per field, or one for all; empty: as if flat
    DistanceHistogram(const ReliefObservations& observations, const ReliefSamples& samples,
                      const Eigen::MatrixXf& source_values, const Eigen::MatrixXf& local_values,
                      const std::vector<CurvedBodyFactor>& body = {});

    /// Column l: the exitance sum_i R(r_pi) E_i dA_i of field l at each observation. What lies
    /// nearer than 1.5 cells is split as in the renderer: a Gaussian cap from the samples, the
    /// rest from the irradiance at the point itself. Cost observations x nodes x L.
    Eigen::MatrixXd image_of(const RadialKernel& kernel) const;

    /// The same for a table of kernel values given at every node of `nodes()`, without the split.
    Eigen::MatrixXd image_of_nodes(const Eigen::VectorXd& values) const;

    const std::vector<double>& nodes() const { return nodes_; }
    double step_px() const { return step_; }

  private:
    std::vector<double> nodes_;
    double step_;
    std::size_t observation_count_;
    Eigen::Index field_count_;
    std::vector<float> sums_;  ///< [observation][node][field]
    Eigen::MatrixXd local_;
};

}  // namespace vitrine
