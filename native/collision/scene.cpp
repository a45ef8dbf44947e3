#include "collision/scene.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace plancurate {

Scene make_scene(const ShapeTable& shapes, std::optional<double> ground, double margin) {
    constexpr Transform<double> kIdentity{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};
    constexpr float kUnits = 8 * std::numeric_limits<float>::epsilon();
    if (ground && !std::isfinite(*ground)) throw std::invalid_argument("ground must be a finite height or None");
    if (!std::isfinite(margin) || margin < 0) throw std::invalid_argument("margin must be finite and not negative");
    Scene scene;
    for (std::size_t i = 0; i < shapes.kinds.size(); ++i) {
        const Shape shape = make_shape(shapes, i, kIdentity);
        const float away = std::sqrt(dot(shape.pose.t, shape.pose.t)) + shape.bounding;
        scene.obstacles.push_back({shape, kUnits * away});
    }
    if (ground) scene.ground = static_cast<float>(*ground);
    scene.margin = static_cast<float>(margin);
    return scene;
}

}  // namespace plancurate
