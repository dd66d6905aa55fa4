// A scenario step by step, whichever kernel it takes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "../simulation/given_motion.hpp"
#include "../simulation/train_stepping.hpp"
#include "variables.hpp"

namespace lostmotion {

class ScenarioSimulation {
 public:
    // The scenario has passed its check. It begins at its start.
    ScenarioSimulation(const Scenario& scenario, double step);
    // A train that has passed its check, from rest.
    ScenarioSimulation(const model::Train& train, double step) : ScenarioSimulation(stepped_scenario(train), step) {}

    struct Names {
        std::vector<std::string> states, inputs, capacities;
        std::vector<Variable> references;  // those of sampled controllers that are inputs, the last of them
    };
    const Names& names() const { return names_; }
    const Variables& variables() const { return variables_; }
    // How many inputs the solver has, those of controllers among them, and which of them is the k-th of the names.
    std::size_t solver_inputs() const { return begin_.size(); }
    std::size_t solver_input(std::size_t k) const { return free_[k]; }
    // The other way round.
    std::size_t input_of(int solver_input) const {
        return static_cast<std::size_t>(std::ranges::find(free_, static_cast<std::size_t>(solver_input)) -
                                        free_.begin());
    }
    std::size_t free_inputs() const { return free_.size(); }
    // The present value of an input that follows its signal in the scenario; NaN of one that is given.
    double played_input(std::size_t k) const;

    TrainSimulation& train() { return train_; }
    const TrainSimulation& train() const { return train_; }

    Motion& motion() { return train_.motion(); }
    const Motion& motion() const { return train_.motion(); }

    double time() const { return motion().time(); }
    // Why a status is what it is, in words; empty if all is well.
    std::string text(Status status) const;

    // To t = 0, with the contacts still to be found. Returns what is wrong with the start, or nothing.
    std::string reset(std::span<const double> states, std::span<const double> capacities);
    TrainStart train_start(std::span<const double> states, std::span<const double> capacities) const {
        return lostmotion::train_start(train_.assembly(), states, capacities);
    }

    // Each input of names().inputs runs in a straight line from its first to its second value, or follows its signal,
    // at the breakpoints of which the interval is divided.
    Status advance(double interval, std::span<const double> begin, std::span<const double> end);
    // The same without signals, with the answer of a shaft to its load torque.
    Status answer(double interval, std::span<const double> begin, std::span<const double> end, const LoadShaft& shaft,
                  LoadAnswer& out);
    bool follows_signals() const { return !played_.empty(); }
    // A shaft whose motion is given: its inputs among the names, and its variables.
    struct GivenShaft {
        std::size_t speed_input, acceleration_input;
        int angle, speed, acceleration;  // -1: there is no such variable
    };
    // The shaft of this name if its motion is given.
    std::optional<GivenShaft> given_shaft(const std::string& name) const;
    struct GivenCourse {
        GivenShaft shaft;
        MotionEnd to;
    };
    // The same, with motions in place of their inputs, in parts in which all accelerations are straight lines.
    Status advance(double interval, std::span<const double> begin, std::span<const double> end,
                   std::span<const GivenCourse> motions);
    // What acts at t = 0, for what is read before the first step.
    void hold(std::span<const double> inputs);

    // --- as a hybrid system, which an integrator of the caller's own solves ---

    // Windings exchange torque and speed with the solver within a tick.
    bool has_windings() const {
        return std::any_of(laws_.begin(), laws_.end(), [](const control::Axis& a) { return !!a.field_orientation; });
    }
    // At a time, with states by names().states and inputs by names().inputs, in the regime that it is in. Signals stay
    // on the line that they had when it was last settled, so that an integrator does not see the next one before the
    // event.
    void place(double time, std::span<const double> states, std::span<const double> inputs);
    void states(double* out) const;
    // Of the states.
    Status rates(double* out);
    std::size_t guard_count() const { return motion().guard_count(); }
    Status guards(double* out);
    Status settle();
    // The next tick of sampled controllers, or breakpoint of a signal that is followed [s].
    double next_event() const { return std::fmin(next_breakpoint(time()), motion().next_tick()); }
    bool accept() { return motion().find_regime() == Status::done && motion().accept(); }

    // All variables at the present instant, with the inputs at their last values.
    Status read(double* out);

    // False: the state is not one of such a simulation.
    bool restore(const MotionState& from);

    // Another scenario of the same elements, at the present state: the contacts are found anew.
    void go_on_from(const ScenarioSimulation& before);

    // The whole state as numbers, with one that tells whether they belong to this simulation and are whole.
    std::size_t state_size() const;
    void get_state(double* to) const;
    // False: the numbers are not those of a state of such a simulation.
    bool set_state(const double* from);

 private:
    // An input that follows its signal: of the segments between breakpoints, the one that holds.
    struct Played {
        std::size_t input;  // by its number among the names
        Signal signal;
        std::size_t segment = 0;
        Signal rate{};  // of a given speed, with the same breakpoints: its time derivative

        double line(double time) const;
    };

    // The sines of these inputs, which the solver adds.
    static InputSines played_sines(const Scenario& scenario);
    // By how much a time may miss a breakpoint, relative: one that accumulates from steps, one where an importer's
    // integrator has stopped.
    static constexpr double accumulated = 1e-12, stopped = 1e-9;
    // Signals on the lines that hold from here on.
    void follow_signals(double time, double missed) {
        for (Played& p : played_) p.segment = p.signal.segment(time + missed * time);
    }
    double next_breakpoint(double time) const;
    static Signal no_rate() { return {{}, {}}; }

    void name_all(const Scenario& scenario);

    void name_reference(const Scenario& scenario, const ControlledAxis& axis);
    // The last inputs, each in a straight line from its first to its second value.
    void set_references(std::span<const double> begin, std::span<const double> end, double interval);
    static void mix(std::uint64_t& hash, const void* bytes, std::size_t n);
    // What the controllers show. A motor with a winding has the torque of its currents, in the place of the straight
    // line that drives the mechanics.
    void read_controllers(double* out) const {
        std::vector<const double*> slots{motion().control().slots.data()};
        std::vector<std::array<double, control::n_winding_signals>> windings;
        for (const control::Axis& law : laws_) {
            windings.push_back(winding_signals_of(law, time(), slots.back()));
            slots.push_back(slots.back() + law.slots());
        }
        double* to = out + variables_.first_shown();
        for (const Variables::Shown& shown : variables_.shown()) {
            const auto a = static_cast<std::size_t>(shown.axis);
            *to++ = shown.signal < control::n_axis_signals
                        ? laws_[a].signal(shown.signal, slots[a])
                        : windings[a][static_cast<std::size_t>(shown.signal - control::n_axis_signals)];
        }
        for (std::size_t a = 0; a < laws_.size(); ++a)
            if (laws_[a].field_orientation) out[torques_[a]] = laws_[a].winding_torque(time(), slots[a]);
    }

    // With room for all that the controllers remember, also before they begin.
    MotionState whole_state() const;
    // Of the bits of numbers, as a number without a fraction.
    double sum(const double* first, const double* end) const;

    TrainSimulation train_;
    Control control_;
    std::vector<control::Axis> laws_;
    std::vector<std::size_t> torques_;  // variables of the motors that the laws turn
    Variables variables_;
    Names names_;
    std::vector<std::size_t> free_;   // inputs that no controller gives
    std::vector<std::size_t> first_;  // of each state the first of its name
    std::vector<Played> played_;
    std::vector<bool> own_reference_;  // of each reference, whether it is that of the scenario
    std::vector<double> begin_, end_;
    MotionState before_, scratch_;  // their memory is used again
    std::uint64_t identity_ = 0;
};

}  // namespace lostmotion
