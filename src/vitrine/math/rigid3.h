// math/rigid3.h: rotations and translations that read themselves.
//
// A `Rigid3` named `b_from_a` maps points of frame a into frame b:
//     point_in_c = c_from_b * (b_from_a * point_in_a);      neighbours must match.
#pragma once

#include "math/vector.h"

#include <vector>

namespace vitrine {

struct Rigid3 {
    Mat3 rotation = Mat3::Identity();
    Vec3 translation = Vec3::Zero();

    static Rigid3 from_quaternion(const Eigen::Quaterniond& q, const Vec3& t);
    /// @throws InternalError when the upper 3x3 block is not a rotation; test first if it is input.
    static Rigid3 from_matrix(const Mat4& matrix);

    Vec3 operator*(const Vec3& point) const { return rotation * point + translation; }
    Rigid3 operator*(const Rigid3& b_from_a) const {
        return {rotation * b_from_a.rotation, rotation * b_from_a.translation + translation};
    }
    Rigid3 inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
    Mat4 matrix() const;
    Eigen::Quaterniond quaternion() const { return Eigen::Quaterniond(rotation); }
};

/// True when `m` is orthonormal with determinant +1 to within `tolerance`.
bool is_rotation(const Mat3& m, double tolerance = 1e-4);

/// Rigid motion exp([omega, v]): first order in small steps, exact rotation (Rodrigues).
Rigid3 rigid_from_twist(const Vec3& omega_rad, const Vec3& translation_m);

/// Camera looking from `eye` at `target` (x right, y down, z forward): world_from_camera.
Rigid3 look_at(const Vec3& eye, const Vec3& target, const Vec3& up);

/// Least-squares rigid motion with b ~ b_from_a * a (Umeyama 1991, without scale).
Rigid3 align_points(const std::vector<Vec3>& a, const std::vector<Vec3>& b);

/// An orthonormal frame around a unit normal (Duff et al. 2017, "Building an orthonormal basis,
/// revisited"): columns tangent, bitangent, normal. Local z is the normal.
struct Frame {
    Vec3f tangent, bitangent, normal;
    explicit Frame(const Vec3f& unit_normal);
    Vec3f to_local(const Vec3f& v) const {
        return {v.dot(tangent), v.dot(bitangent), v.dot(normal)};
    }
    Vec3f to_world(const Vec3f& v) const {
        return tangent * v.x() + bitangent * v.y() + normal * v.z();
    }
};

}  // namespace vitrine
