// What ends a run before its time: Ctrl-C, or a motion that has no continuation.
#pragma once

#include <nanobind/nanobind.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>

namespace lostmotion::binding {

namespace nb = nanobind;

// Ends the work of a pool of threads: Python delivers signals to the main thread alone. A pool that is started by a
// thread of another pool ends with that one, too.
class Stop {
 public:
    Stop() { flag_->outer = watched(); }
    void request() { flag_->requested = true; }
    // From now on the runs of this thread end on request.
    void watch() const { watched() = flag_; }

    static bool requested_here() {
        const Flag* flag = watched().get();
        while (flag != nullptr && !flag->requested) flag = flag->outer.get();
        return flag != nullptr;
    }

 private:
    struct Flag {
        std::shared_ptr<Flag> outer;
        std::atomic<bool> requested{false};
    };
    static std::shared_ptr<Flag>& watched() {
        thread_local std::shared_ptr<Flag> flag;
        return flag;
    }

    std::shared_ptr<Flag> flag_ = std::make_shared<Flag>();
};

// Whether this thread is to end its work; then Python's exception is set. Needs the lock of the interpreter.
inline bool interrupted_here() {
    if (Stop::requested_here()) {
        PyErr_SetNone(PyExc_KeyboardInterrupt);
        return true;
    }
    return PyErr_CheckSignals() != 0;
}

// The core polls every few microseconds; taking the lock of the interpreter so often would slow down other threads.
inline bool poll_signals(void*) {
    using namespace std::chrono;
    thread_local steady_clock::time_point asked_at;
    const steady_clock::time_point now = steady_clock::now();
    if (now - asked_at < 20ms) return false;
    asked_at = now;
    nb::gil_scoped_acquire hold;
    return interrupted_here();
}

struct SolverError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Polls for Ctrl-C and reports progress while other threads work.
class Watch {
 public:
    explicit Watch(const nb::object& progress) : progress_(progress) {}
    bool operator()(std::size_t done) {
        nb::gil_scoped_acquire hold;
        raised_ = raised_ || interrupted_here();
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

inline void bind_interruption(nb::module_& m) {
    nb::exception<SolverError>(m, "SolverError", PyExc_RuntimeError).attr("__doc__") =
        "The motion has no continuation; the message names time and contact.";
    nb::class_<Stop>(m, "Stop").def(nb::init<>()).def("request", &Stop::request).def("watch", &Stop::watch);
}

}  // namespace lostmotion::binding
