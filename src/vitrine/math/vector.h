// math/vector.h: the vector types and nothing else. double for poses and solvers, float for pixels,
// photons and rays.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <numbers>

namespace vitrine {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Vec4 = Eigen::Vector4d;
using Mat3 = Eigen::Matrix3d;
using Mat4 = Eigen::Matrix4d;
using Vec2f = Eigen::Vector2f;
using Vec3f = Eigen::Vector3f;
using Mat3f = Eigen::Matrix3f;
using Triangle = Eigen::Vector3i;  ///< three vertex indices, counter-clockwise seen from outside

/// Linear Rec. 709 radiance, albedo or weight per channel.
using Rgb = Eigen::Array3f;
using Rgbd = Eigen::Array3d;

constexpr double kPi = std::numbers::pi;
constexpr float kPif = std::numbers::pi_v<float>;

inline constexpr double radians(double degrees) { return degrees * kPi / 180.0; }
inline constexpr double degrees(double radians) { return radians * 180.0 / kPi; }

/// Rec. 709 luminance.
inline float luminance(const Rgb& c) { return 0.2126f * c[0] + 0.7152f * c[1] + 0.0722f * c[2]; }
inline double luminance(const Rgbd& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

/// Angle between two vectors in radians, accurate near 0 and pi.
inline double angle_between(const Vec3& a, const Vec3& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// An axis-aligned box; empty until something is added.
struct Box3 {
    Vec3 min = Vec3::Constant(1e30);
    Vec3 max = Vec3::Constant(-1e30);
    void extend(const Vec3& p) {
        min = min.cwiseMin(p);
        max = max.cwiseMax(p);
    }
    bool is_empty() const { return (min.array() > max.array()).any(); }
    Vec3 centre() const { return 0.5 * (min + max); }
    Vec3 size() const { return max - min; }
    double radius() const { return 0.5 * size().norm(); }  ///< of the sphere around the box
    bool contains(const Vec3& p) const {
        return (p.array() >= min.array()).all() && (p.array() <= max.array()).all();
    }
};

}  // namespace vitrine
