// The C interface: trains, step by step and in one go.
#include "lostmotion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "lostmotion/analysis/train_linear.hpp"
#include "lostmotion/drive/parameters.hpp"
#include "lostmotion/model/train_description.hpp"
#include "lostmotion/simulation/result_names.hpp"
#include "lostmotion/simulation/train_stepping.hpp"

namespace lm = lostmotion;
using lm::model::Coupling;

struct lm_train {
    lm::model::TrainDescription description;
    std::string error;

    // Runs change(), which adds an element; what it throws or returns as text is the error.
    template <class Change>
    int attempt(Change&& change) {
        try {
            error = change();
        } catch (const std::exception& e) {
            error = e.what();
        }
        return error.empty() ? LM_OK : LM_INVALID;
    }
};

namespace {

std::string text(const char* s) { return s == nullptr ? std::string() : std::string(s); }

std::string name_error(const lm_train& train, const char* name) {
    if (name == nullptr || *name == '\0') return "an element has no name";
    const auto taken = [&](const auto& elements) {
        for (const auto& e : elements)
            if (e.name == name) return true;
        return false;
    };
    const auto& t = train.description.train;
    if (taken(t.shafts) || taken(t.motors) || taken(t.gears) || taken(t.brakes) || taken(t.couplings) ||
        taken(t.angle_torques))
        return "the name '" + text(name) + "' is taken; use another one";
    return {};
}

std::vector<double> list(const double* from, std::size_t n) {
    return from == nullptr ? std::vector<double>() : std::vector<double>(from, from + n);
}

// "" if all numbers are finite and rise.
std::string rising_error(const std::string& what, const std::vector<double>& v, double above) {
    for (const double x : v) {
        if (!(std::isfinite(x) && x > above)) return what + " must rise, from above " + std::to_string(above);
        above = x;
    }
    return {};
}
std::string finite_error(const std::string& what, const std::vector<double>& v) {
    for (const double x : v)
        if (!std::isfinite(x)) return what + " must be finite";
    return {};
}

// The curve, or what is wrong with it.
std::string read(const lm_curve& c, const std::string& what, lm::TorsionCurve& to) {
    if (c.slopes == nullptr || (c.n_breaks > 0 && c.breaks == nullptr)) return what + ": breaks or slopes are missing";
    std::vector<double> breaks = list(c.breaks, c.n_breaks), slopes = list(c.slopes, c.n_breaks + 1);
    if (auto e = rising_error(what + ": breaks", breaks, 0.0); !e.empty()) return e;
    if (auto e = finite_error(what + ": slopes", slopes); !e.empty()) return e;
    to = lm::TorsionCurve(std::move(breaks), std::move(slopes));
    return {};
}
std::string read(const lm_periodic_curve& c, const std::string& what, lm::model::PeriodicCurve& to) {
    if (c.n == 0 || c.angles == nullptr || c.values == nullptr) return what + ": angles or values are missing";
    std::vector<double> angles = list(c.angles, c.n), values = list(c.values, c.n);
    if (!(std::isfinite(c.period) && c.period > 0.0)) return what + ": the period must be > 0";
    if (auto e = finite_error(what + ": values", values); !e.empty()) return e;
    for (std::size_t k = 0; k < c.n; ++k)
        if (!(angles[k] >= 0.0 && angles[k] < c.period && (k == 0 || angles[k] > angles[k - 1])))
            return what + ": angles must rise, from 0 on and below the period";
    to = lm::model::PeriodicCurve(c.period, std::move(angles), std::move(values));
    return {};
}
std::string read(const lm_loss_map& m, const std::string& what, lm::LossMap& to) {
    if (m.speeds == nullptr || m.loads == nullptr || m.values == nullptr || m.n_speeds < 2 || m.n_loads < 2)
        return what + ": a loss map needs two speeds and two loads at least";
    std::vector<double> speeds = list(m.speeds, m.n_speeds), loads = list(m.loads, m.n_loads),
                        values = list(m.values, m.n_speeds * m.n_loads);
    if (auto e = rising_error(what + ": speeds", speeds, -1e-300); !e.empty()) return e;
    if (auto e = rising_error(what + ": loads", loads, -std::numeric_limits<double>::infinity()); !e.empty()) return e;
    if (auto e = finite_error(what + ": values", values); !e.empty()) return e;
    to = lm::LossMap(std::move(speeds), std::move(loads), std::move(values));
    return {};
}

// A drive with these parameters, of which a motor or gear is taken.
std::string read(const lm_parameter* parameters, std::size_t n, const std::string& what, lm::Drive& to) {
    for (std::size_t k = 0; k < n; ++k) {
        const lm::Parameter* p = lm::find_parameter(text(parameters[k].key));
        if (p == nullptr) return what + ": there is no parameter '" + text(parameters[k].key) + "'";
        if (!std::isfinite(parameters[k].value)) return what + ": " + text(parameters[k].key) + " must be finite";
        p->in(to) = parameters[k].value;
    }
    return {};
}

}  // namespace

extern "C" {

int lm_interface_version(void) { return LM_INTERFACE_VERSION; }

size_t lm_parameter_count(void) { return std::size(lm::parameters); }
const char* lm_parameter_key(size_t k) { return k < lm_parameter_count() ? lm::parameters[k].key : nullptr; }
const char* lm_parameter_unit(size_t k) { return k < lm_parameter_count() ? lm::parameters[k].unit : nullptr; }

lm_train* lm_train_new(void) { return new (std::nothrow) lm_train; }
void lm_train_free(lm_train* train) { delete train; }
const char* lm_train_error(const lm_train* train) { return train->error.c_str(); }

int lm_add_shaft(lm_train* train, const char* name, double inertia, double viscous_friction, double friction_torque,
                 double breakaway_torque, const lm_curve* drag, int loaded) {
    return train->attempt([&] {
        std::string wrong = name_error(*train, name);
        lm::model::Shaft s;
        if (wrong.empty() && drag != nullptr) wrong = read(*drag, "shaft '" + text(name) + "': drag", s.drag);
        if (!wrong.empty()) return wrong;
        s.name = name;
        s.inertia = inertia;
        s.viscous_friction = viscous_friction;
        s.friction = {friction_torque, breakaway_torque, {}, {}};
        s.loaded = loaded != 0;
        train->description.add_shaft(std::move(s));
        return wrong;
    });
}

int lm_add_motor(lm_train* train, const char* name, const char* shaft, const lm_parameter* parameters, size_t n,
                 int torque_source, double torque_limit) {
    return train->attempt([&] {
        std::string wrong = name_error(*train, name);
        lm::Drive drive;
        if (wrong.empty()) wrong = read(parameters, n, "motor '" + text(name) + "'", drive);
        if (!wrong.empty()) return wrong;
        drive.motor.kind = torque_source != 0 ? lm::Motor::torque_source : lm::Motor::dc;
        train->description.add_motor(name, text(shaft), drive.motor, torque_limit);
        return wrong;
    });
}

int lm_add_gear(lm_train* train, const char* name, const char* input, const char* output,
                const lm_parameter* parameters, size_t n, const lm_curve* stiffness, const lm_loss_map* losses,
                const double* efficiencies, double mesh_damping, const lm_periodic_curve* transmission_error) {
    return train->attempt([&] {
        const std::string what = "gear '" + text(name) + "'";
        std::string wrong = name_error(*train, name);
        lm::Drive drive;
        lm::model::PeriodicCurve error;
        if (wrong.empty()) wrong = read(parameters, n, what, drive);
        if (wrong.empty() && stiffness != nullptr) {
            drive.gearbox.compliance = lm::Gearbox::torsion_curve;
            wrong = read(*stiffness, what + ": stiffness", drive.gearbox.curve);
        }
        if (wrong.empty() && losses != nullptr) {
            drive.gearbox.losses = lm::Gearbox::loss_map;
            wrong = read(*losses, what + ": losses", drive.gearbox.map);
        }
        if (wrong.empty() && transmission_error != nullptr)
            wrong = read(*transmission_error, what + ": transmission error", error);
        if (!wrong.empty()) return wrong;
        std::optional<std::pair<double, double>> both;
        if (efficiencies != nullptr) both.emplace(efficiencies[0], efficiencies[1]);
        train->description.add_gear(name, text(input), text(output), drive.gearbox, both, mesh_damping,
                                    transmission_error == nullptr ? nullptr : &error);
        return wrong;
    });
}

int lm_set_housing(lm_train* train, const char* gear, const char* shaft) {
    return train->attempt([&] {
        const auto named = [](const char* name) {
            return [name](const auto& element) { return element.name == text(name); };
        };
        const lm::model::Train& t = train->description.train;
        if (std::ranges::none_of(t.gears, named(gear))) return "there is no gear '" + text(gear) + "'";
        if (std::ranges::none_of(t.shafts, named(shaft))) return "there is no shaft '" + text(shaft) + "'";
        train->description.set_housing(text(gear), text(shaft));
        return std::string{};
    });
}

int lm_add_brake(lm_train* train, const char* name, const char* shaft, double torque, double breakaway_torque) {
    return train->attempt([&] {
        std::string wrong = name_error(*train, name);
        if (wrong.empty()) train->description.add_brake(name, text(shaft), torque, breakaway_torque);
        return wrong;
    });
}

static int add_coupling(lm_train* train, const char* name, const char* input, const char* output, double torque,
                        double breakaway_torque, Coupling::Kind kind) {
    return train->attempt([&] {
        std::string wrong = name_error(*train, name);
        if (wrong.empty())
            train->description.add_coupling(name, text(input), text(output), torque, breakaway_torque, kind);
        return wrong;
    });
}
int lm_add_clutch(lm_train* train, const char* name, const char* input, const char* output, double torque,
                  double breakaway_torque) {
    return add_coupling(train, name, input, output, torque, breakaway_torque, Coupling::clutch);
}
int lm_add_safety_clutch(lm_train* train, const char* name, const char* input, const char* output, double torque,
                         double breakaway_torque) {
    return add_coupling(train, name, input, output, torque, breakaway_torque, Coupling::safety_clutch);
}
int lm_add_freewheel(lm_train* train, const char* name, const char* input, const char* output) {
    return add_coupling(train, name, input, output, 0.0, 0.0, Coupling::freewheel);
}

int lm_add_angle_torque(lm_train* train, const char* name, const char* shaft, const lm_periodic_curve* torque) {
    return train->attempt([&] {
        std::string wrong = name_error(*train, name);
        lm::model::PeriodicCurve curve;
        if (wrong.empty() && torque == nullptr) wrong = "angle torque '" + text(name) + "' has no curve";
        if (wrong.empty()) wrong = read(*torque, "angle torque '" + text(name) + "'", curve);
        if (wrong.empty()) train->description.add_angle_torque(name, text(shaft), curve);
        return wrong;
    });
}

int lm_train_check(lm_train* train) {
    return train->attempt([&] { return lm::TrainRun(train->description.train).error(); });
}

}  // extern "C"

// --- step by step ---

struct lm_simulation {
    lm_simulation(const lm::model::Train& train, double step)
        : simulation(train, step),
          states(lm::model::state_names(simulation.assembly())),
          inputs(lm::model::input_names(simulation.assembly())) {
        const auto& gears = simulation.assembly().train().gears;
        for (std::size_t g = 0; g < gears.size(); ++g)
            if (simulation.assembly().places().gears[g].hysteresis != lm::model::nowhere)
                capacities.push_back(gears[g].name);
    }

    lm::TrainStart start_of(const double* x, const double* values) const {
        lm::TrainStart start;
        for (std::size_t k = 0; k < states.size() && x != nullptr; ++k) start.states[states[k]] = x[k];
        for (std::size_t k = 0; k < capacities.size() && values != nullptr; ++k)
            start.hysteresis_capacities[capacities[k]] = values[k];
        return start;
    }
    int failed(std::string sentence, int status = LM_INVALID) {
        error = std::move(sentence);
        return status;
    }
    int ended(lm::Status status) {
        if (status == lm::Status::done) return LM_OK;
        return simulation.with([&](const auto& s) {
            return failed(
                lm::train_status_text(simulation.assembly(), status, s.time(), s.stopped_at(), s.too_many_guards()),
                static_cast<int>(status));
        });
    }
    const std::vector<std::string>* names(lm_kind kind) const {
        return kind == LM_STATES       ? &states
               : kind == LM_INPUTS     ? &inputs
               : kind == LM_CAPACITIES ? &capacities
                                       : nullptr;
    }

    lm::TrainSimulation simulation;
    std::vector<std::string> states, inputs, capacities;
    std::string error;
};

namespace {

bool finite(const double* v, std::size_t n) {
    return v != nullptr && std::all_of(v, v + n, [](double x) { return std::isfinite(x); });
}

// What a snapshot consists of, number by number: use(number) may read or write.
template <class Snapshot, class Use>
void each_number_of_snapshot(Snapshot& s, Use&& use) {
    use(s.time);
    for (auto& x : s.x) use(x);
    for (auto& m : s.memory) use(m);
    for (auto& m : s.key.modes) use(m);
    for (auto& b : s.key.branch) use(b);
    for (auto& u : s.input) use(u);
    use(s.started);
    use(s.steady);
    lm::each_number(s.course, use);
}

}  // namespace

extern "C" {

lm_simulation* lm_simulation_new(lm_train* train, double step) {
    lm_simulation* made = nullptr;
    train->attempt([&]() -> std::string {
        if (!(std::isfinite(step) && step > 0.0)) return "the step must be > 0 and finite";
        std::string wrong = lm::TrainRun(train->description.train).error();
        if (wrong.empty()) made = new lm_simulation(train->description.train, step);
        return wrong;
    });
    return made;
}
void lm_simulation_free(lm_simulation* simulation) { delete simulation; }
const char* lm_error(const lm_simulation* simulation) { return simulation->error.c_str(); }

size_t lm_count(const lm_simulation* simulation, lm_kind kind) {
    const auto* names = simulation->names(kind);
    return names != nullptr ? names->size() : simulation->simulation.channels().size();
}
const char* lm_name(const lm_simulation* simulation, lm_kind kind, size_t k) {
    if (k >= lm_count(simulation, kind)) return nullptr;
    const auto* names = simulation->names(kind);
    return names != nullptr ? (*names)[k].c_str() : simulation->simulation.channels()[k].name.c_str();
}
const char* lm_unit(const lm_simulation* simulation, lm_kind kind, size_t k) {
    if (k >= lm_count(simulation, kind)) return nullptr;
    return kind == LM_VARIABLES ? simulation->simulation.channels()[k].unit.c_str() : "";
}

int lm_reset(lm_simulation* simulation, const double* states, const double* capacities) {
    if (states != nullptr && !finite(states, simulation->states.size()))
        return simulation->failed("a state is not finite");
    if (capacities != nullptr && !finite(capacities, simulation->capacities.size()))
        return simulation->failed("a hysteresis capacity is not finite");
    std::string wrong = simulation->simulation.reset(simulation->start_of(states, capacities));
    return wrong.empty() ? int(LM_OK) : simulation->failed(std::move(wrong));
}

int lm_advance(lm_simulation* simulation, double interval, const double* begin, const double* end) {
    const std::size_t n = simulation->inputs.size();
    const double time = simulation->simulation.time();
    if (!(std::isfinite(interval) && interval > 0.0 && time + interval > time))
        return simulation->failed("the interval must be > 0, finite and longer than the rounding of the time");
    if (n > 0 && !(finite(begin, n) && finite(end, n))) return simulation->failed("an input is missing or not finite");
    return simulation->ended(simulation->simulation.advance(interval, {begin, n}, {end, n}));
}
double lm_time(const lm_simulation* simulation) { return simulation->simulation.time(); }

int lm_read(lm_simulation* simulation, double* variables) {
    return simulation->simulation.with([&](auto& s) {
        if (const lm::Status status = s.find_regime(); status != lm::Status::done) return simulation->ended(status);
        const std::vector<double> values = s.values();
        std::copy(values.begin(), values.end(), variables);
        return int(LM_OK);
    });
}

size_t lm_state_size(const lm_simulation* simulation) {
    return simulation->simulation.with([](const auto& s) {
        std::size_t n = 0;
        each_number_of_snapshot(s.snapshot(), [&](const auto&) { ++n; });
        return n;
    });
}
int lm_get_state(const lm_simulation* simulation, double* state) {
    simulation->simulation.with([&](const auto& s) {
        each_number_of_snapshot(s.snapshot(), [&](const auto& number) { *state++ = static_cast<double>(number); });
    });
    return LM_OK;
}
int lm_set_state(lm_simulation* simulation, const double* state) {
    if (!finite(state, lm_state_size(simulation))) return simulation->failed("a number of the state is not finite");
    simulation->simulation.with([&](auto& s) {
        auto snapshot = s.snapshot();
        each_number_of_snapshot(
            snapshot, [&](auto& number) { number = static_cast<std::remove_reference_t<decltype(number)>>(*state++); });
        s.restore(snapshot);
    });
    return LM_OK;
}

int lm_directional_derivative(lm_simulation* simulation, const double* states, const double* inputs, double* rates,
                              double* variables) {
    return simulation->simulation.with([&](auto& s) {
        if (const lm::Status status = s.find_regime(); status != lm::Status::done) return simulation->ended(status);
        const auto& a = simulation->simulation.assembly();
        const lm::LinearRegime regime = lm::linearize(a, simulation->simulation.channels(), s.point());
        const auto place = [](const std::vector<std::string>& in, const std::string& name) {
            return static_cast<std::size_t>(std::find(in.begin(), in.end(), name) - in.begin());
        };
        const auto along = [&](const std::vector<double>& row) {
            double sum = 0.0;
            for (std::size_t k = 0; k < regime.states.size() && states != nullptr; ++k)
                sum += row[k] * states[place(simulation->states, regime.states[k])];
            for (std::size_t k = 0; k < simulation->inputs.size() && inputs != nullptr; ++k)
                sum += row[regime.states.size() + k] * inputs[k];
            return sum;
        };
        if (rates != nullptr) {
            std::fill(rates, rates + simulation->states.size(), 0.0);
            for (std::size_t k = 0; k < regime.states.size(); ++k)
                rates[place(simulation->states, regime.states[k])] = along(regime.rate[k]);
        }
        if (variables != nullptr) {
            const auto& channels = simulation->simulation.channels();
            for (std::size_t c = 0; c < channels.size(); ++c) {
                const std::size_t k = place(regime.outputs, channels[c].name);
                const std::size_t i = place(simulation->inputs, channels[c].name);
                variables[c] = k < regime.outputs.size()                            ? along(regime.output[k])
                               : i < simulation->inputs.size() && inputs != nullptr ? inputs[i]
                                                                                    : 0.0;
            }
        }
        return int(LM_OK);
    });
}

int lm_run(lm_simulation* simulation, const lm_signal* inputs, const double* states, const double* capacities,
           double duration, double interval, size_t samples, double* variables) {
    const std::size_t n = simulation->inputs.size();
    if (!(std::isfinite(duration) && duration > 0.0 && std::isfinite(interval) && interval > 0.0))
        return simulation->failed("duration and interval must be > 0 and finite");
    if (samples > 0 && variables == nullptr) return simulation->failed("there is no place for the samples");
    if (static_cast<double>(samples) > 1.0 + duration / interval * (1.0 + 1e-12))
        return simulation->failed("there are more samples than intervals in the duration");
    std::vector<lm::Signal> signals(n);
    for (std::size_t i = 0; i < n; ++i) {
        const lm_signal& from = inputs[i];
        if (!(from.n_breakpoints > 0 && finite(from.breakpoints, 3 * from.n_breakpoints)) ||
            (from.n_sines > 0 && !finite(from.sines, 3 * from.n_sines)))
            return simulation->failed("input '" + simulation->inputs[i] +
                                      "' has no breakpoint, or a number is not finite");
        std::vector<std::array<double, 3>> breakpoints(from.n_breakpoints), sines(from.n_sines);
        for (std::size_t k = 0; k < from.n_breakpoints; ++k) {
            std::copy_n(from.breakpoints + 3 * k, 3, breakpoints[k].begin());
            if (k > 0 && breakpoints[k][0] <= breakpoints[k - 1][0])
                return simulation->failed("the breakpoints of input '" + simulation->inputs[i] +
                                          "' do not rise in time");
        }
        for (std::size_t k = 0; k < from.n_sines; ++k) std::copy_n(from.sines + 3 * k, 3, sines[k].begin());
        signals[i] = lm::signal_of(breakpoints, sines);
    }
    if (const int status = lm_reset(simulation, states, capacities); status != LM_OK) return status;
    lm::TrainOptions options;
    options.duration = duration;
    options.sample_interval = interval;
    options.samples = samples;
    options.energy = false;
    options.max_switchings = 0;
    const lm::TrainRun run(simulation->simulation.assembly().train());
    const lm::TrainReport report = run.run(signals, simulation->start_of(states, capacities), options, variables);
    return simulation->failed(lm::error_text(report, run.assembly()), static_cast<int>(report.status));
}

}  // extern "C"
