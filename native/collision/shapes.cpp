#include "collision/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace plancurate {

namespace {

bool is_finite(const Vec3<double>& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

double norm(const Vec3<double>& v) {
    return std::sqrt(dot(v, v));
}

// Rounded up, so that the sphere in single precision still holds the shape.
float upper_float(double value) {
    return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
}

}  // namespace

void require_rigid(const Transform<double>& pose, const std::string& name) {
    constexpr double kTolerance = 1e-6;
    if (!is_finite(pose.x) || !is_finite(pose.y) || !is_finite(pose.z) || !is_finite(pose.t))
        throw std::invalid_argument(name + " must be finite");
    const Vec3<double> z{pose.x.y * pose.y.z - pose.x.z * pose.y.y, pose.x.z * pose.y.x - pose.x.x * pose.y.z,
                         pose.x.x * pose.y.y - pose.x.y * pose.y.x};
    const double skew = std::max({std::abs(dot(pose.x, pose.x) - 1), std::abs(dot(pose.y, pose.y) - 1),
                                  std::abs(dot(pose.x, pose.y)), norm(z - pose.z)});
    if (skew > kTolerance) throw std::invalid_argument(name + " must hold a right-handed rotation");
}

Shape make_shape(const ShapeTable& table, std::size_t i, const Transform<double>& frame) {
    const std::string row = "shape " + std::to_string(i);
    const Vec3<double> size = table.sizes[i];
    require_rigid(table.poses[i], row + ": its pose");
    if (!is_finite(size) || size.x < 0 || size.y < 0 || size.z < 0)
        throw std::invalid_argument(row + ": its size must be finite and not negative");
    const Transform<float> pose = cast<float>(frame * table.poses[i]);
    const Vec3<double> segment{0, 0, size.y}, cylinder{size.x, size.x, size.y};
    switch (table.kinds[i]) {
        case 0: return {ShapeKind::sphere, pose, {0, 0, 0}, static_cast<float>(size.x), upper_float(size.x)};
        case 1: return {ShapeKind::capsule, pose, cast<float>(segment), static_cast<float>(size.x), upper_float(size.x + size.y)};
        case 2: return {ShapeKind::cylinder, pose, cast<float>(cylinder), 0, upper_float(std::hypot(size.x, size.y))};
        case 3: return {ShapeKind::box, pose, cast<float>(size), 0, upper_float(norm(size))};
        default: throw std::invalid_argument(row + ": its kind is " + std::to_string(table.kinds[i]) +
                                             ", must be 0 (sphere), 1 (capsule), 2 (cylinder) or 3 (box)");
    }
}

}  // namespace plancurate
