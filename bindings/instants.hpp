// A train at one instant, explained and as a linear model.
#pragma once

#include "interruption.hpp"
#include "lostmotion/analysis/train_explain.hpp"
#include "lostmotion/analysis/train_linear.hpp"
#include "train.hpp"

namespace lostmotion::binding {

// Values of the channels; contacts, whose shares are the capacities forward and backward by element; motors.
inline Record explain_point(const model::Assembly& a, const TrainPoint& p) {
    nb::list contacts, motors;
    for (const ContactReport& c : explain_contacts(a, p)) {
        nb::dict one, shares;
        for (const model::CapacityShare& s : c.shares)
            shares[s.element.c_str()] = nb::make_tuple(s.forward, s.backward);
        one["name"] = c.name, one["mode"] = c.mode, one["speed"] = c.speed, one["torque"] = c.torque;
        one["determined"] = c.determined;
        one["capacity_forward"] = c.capacity_forward, one["capacity_backward"] = c.capacity_backward;
        one["shares"] = shares;
        contacts.append(one);
    }
    for (const MotorReport& m : explain_motors(a, p)) {
        nb::dict one;
        one["name"] = m.name, one["command_forward"] = m.command_forward, one["command_backward"] = m.command_backward;
        motors.append(one);
    }
    Record out;
    out["values"] = p.values, out["contacts"] = contacts, out["motors"] = motors;
    return out;
}

// States, hysteresis capacities and inputs at the point, by name; rows of the rates; names and rows of the outputs; the
// modes of the contacts by name.
inline Record linearize_point(const model::Assembly& a, const std::vector<TrainChannel>& channels,
                              const TrainPoint& p) {
    const LinearRegime m = linearize(a, channels, p);
    const std::size_t width = m.states.size() + static_cast<std::size_t>(a.layout().inputs) + 1;
    const auto matrix = [&](const std::vector<std::vector<double>>& rows) {
        return column(rows, {width},
                      [](const std::vector<double>& r, double* to) { std::copy(r.begin(), r.end(), to); });
    };
    nb::dict states, inputs, modes;
    for (std::size_t k = 0; k < m.states.size(); ++k) states[m.states[k].c_str()] = m.state[k];
    const std::vector<std::string> names = model::input_names(a);
    for (std::size_t k = 0; k < names.size(); ++k) inputs[names[k].c_str()] = p.now.input[0][k];
    const model::Regime r = a.build(p.key);
    for (int c = 0; c < a.layout().contacts; ++c)
        modes[model::contact_name(a, c).c_str()] = r.at_rest[c] ? 0 : int(p.key.modes[c]);
    Record out;
    out["states"] = states, out["capacities"] = in_order(capacities_at(a, p.now.memory.data())), out["inputs"] = inputs;
    out["rates"] = matrix(m.rate), out["outputs"] = m.outputs, out["values"] = matrix(m.output);
    out["contacts"] = modes;
    return out;
}

// Runs to an instant: use(run, point) there.
template <class Use>
auto at_instant(const Case& one, double time, Use&& use) {
    TrainOptions options;
    options.duration = time;
    options.interrupted = poll_signals;
    TrainPoint point;
    TrainReport report;
    {
        nb::gil_scoped_release release;
        report = one.train->reach(one.inputs, one.start, options, point);
    }
    check_train_run(report, one.assembly());
    return use(*one.train, point);
}

inline void bind_instants(nb::module_& m) {
    m.def(
        "explain_at",
        [](const Case& one, double time) {
            return at_instant(
                one, time, [](const TrainRun& run, const TrainPoint& p) { return explain_point(run.assembly(), p); });
        },
        "case"_a, "time"_a);
    m.def(
        "linearize_at",
        [](const Case& one, double time) {
            return at_instant(one, time, [](const TrainRun& run, const TrainPoint& p) {
                return linearize_point(run.assembly(), run.channels(), p);
            });
        },
        "case"_a, "time"_a);
}

}  // namespace lostmotion::binding
