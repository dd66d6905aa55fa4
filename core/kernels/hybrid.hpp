// A motion as a hybrid system for an integrator that is not ours: rates, guards, and what follows at an event.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "stepping.hpp"

namespace lostmotion {

// A guard has fallen where it lies below zero by this share of its natural magnitude: an integrator finds a crossing to
// its tolerance only, and behind it the next mode is determinate.
inline constexpr double fallen = 1e-9;

template <class System>
void SimulationOf<System>::place(double time, const StateOf<D>& x, const Inputs& input) {
    now_.time = time;
    now_.x = x;
    now_.input = input;
    now_.steady = false;
    now_.course.forget();
    Inputs same = input;
    resume(now_.input, same, 1.0);
}

template <class System>
StateOf<typename System::Dims> SimulationOf<System>::rates() {
    const Regime& r = regime();
    const Inputs input = inputs();
    StateOf<D> out{};
    each_rate<D>(r, [&](int k, const LinearForm& f) { out[k] = evaluate<D>(f, now_.x, now_.memory, input); });
    return out;
}

template <class System>
auto SimulationOf<System>::guards() -> GuardValues {
    const Regime& r = regime();
    const auto& entry = solver_.cache().entry(now_.key);
    const Inputs input = inputs();
    GuardValues out;
    for (std::size_t g = 0; g < guard_count(); ++g) out[g] = 1.0;
    for (std::size_t g = 0; g < static_cast<std::size_t>(entry.n_guards); ++g) {
        if (r.guards[g].behind) continue;
        const double natural = entry.near_event[g] / far_from_event;
        out[g] = evaluate<D>(r.guards[g].form, now_.x, now_.memory, input) / (natural > 0.0 ? natural : 1.0) + fallen;
    }
    return out;
}

template <class System>
auto SimulationOf<System>::lowest_guard() -> const typename System::Guard* {
    const auto values = guards();
    const auto lowest = std::min_element(values.begin(), values.begin() + guard_count());
    // The integrator may have stopped just before the zero.
    return *lowest < 0.5 * fallen ? &regime().guards[static_cast<std::size_t>(lowest - values.begin())] : nullptr;
}

// The next regime after a guard has fallen, or, if there is none, after inputs have changed.
template <class System>
Status SimulationOf<System>::follow(const typename System::Guard* fired) {
    if (fired != nullptr && fired->kind == System::Guard::outside) return Status::outside;
    InstantOf<D> now{};
    now.time = now_.time;
    now.x = now_.x;
    now.memory = now_.memory;
    now.input[0] = inputs();
    now.input_magnitudes = magnitudes(now.input[0]);
    const Inputs before = fired != nullptr ? now.input[0] : now_.course.input;
    const Found found = system_.next(solver_.cache(), now, fired, now_.key, before);
    if (found != Found::yes) return status_of(found);
    now_.x = now.x;
    now_.memory = now.memory;
    now_.course = {};
    now_.course.input = now.input[0];
    return Status::done;
}

template <class System>
Status SimulationOf<System>::settle() {
    constexpr int most = 100;
    Status status = find_regime();
    while (status == Status::done && controllers_ && !loop_.ticks.before(now_.time, next_tick())) {
        Inputs same = now_.input;
        resume(now_.input, same, 1.0);
        if (!controllers_->tick()) return Status::controller;
        now_.control = controllers_->course();
        controllers_->write_commands(now_.input);
    }
    for (int k = 0; status == Status::done; ++k) {
        const typename System::Guard* fired = lowest_guard();
        if (fired == nullptr && k > 0) break;
        if (k == most) return Status::zeno;
        status = follow(fired);
    }
    return status;
}

template <class System>
double SimulationOf<System>::next_tick() const {
    return controllers_ ? loop_.ticks.time(now_.control.next) : std::numeric_limits<double>::infinity();
}

template <class System>
bool SimulationOf<System>::accept() {
    const Inputs input = inputs();
    if (follows_inputs(regime()) && !(input == now_.course.input)) return true;
    now_.course.input = input;
    return false;
}

}  // namespace lostmotion
