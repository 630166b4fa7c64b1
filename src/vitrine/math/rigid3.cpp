#include "math/rigid3.h"

#include "base/error.h"

#include <Eigen/SVD>

#include <cmath>

namespace vitrine {

Rigid3 Rigid3::from_quaternion(const Eigen::Quaterniond& q, const Vec3& t) {
    return {q.normalized().toRotationMatrix(), t};
}

Rigid3 Rigid3::from_matrix(const Mat4& matrix) {
    VITRINE_CHECK(is_rotation(matrix.topLeftCorner<3, 3>()));
    return {matrix.topLeftCorner<3, 3>(), matrix.topRightCorner<3, 1>()};
}

Mat4 Rigid3::matrix() const {
    Mat4 m = Mat4::Identity();
    m.topLeftCorner<3, 3>() = rotation;
    m.topRightCorner<3, 1>() = translation;
    return m;
}

bool is_rotation(const Mat3& m, double tolerance) {
    return m.allFinite() &&
           (m * m.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() < tolerance &&
           m.determinant() > 0.0;
}

Rigid3 rigid_from_twist(const Vec3& omega_rad, const Vec3& translation_m) {
    const double angle = omega_rad.norm();
    Rigid3 motion;
    if (angle > 1e-12) {
        motion.rotation = Eigen::AngleAxisd(angle, omega_rad / angle).toRotationMatrix();
    }
    motion.translation = translation_m;
    return motion;
}

Rigid3 look_at(const Vec3& eye, const Vec3& target, const Vec3& up) {
    const Vec3 forward = (target - eye).normalized();
    Vec3 right = forward.cross(up);
    if (right.norm() < 1e-9) right = forward.cross(Vec3(0, 1, 0));
    right.normalize();
    const Vec3 down = forward.cross(right);
    Rigid3 world_from_camera;
    world_from_camera.rotation << right, down, forward;
    world_from_camera.translation = eye;
    return world_from_camera;
}

Rigid3 align_points(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    VITRINE_CHECK_EQ(a.size(), b.size());
    VITRINE_CHECK_GE(a.size(), std::size_t{3});
    Vec3 mean_a = Vec3::Zero(), mean_b = Vec3::Zero();
    for (std::size_t i = 0; i < a.size(); ++i) {
        mean_a += a[i];
        mean_b += b[i];
    }
    mean_a /= static_cast<double>(a.size());
    mean_b /= static_cast<double>(b.size());
    Mat3 covariance = Mat3::Zero();
    for (std::size_t i = 0; i < a.size(); ++i) {
        covariance += (b[i] - mean_b) * (a[i] - mean_a).transpose();
    }
    const Eigen::JacobiSVD<Mat3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Vec3 signs = Vec3::Ones();
    if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) signs.z() = -1.0;
    Rigid3 b_from_a;
    b_from_a.rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
    b_from_a.translation = mean_b - b_from_a.rotation * mean_a;
    return b_from_a;
}

Frame::Frame(const Vec3f& unit_normal) : normal(unit_normal) {
    const float sign = std::copysign(1.0f, normal.z());
    const float a = -1.0f / (sign + normal.z());
    const float b = normal.x() * normal.y() * a;
    tangent = Vec3f(1.0f + sign * normal.x() * normal.x() * a, sign * b, -sign * normal.x());
    bitangent = Vec3f(b, sign + normal.y() * normal.y() * a, -normal.y());
}

}  // namespace vitrine
