// The two things that can be asked about eight configurations: are they free, and how clear are they?
//
// A question is shown one checked pair after another. `doubtful` picks the lanes in which a pair could matter,
// from spheres around the bodies; `ask` looks at those lanes in full; `settled` says that no more is needed.
// What a question does in one lane must never depend on another lane.
#pragma once

#include <limits>

#include "collision/narrow_phase.hpp"

namespace plancurate {

// Whether each open lane keeps its distance at every pair. A lane closes when it fails once.
struct FreeQuestion {
    struct Judge {
        float limit2;
        Mask open;
        Mask free{};

        void look(Floats distance2, Floats slab) {
            free |= open & (slab > 0.0f) & (slab * slab > limit2 * distance2);
            open &= ~free & (distance2 > limit2);
        }
    };

    float margin;
    Mask asked;
    bool first_ends;  // one lane that fails settles the question for all
    Mask open = asked;

    bool settled() const { return first_ends ? any(asked & ~open) : !any(open); }

    // Squared distance of two points, one in each body; the bodies reach so far beyond the points, together.
    Mask doubtful(Floats distance2, float reach) const {
        const float limit = reach + margin;
        return open & ~(distance2 > limit * limit);
    }

    template <class A, class B>
    void ask(const A& a, const B& b, float radii, Mask lanes) {
        const float limit = radii + margin;
        Judge judge{limit * limit, lanes};
        separate(a, b, judge);
        open &= ~lanes | judge.free;
    }

    void ask_height(Floats height, Mask lanes) { open &= ~lanes | (height > margin); }
};

// The smallest distance of each lane.
struct ClearanceQuestion {
    struct Judge {
        Floats bound;
        Mask open;

        void look(Floats distance2, Floats slab) {
            constexpr float kCloseEnough = 1e-5f;
            const Floats distance = sqrt(distance2);
            const Floats width = select(distance2 > 0.0f, slab / distance, splat<float>(0));
            bound = select(open, max(bound, width), bound);
            open &= distance - bound > kCloseEnough;
        }
    };

    Floats smallest = splat<float>(std::numeric_limits<float>::infinity());

    bool settled() const { return false; }

    Mask doubtful(Floats distance2, float reach) const { return ~(sqrt(distance2) - reach >= smallest); }

    template <class A, class B>
    void ask(const A& a, const B& b, float radii, Mask lanes) {
        Judge judge{splat<float>(-std::numeric_limits<float>::infinity()), lanes};
        separate(a, b, judge);
        smallest = select(lanes, min(smallest, judge.bound - radii), smallest);
    }

    void ask_height(Floats height, Mask lanes) { smallest = select(lanes, min(smallest, height), smallest); }
};

}  // namespace plancurate
