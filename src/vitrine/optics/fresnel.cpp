#include "optics/fresnel.h"

namespace vitrine {

double diffuse_fresnel_reflectance(double eta) {
    return -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
}

}  // namespace vitrine
