// NumPy arrays in and out of the kernel, with errors that name the argument and the shape it should have.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include "vector/geometry.hpp"

namespace plancurate {

namespace nb = nanobind;

template <class T>
using Array = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;
using NumpyDoubles = nb::ndarray<nb::numpy, double, nb::c_contig>;
using NumpyBools = nb::ndarray<nb::numpy, bool, nb::c_contig>;

inline std::string shape_text(const std::vector<std::int64_t>& shape) {
    std::string text = "(";
    for (const std::int64_t size : shape) text += (text.size() > 1 ? ", " : "") + (size < 0 ? "any" : std::to_string(size));
    return text + (shape.size() == 1 ? ",)" : ")");
}

// Throws std::invalid_argument unless the array has this shape; -1 stands for any size.
template <class T>
void require_shape(const Array<T>& array, const std::string& name, const std::vector<std::int64_t>& wanted) {
    std::vector<std::int64_t> shape;
    for (std::size_t i = 0; i < array.ndim(); ++i) shape.push_back(array.shape(i));
    const auto fits = [](std::int64_t have, std::int64_t want) { return want < 0 || have == want; };
    if (!std::equal(shape.begin(), shape.end(), wanted.begin(), wanted.end(), fits))
        throw std::invalid_argument(name + " has shape " + shape_text(shape) + ", must be " + shape_text(wanted));
}

// Throws std::invalid_argument unless all joint positions of rows of `dof` are finite.
inline void require_finite(const Array<double>& q, const std::string& name, int dof) {
    for (std::size_t i = 0; i < q.size(); ++i)
        if (!std::isfinite(q.data()[i]))
            throw std::invalid_argument(name + ": row " + std::to_string(i / dof) + ", joint " + std::to_string(i % dof) +
                                        " is not finite");
}

// Throws std::invalid_argument unless the array holds rows of `dof` finite joint positions. Returns the row count.
inline std::size_t require_states(const Array<double>& q, const std::string& name, int dof) {
    require_shape(q, name, {-1, dof});
    require_finite(q, name, dof);
    return q.shape(0);
}

inline void require_resolution(double resolution) {
    if (!std::isfinite(resolution) || resolution < 1e-6)
        throw std::invalid_argument("resolution must be finite and at least 1e-6 rad");
}

template <class T>
std::vector<T> to_vector(const Array<T>& array, const std::string& name, std::int64_t count) {
    require_shape(array, name, {count});
    return std::vector<T>(array.data(), array.data() + array.size());
}

inline std::vector<Vec3<double>> to_vectors3(const Array<double>& array, const std::string& name, std::int64_t count) {
    require_shape(array, name, {count, 3});
    std::vector<Vec3<double>> vectors;
    for (const double* v = array.data(); v != array.data() + array.size(); v += 3) vectors.push_back({v[0], v[1], v[2]});
    return vectors;
}

// One row-major 4 x 4 matrix.
inline Transform<double> to_transform(const double* m) {
    return {{m[0], m[4], m[8]}, {m[1], m[5], m[9]}, {m[2], m[6], m[10]}, {m[3], m[7], m[11]}};
}

inline std::vector<Transform<double>> to_transforms(const Array<double>& array, const std::string& name, std::int64_t count) {
    require_shape(array, name, {count, 4, 4});
    std::vector<Transform<double>> transforms;
    for (const double* m = array.data(); m != array.data() + array.size(); m += 16) transforms.push_back(to_transform(m));
    return transforms;
}

// A new NumPy array of this shape.
template <class T>
nb::ndarray<nb::numpy, T, nb::c_contig> new_array(std::initializer_list<std::size_t> shape) {
    std::size_t size = 1;
    for (const std::size_t length : shape) size *= length;
    auto values = std::make_unique<T[]>(size);
    nb::capsule owner(values.get(), [](void* p) noexcept { delete[] static_cast<T*>(p); });
    return nb::ndarray<nb::numpy, T, nb::c_contig>(values.release(), shape, owner);
}

}  // namespace plancurate
