// The narrow phase: bounds of the distance between two convex sets in eight lanes, by alternating projections.
//
// Projecting to and fro between two convex sets leads to their nearest points. For any direction d the gap
// between the sets' extents along d is a lower bound of their distance, so each step yields a pair of points
// (an upper bound) and a slab that keeps the sets apart (a lower bound); a test decides on those two alone.
// Steps therefore cost time when they are poor, never soundness.
#pragma once

#include "collision/convex.hpp"

namespace plancurate {

constexpr int kMaxSteps = 200;  // 2 or 3 do for most pairs; few lanes ever see the end

// Where on segment a to start: next to b's nearest point when b is a segment too, which ends the walk at once.
template <class T, class S>
Point first_point(const Segment<T>& a, const Segment<S>& b) {
    const auto between = a.centre - b.centre;
    const Floats cosine = splat<float>(0) + dot(a.z, b.z);
    const Floats along_a = dot(a.z, between), along_b = dot(b.z, between);
    const Floats sine2 = max(1.0f - cosine * cosine, splat<float>(1e-6));
    const Floats on_a = clamp((cosine * along_b - along_a) / sine2, a.half);
    return b.project(a.z * on_a + a.centre);
}

template <class A, class B>
Point first_point(const A& a, const B& b) {
    return b.project(Point{} + a.centre);
}

// Hands bounds to the pair's test until none of its lanes is active or the steps run out. The test's `update` takes
// the squared distance of two points, one in each set, and the width of the slab times the points' distance.
template <class A, class B, class PairTest>
void bound_distance(const A& a, const B& b, PairTest& test) {
    const Point between = Point{} + (a.centre - b.centre);
    Point on_b = first_point(a, b);
    Point on_a = a.project(on_b);
    Point from = on_a;
    Floats age = splat<float>(0);
    for (int step = 0; step < kMaxSteps; ++step) {
        const Point d = on_a - on_b;
        test.update(dot(d, d), dot(d, between) - a.support(d) - b.support(d));
        if (!any(test.active)) return;
        // Nesterov's momentum, dropped in a lane when it points uphill: grazing shapes converge far sooner.
        age = age + 1.0f;
        const Point ahead = on_a + (on_a - from) * (age / (age + 3.0f));
        from = on_a;
        on_b = b.project(ahead);
        on_a = a.project(on_b);
        age = select(dot(ahead - on_a, on_a - from) > 0.0f, splat<float>(0), age);
    }
}

}  // namespace plancurate
