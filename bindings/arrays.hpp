// Numbers of the core as arrays and tuples of Python.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <tuple>
#include <vector>

namespace lostmotion::binding {

namespace nb = nanobind;
using namespace nb::literals;

using Array = nb::ndarray<nb::numpy, double>;
using Record = nb::typed<nb::dict, nb::str, nb::any>;  // values by their keys
using Room = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// Hands data over to Python without a copy.
inline Array as_array(std::unique_ptr<double[]> data, const std::vector<std::size_t>& shape) {
    double* raw = data.release();
    nb::capsule owner(raw, [](void* p) noexcept { delete[] static_cast<double*>(p); });
    return Array(raw, shape.size(), shape.data(), owner);
}

inline Array as_array(const std::vector<double>& values, const std::vector<std::size_t>& shape) {
    auto data = std::make_unique_for_overwrite<double[]>(values.size());
    std::copy(values.begin(), values.end(), data.get());
    return as_array(std::move(data), shape);
}

// A member of each of several, such as a name; or several members, as tuples.
template <class All, class Member>
auto each_of(const All& all, Member member) {
    std::vector<std::decay_t<decltype(std::invoke(member, *all.begin()))>> out;
    for (const auto& one : all) out.push_back(std::invoke(member, one));
    return out;
}
template <class All, class... Members>
auto rows_of(const All& all, Members... members) {
    return each_of(all, [=](const auto& one) { return std::make_tuple(std::invoke(members, one)...); });
}

// An entry of each result, `shape` the shape of one: values(result, to) writes it.
template <class Result, class F>
Array column(const std::vector<Result>& results, std::vector<std::size_t> shape, F&& values) {
    std::size_t width = 1;
    for (const std::size_t n : shape) width *= n;
    shape.insert(shape.begin(), results.size());
    auto data = std::make_unique<double[]>(results.size() * width);
    for (std::size_t k = 0; k < results.size(); ++k) values(results[k], &data[k * width]);
    return as_array(std::move(data), shape);
}

// One number of each result.
template <class Result, class F>
Array numbers(const std::vector<Result>& results, F&& value) {
    return column(results, {}, [&](const Result& r, double* to) { *to = static_cast<double>(value(r)); });
}

}  // namespace lostmotion::binding
