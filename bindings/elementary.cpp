#include <cmath>
#include <limits>

#include "arrays.hpp"
#include "lostmotion/base/arctangent.hpp"
#include "lostmotion/base/powers.hpp"
#include "lostmotion/base/sine.hpp"
#include "module.hpp"

namespace lostmotion::binding {

namespace {

using AnyShape = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;

std::vector<std::size_t> shape_of(const AnyShape& x) {
    std::vector<std::size_t> shape(x.ndim());
    for (std::size_t k = 0; k < shape.size(); ++k) shape[k] = x.shape(k);
    return shape;
}

template <class F>
void bind_elementary_function(nb::module_& m, const char* name, const char* signature, F f) {
    m.def(
        name,
        [f](const AnyShape& x) {
            auto data = std::make_unique_for_overwrite<double[]>(x.size());
            std::transform(x.data(), x.data() + x.size(), data.get(), f);
            return as_array(std::move(data), shape_of(x));
        },
        "x"_a, nb::sig(signature));
}

template <class F>
void bind_elementary_function_of_two(nb::module_& m, const char* name, const char* signature, F f) {
    m.def(
        name,
        [f](const AnyShape& a, const AnyShape& b) {
            if (shape_of(a) != shape_of(b)) throw nb::value_error("both arrays must have the same shape");
            auto data = std::make_unique_for_overwrite<double[]>(a.size());
            std::transform(a.data(), a.data() + a.size(), b.data(), data.get(), f);
            return as_array(std::move(data), shape_of(a));
        },
        "a"_a, "b"_a, nb::sig(signature));
}

}  // namespace

void bind_elementary(nb::module_& m) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
#define OF_ONE(NAME) "def " NAME "(x: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]"
#define OF_TWO(NAME)                                                                       \
    "def " NAME                                                                            \
    "(a: numpy.typing.NDArray[numpy.float64], b: numpy.typing.NDArray[numpy.float64]) -> " \
    "numpy.typing.NDArray[numpy.float64]"
    bind_elementary_function(m, "sine", OF_ONE("sine"),
                             [](double x) { return std::isfinite(x) ? sine_cosine(x).sin : nan; });
    bind_elementary_function(m, "cosine", OF_ONE("cosine"),
                             [](double x) { return std::isfinite(x) ? sine_cosine(x).cos : nan; });
    bind_elementary_function(m, "exponential", OF_ONE("exponential"), [](double x) {
        return std::isnan(x) ? nan : x > 710.0 ? inf : x < -746.0 ? 0.0 : exponential(x);
    });
    bind_elementary_function(m, "exponential_minus_one", OF_ONE("exponential_minus_one"), [](double x) {
        return std::isnan(x) ? nan : x > 710.0 ? inf : x < -746.0 ? -1.0 : exponential_minus_one(x);
    });
    bind_elementary_function(m, "logarithm", OF_ONE("logarithm"), [](double x) {
        return x > 0.0 ? (std::isinf(x) ? inf : logarithm(x)) : x == 0.0 ? -inf : nan;
    });
    bind_elementary_function(m, "cube_root", OF_ONE("cube_root"), [](double x) { return cube_root(x); });
    bind_elementary_function_of_two(m, "arctangent", OF_TWO("arctangent"),
                                    [](double y, double x) { return arctangent(y, x); });
    bind_elementary_function_of_two(m, "power", OF_TWO("power"), [](double x, double y) {
        if (x > 0.0 && std::isfinite(x) && std::isfinite(y)) return power(x, y);
        return x == 0.0 && y > 0.0 ? 0.0 : x == 0.0 && y == 0.0 ? 1.0 : nan;
    });
#undef OF_ONE
#undef OF_TWO
}

}  // namespace lostmotion::binding
