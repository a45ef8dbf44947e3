// Nearest neighbours whose answer does not depend on memory addresses.
#pragma once

#include <algorithm>
#include <cstddef>
#include <unordered_map>
#include <utility>
#include <vector>

#include <ompl/datastructures/NearestNeighborsGNATNoThreadSafety.h>

namespace plancurate {

// OMPL's tree orders equally distant neighbours (copies of a goal, say) by where they lie in memory, which
// differs from thread to thread. Here the one added first comes first.
template <class T>
class StableNearest : public ompl::NearestNeighborsGNATNoThreadSafety<T> {
    using Base = ompl::NearestNeighborsGNATNoThreadSafety<T>;

public:
    void add(const T& element) override {
        order_.emplace(element, added_++);
        Base::add(element);
    }

    void add(const std::vector<T>& elements) override {
        for (const T& element : elements) order_.emplace(element, added_++);
        Base::add(elements);
    }

    // The tree also clears itself to add its elements again, in an order that only its shape decides.
    void clear() override {
        order_.clear();
        Base::clear();
    }

    bool remove(const T& element) override {
        order_.erase(element);
        return Base::remove(element);
    }

    void nearestK(const T& query, std::size_t k, std::vector<T>& neighbours) const override {
        Base::nearestK(query, k == 0 ? 0 : k + 1, neighbours);
        if (neighbours.size() > k && distance(query, neighbours[k]) == distance(query, neighbours[k - 1]))
            Base::nearestR(query, distance(query, neighbours[k]), neighbours);  // all that tie for the last place
        sort(query, neighbours);
        if (neighbours.size() > k) neighbours.resize(k);
    }

    void nearestR(const T& query, double radius, std::vector<T>& neighbours) const override {
        Base::nearestR(query, radius, neighbours);
        sort(query, neighbours);
    }

private:
    double distance(const T& a, const T& b) const { return ompl::NearestNeighbors<T>::distFun_(a, b); }

    void sort(const T& query, std::vector<T>& neighbours) const {
        ranked_.clear();
        for (const T& neighbour : neighbours)
            ranked_.push_back({{distance(query, neighbour), order_.at(neighbour)}, neighbour});
        std::sort(ranked_.begin(), ranked_.end(), [](const Ranked& a, const Ranked& b) { return a.first < b.first; });
        for (std::size_t i = 0; i < ranked_.size(); ++i) neighbours[i] = ranked_[i].second;
    }

    using Ranked = std::pair<std::pair<double, std::size_t>, T>;
    std::unordered_map<T, std::size_t> order_;
    std::size_t added_ = 0;
    mutable std::vector<Ranked> ranked_;
};

}  // namespace plancurate
