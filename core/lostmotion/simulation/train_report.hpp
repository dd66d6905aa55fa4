// What a run of a train is given and what it gives.
#pragma once

#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "../model/power.hpp"
#include "result_names.hpp"
#include "sample_times.hpp"
#include "train_control.hpp"
#include "train_status.hpp"

namespace lostmotion {

// By name; what is left out is 0.
using Named = std::map<std::string, double>;

inline double value_of(const Named& values, const std::string& name) {
    const auto found = values.find(name);
    return found == values.end() ? 0.0 : found->second;
}

struct TrainStart {
    Named states;
    Named hysteresis_capacities;  // of gears [N m]
};

struct TrainOptions {
    double duration = 1.0;                     // [s]
    double sample_interval = 1e-3;             // [s]
    std::size_t samples = 0;                   // instants k * sample_interval to record, from k = 0
    std::vector<double> instants;              // these instead [s], ascending; exact solver, without control_out
    std::optional<std::vector<int>> channels;  // to record, by their place among TrainRun::channels(); left out, all
    bool energy = true;
    std::size_t max_switchings = 100000;  // kept; all are counted
    double tolerance = 0.0;               // relative, of the adaptive solver; 0: the exact one
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;
    Control control;                // nothing: the inputs alone act
    double* control_out = nullptr;  // (axes x signals) x samples, as ControlRecord

    SampleTimes times() const { return {sample_interval, instants.empty() ? samples : instants.size(), instants}; }
};

struct TrainSwitching {
    double time = 0.0;  // [s]
    bool input_jump = false;
    model::Guard::Kind kind = model::Guard::speed;
    int contact = -1, branch = -1;  // that it was about, if any
    model::Key before, after;
};

// Time, cause, the modes of all contacts before and after.
inline double* write_switching(const TrainSwitching& s, int contacts, double* to) {
    *to++ = s.time;
    *to++ = s.input_jump ? input_changed : static_cast<int>(s.kind);
    to = std::copy_n(s.before.modes.begin(), contacts, to);
    return std::copy_n(s.after.modes.begin(), contacts, to);
}

struct TrainEnergy {
    std::string name;
    model::PowerFlow::Kind kind;
    double energy = 0.0;  // [J] since the start
};

struct TrainReport {
    Status status = Status::done;
    std::string message;  // what is wrong with the start; then nothing has run
    double time = 0.0;    // [s] reached
    int contact = -1;     // at the last switching
    std::vector<double> x, memory;
    std::vector<TrainSwitching> switchings;
    std::size_t switching_count = 0;
    std::vector<TrainEnergy> energy;
    double stored_begin = 0.0, stored_end = 0.0, turned_over = 0.0;  // [J]
    double left_data_at = std::numeric_limits<double>::infinity();   // [s]
    long steps = 0;
    bool too_many_guards = false;  // a regime has more conditions than the kernel has room for

    template <class System, class Solver>
    void ended(const System& system, Solver& solver) {
        const model::Assembly& a = system.assembly();
        const model::Layout& n = a.layout();
        time = solver.time();
        contact = solver.stopped_at();
        switching_count = solver.switchings();
        too_many_guards = system.overflowed();
        x.resize(static_cast<std::size_t>(n.states));
        // Speeds that are tied may have drifted apart by rounding.
        const auto& r = solver.regime();
        auto state = solver.state();
        auto at_rest = r.at_rest;
        system.stop(state, at_rest);
        model::unpack_state<typename System::Dims>(state, n, x.begin());
        memory.assign(solver.memory().begin(), solver.memory().begin() + n.memory);
        const auto input = solver.input_before(time, state);
        // What rest leaves open may have gone along with the limit of a contact since its regime began.
        for (std::size_t c = 0; c < a.places().contacts.size(); ++c) {
            const model::ContactPlace& place = a.places().contacts[c];
            if (place.locked == model::nowhere) continue;
            const auto& torque =
                place.kind == model::ContactPlace::gear ? r.output_torque[place.element] : r.contact_torque[c];
            memory[static_cast<std::size_t>(place.locked)] =
                evaluate<typename System::Dims>(torque, state, solver.memory(), input);
        }
    }
    // What the balance fails by [J].
    double residual() const {
        double sum = stored_begin - stored_end;
        for (const TrainEnergy& e : energy) sum += e.kind == model::PowerFlow::source ? e.energy : -e.energy;
        return sum;
    }
};

// Why a run has not ended well, or empty.
inline std::string error_text(const TrainReport& report, const model::Assembly& a) {
    if (!report.message.empty()) return report.message;
    return train_status_text(a, report.status, report.time, report.contact, report.too_many_guards);
}

// The energy ledger by name [J], also of flows that there have not been.
inline std::vector<std::string> ledger_names(const model::Assembly& a) {
    std::vector<std::string> names = model::flow_names(a);
    for (const char* name : {"stored_change", "residual", "turned_over"}) names.emplace_back(name);
    return names;
}
inline Named named_ledger(const TrainReport& report, const model::Assembly& a) {
    Named ledger;
    for (const std::string& name : ledger_names(a)) ledger[name] = 0.0;
    for (const TrainEnergy& e : report.energy) ledger.at(e.name) = e.energy;
    ledger["stored_change"] = report.stored_end - report.stored_begin;
    ledger["residual"] = report.residual();
    ledger["turned_over"] = report.turned_over;
    return ledger;
}

// States, and capacities of the hysteresis of gears [N m].
inline Named named_end(const TrainReport& report, const model::Assembly& a) {
    Named end;
    const std::vector<std::string> states = model::state_names(a);
    for (std::size_t k = 0; k < states.size(); ++k) end[states[k]] = report.x[k];
    for (std::size_t g = 0; g < a.train().gears.size(); ++g)
        if (const int h = a.places().gears[g].hysteresis; h != model::nowhere)
            end[a.train().gears[g].name + "_hysteresis_capacity"] = report.memory[static_cast<std::size_t>(h)];
    return end;
}

}  // namespace lostmotion
