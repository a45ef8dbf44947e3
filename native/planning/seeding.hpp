// Reproducible random numbers although OMPL has one global source of seeds.
//
// Each ompl::RNG takes its seed from a global sequence when it is built, so what it draws depends on what was
// built before it, in any thread. Here every RNG is built under one lock, right after the global sequence was
// restarted: at set-up, and in the two allocators (state samplers, informed samplers) that planners call later.
#pragma once

#include <cstdint>
#include <mutex>

#include <ompl/util/RandomNumbers.h>

namespace plancurate {

// A well mixed 64-bit number for each (seed, index): SplitMix64.
inline std::uint64_t mixed(std::uint64_t seed, std::uint64_t index) {
    std::uint64_t z = seed + (index + 1) * 0x9E3779B97F4A7C15ULL;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31);
}

// Numbers the places where one problem builds random generators.
struct SeedSequence {
    std::uint64_t seed;
    std::uint64_t used = 0;
    std::uint64_t next() { return mixed(seed, used++); }
};

// While it lives, generators built by this thread are seeded from `seed` alone. May be nested.
class SeededSection {
public:
    explicit SeededSection(SeedSequence& seeds) : lock_(mutex()) {
        // OMPL's seed generator ignores 0 and takes other seeds modulo 2^31 - 85.
        ompl::RNG::setSeed(static_cast<std::uint_fast32_t>(1 + seeds.next() % 2147483562ULL));
    }

private:
    static std::recursive_mutex& mutex() {
        static std::recursive_mutex instance;
        return instance;
    }
    std::lock_guard<std::recursive_mutex> lock_;
};

}  // namespace plancurate
