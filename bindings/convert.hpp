// From the core to Python: arrays, errors, interruption.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "lostmotion/analysis/response.hpp"
#include "lostmotion/simulation/run.hpp"

namespace lostmotion::binding {

namespace nb = nanobind;

inline bool poll_signals(void*) {
    nb::gil_scoped_acquire hold;
    return PyErr_CheckSignals() != 0;
}

inline const char* contact_name(Contact c) {
    return c == input_contact ? "input shaft" : c == twist_contact ? "twist of the gear" : "load bearing";
}

struct SolverError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Why a run has no continuation.
inline std::string status_text(Status status, double time, Contact contact) {
    const std::string at = "at t = " + std::to_string(time) + " s";
    switch (status) {
        case Status::jammed:
            return "no combination of sticking and slipping contacts is consistent " + at +
                   ": the friction jams. Give the gearbox a compliance, or lower its losses.";
        case Status::outside:
            return "the state left the range that the loss map can be extended to " + at +
                   " (1000 times its data). The drive is unstable, or its data or inputs have a wrong unit.";
        case Status::zeno:
            return "switching instants of the contact '" + std::string(contact_name(contact)) + "' accumulate " + at +
                   ": infinitely many in finite time. The model ends here.";
        case Status::unseen:
            return "the drive has dry contacts, which do not feel a nonlinear torque. Take them out, or make the "
                   "torque "
                   "piecewise linear.";
        default: return "interrupted";
    }
}

// Turns a status into an exception; the signal's own exception is already set when a run was interrupted.
inline void check(Status status, double time, Contact contact) {
    if (status == Status::done) return;
    if (status == Status::interrupted) throw nb::python_error();
    throw SolverError(status_text(status, time, contact));
}

using Array = nb::ndarray<nb::numpy, double>;

// Hands data over to Python without a copy.
inline Array as_array(std::unique_ptr<double[]> data, const std::vector<std::size_t>& shape) {
    double* raw = data.release();
    nb::capsule owner(raw, [](void* p) noexcept { delete[] static_cast<double*>(p); });
    return Array(raw, shape.size(), shape.data(), owner);
}

inline State to_state(const std::array<double, n_states>& v) {
    State x{};
    std::copy(v.begin(), v.end(), x.begin());
    return x;
}
inline std::array<double, n_states> from_state(const State& x) {
    std::array<double, n_states> v;
    std::copy_n(x.begin(), n_states, v.begin());
    return v;
}

// The course of a motion and whether the inputs are constant, as numbers.
using CourseNumbers = std::array<double, n_states + n_inputs + 6>;
inline CourseNumbers from_course(const Course& c, bool steady) {
    CourseNumbers v{};
    auto next = std::copy(c.input.begin(), c.input.end(), std::copy(c.rate.begin(), c.rate.end(), v.begin()));
    const auto& twist = c.twist[0];
    for (const double x : {double(c.rate_known), double(twist.off_zero), twist.touch_size, twist.doubt,
                           twist.most_doubt, double(steady)})
        *next++ = x;
    return v;
}
inline Course to_course(const CourseNumbers& v) {
    Course c;
    std::copy_n(v.begin(), n_states, c.rate.begin());
    std::copy_n(v.begin() + n_states, n_inputs, c.input.begin());
    const double* rest = &v[n_states + n_inputs];
    c.rate_known = rest[0] != 0.0;
    c.twist[0] = {rest[1] != 0.0, rest[2], rest[3], rest[4]};
    return c;
}

// Switching as numbers: time, kind, contact, contact modes before and after, T_2 before and after.
inline constexpr std::size_t switching_columns = 11;
inline Array switching_table(const RunReport& report) {
    const std::size_t n = report.switchings.size();
    auto data = std::make_unique<double[]>(n * switching_columns);
    for (std::size_t k = 0; k < n; ++k) {
        const Switching& s = report.switchings[k];
        double* row = &data[k * switching_columns];
        row[0] = s.time;
        row[1] = s.input_jump ? -1.0 : static_cast<double>(s.kind);
        row[2] = s.contact;
        for (int c = 0; c < n_contacts; ++c) {
            row[3 + c] = s.before.modes[c];
            row[6 + c] = s.after.modes[c];
        }
        row[9] = s.torque_before;
        row[10] = s.torque_after;
    }
    return as_array(std::move(data), {n, switching_columns});
}

// Flows, changes of the stored energies, residual, turned over; named by ENERGY in results.py.
inline constexpr std::size_t ledger_size = n_flows + 4;
inline std::array<double, ledger_size> ledger_values(const EnergyLedger& e) {
    std::array<double, ledger_size> values;
    auto to = std::copy(e.flow.begin(), e.flow.end(), values.begin());
    *to++ = e.kinetic_end - e.kinetic_begin;
    *to++ = e.elastic_end - e.elastic_begin;
    *to++ = e.residual();
    *to++ = e.turned_over;
    return values;
}

// Shape of one result and where its values lie.
template <class F>
nb::object column(const std::vector<ResponseResult>& results, std::vector<std::size_t> shape, F&& values) {
    std::size_t width = 1;
    for (const std::size_t n : shape) width *= n;
    shape.insert(shape.begin(), results.size());
    auto data = std::make_unique<double[]>(results.size() * width);
    for (std::size_t k = 0; k < results.size(); ++k) values(results[k], &data[k * width]);
    return nb::cast(as_array(std::move(data), shape));
}

// Polls for Ctrl-C and reports progress while other threads work.
class Watch {
 public:
    explicit Watch(const nb::object& progress) : progress_(progress) {}
    bool operator()(std::size_t done) {
        nb::gil_scoped_acquire hold;
        raised_ = raised_ || PyErr_CheckSignals() != 0;
        if (raised_) return false;
        if (!progress_.is_none()) progress_(done);
        return true;
    }
    void check() const {
        if (raised_) throw nb::python_error();
    }

 private:
    const nb::object& progress_;
    bool raised_ = false;
};

}  // namespace lostmotion::binding
