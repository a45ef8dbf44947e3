// The queries about eight configurations: are they free, what is their clearance, and is it less than what was found?
//
// A query is given one checked pair after another. `broad_phase` picks the lanes in which a pair could matter, from
// bounding spheres; `narrow_phase` tests those lanes in full; `done` says that no further pair can matter.
// What a query does in one lane must never depend on another lane.
#pragma once

#include <limits>

#include "collision/narrow_phase.hpp"

namespace plancurate {

// Whether each active lane keeps its distance at every pair. A lane that fails once is active no more.
struct FreeQuery {
    struct PairTest {
        float limit2;
        Mask active;
        Mask free{};

        void update(Floats distance2, Floats slab) {
            free |= active & (slab > 0.0f) & (slab * slab > limit2 * distance2);
            active &= ~free & (distance2 > limit2);
        }
    };

    float margin;
    Mask queried;
    bool stop_at_collision;  // one lane that fails ends the query of all
    Mask active = queried;

    bool done() const { return stop_at_collision ? any(queried & ~active) : !any(active); }

    // Squared distance of two points, one in each body; the bodies reach so far beyond the points, together.
    Mask broad_phase(Floats distance2, float reach) const {
        const float limit = reach + margin;
        return active & ~(distance2 > limit * limit);
    }

    template <class A, class B>
    void narrow_phase(const A& a, const B& b, float radii, Mask lanes) {
        const float limit = radii + margin;
        PairTest test{limit * limit, lanes};
        bound_distance(a, b, test);
        active &= ~lanes | test.free;
    }

    void ground_test(Floats height, Mask lanes) { active &= ~lanes | (height > margin); }
};

// The smallest distance of each lane.
struct ClearanceQuery {
    struct PairTest {
        Floats bound;
        Mask active;

        void update(Floats distance2, Floats slab) {
            constexpr float kCloseEnough = 1e-5f;
            const Floats distance = sqrt(distance2);
            const Floats width = select(distance2 > 0.0f, slab / distance, splat<float>(0));
            bound = select(active, max(bound, width), bound);
            active &= distance - bound > kCloseEnough;
        }
    };

    Floats smallest = splat<float>(std::numeric_limits<float>::infinity());

    bool done() const { return false; }

    Mask broad_phase(Floats distance2, float reach) const { return ~(sqrt(distance2) - reach >= smallest); }

    template <class A, class B>
    void narrow_phase(const A& a, const B& b, float radii, Mask lanes) {
        PairTest test{splat<float>(-std::numeric_limits<float>::infinity()), lanes};
        bound_distance(a, b, test);
        smallest = select(lanes, min(smallest, test.bound - radii), smallest);
    }

    void ground_test(Floats height, Mask lanes) { smallest = select(lanes, min(smallest, height), smallest); }
};

// The smallest distance of each lane over several configurations, one after another, as if each were asked for alone and
// the smallest taken: what is left out is farther than the least so far by more than a bound may lie below a distance.
// Once a lane touches, how deep it lies is not asked; where all queried lanes do, nothing more is.
struct WayQuery : ClearanceQuery {
    static constexpr float kRoom = 1e-4f;

    Mask queried;
    Floats least;

    WayQuery(float most, Mask queried) : queried(queried), least(splat<float>(most)) {}

    bool done() const { return !any(queried & (min(least, smallest) > 0.0f)); }

    Mask broad_phase(Floats distance2, float reach) const {
        const Mask matters = queried & (least > 0.0f) & ~(sqrt(distance2) - reach >= least + kRoom);
        return matters & ClearanceQuery::broad_phase(distance2, reach);
    }

    void next_configuration() {
        least = min(least, smallest);
        smallest = splat<float>(std::numeric_limits<float>::infinity());
    }
};

}  // namespace plancurate
