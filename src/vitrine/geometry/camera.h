// geometry/camera.h: a pinhole. Looks along +z, x right, y down; pixel centres at integers.
#pragma once

#include "math/rigid3.h"

#include <string>

namespace vitrine {

struct Camera {
    std::string id;
    int width = 0, height = 0;
    double fx = 0, fy = 0, cx = 0, cy = 0;  ///< u = fx x / z + cx
    Rigid3 cam_from_world;

    Vec3 centre_in_world() const { return cam_from_world.inverse().translation; }
    /// Pixel of a point in camera coordinates; only meaningful for z > 0.
    Vec2 project_camera(const Vec3& p) const {
        return {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy};
    }
    Vec2 project(const Vec3& point_in_world) const {
        return project_camera(cam_from_world * point_in_world);
    }
    double depth(const Vec3& point_in_world) const { return (cam_from_world * point_in_world).z(); }
    bool sees(const Vec2& pixel, double border_px = 0) const {
        return pixel.x() >= border_px - 0.5 && pixel.y() >= border_px - 0.5 &&
               pixel.x() < width - 0.5 - border_px && pixel.y() < height - 0.5 - border_px;
    }
    /// Direction of the ray through a pixel in camera axes, with z = 1 (so depth * ray = point).
    Vec3 ray_in_camera(double u, double v) const { return {(u - cx) / fx, (v - cy) / fy, 1.0}; }
    /// Unit direction in the world.
    Vec3 ray_in_world(double u, double v) const {
        return (cam_from_world.rotation.transpose() * ray_in_camera(u, v)).normalized();
    }
    /// Point at planar depth z behind a pixel.
    Vec3 unproject(double u, double v, double depth_m) const {
        return cam_from_world.inverse() * (depth_m * ray_in_camera(u, v));
    }
    /// The same camera for an image `factor` times as large.
    Camera scaled(double factor) const;
};

}  // namespace vitrine
