// What ends a run before its time: Ctrl-C, or a motion that has no continuation.
#pragma once

#include <nanobind/nanobind.h>

#include <chrono>
#include <stdexcept>

#include "lostmotion/simulation/result_names.hpp"

namespace lostmotion::binding {

namespace nb = nanobind;

// The core polls every few microseconds; taking the lock of the interpreter so often would slow down other threads.
inline bool poll_signals(void*) {
    using namespace std::chrono;
    thread_local steady_clock::time_point asked_at;
    const steady_clock::time_point now = steady_clock::now();
    if (now - asked_at < 20ms) return false;
    asked_at = now;
    nb::gil_scoped_acquire hold;
    return PyErr_CheckSignals() != 0;
}

struct SolverError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Turns a status into an exception; the signal's own exception is already set when a run was interrupted.
inline void check(Status status, double time, Contact contact) {
    if (status == Status::done) return;
    if (status == Status::interrupted) throw nb::python_error();
    throw SolverError(status_text(status, time, contact));
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
