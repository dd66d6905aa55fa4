// What a run of a train is given and what it gives.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "../base/status.hpp"
#include "../model/names.hpp"
#include "../model/power_flows.hpp"
#include "result_names.hpp"
#include "sample_times.hpp"
#include "train_control.hpp"
#include "train_status.hpp"

namespace lostmotion {

// By name; what is left out is 0.
using Named = std::map<std::string, double>;
using NamedInOrder = std::vector<std::pair<std::string, double>>;

// 0 where there is none of that name.
double value_of(const Named& values, const std::string& name);
double value_of(const NamedInOrder& values, const std::string& name);

struct TrainStart {
    Named states;
    Named hysteresis_capacities;  // of gears [N m]
};

struct TrainOptions : RunRequest {
    std::vector<double> instants;              // to record [s], ascending; exact solver, without control_out
    std::optional<std::vector<int>> channels;  // to record, by their place among TrainRun::channels(); left out, all
    std::function<bool()> enough;              // whether the samples up to the pause, which is written, suffice
    double tolerance = 0.0;                    // relative, of the adaptive solver; 0: the exact one

    SampleTimes times() const { return instants.empty() ? RunRequest::times() : SampleTimes(instants); }
};

struct TrainSwitching {
    double time = 0.0;  // [s]
    bool input_jump = false;
    model::Guard::Kind kind = model::Guard::speed;
    int contact = -1, branch = -1;  // that it was about, if any
    using Modes = decltype(model::Key::modes);
    Modes before{}, after{};                         // of the contacts
    double torque_before = 0.0, torque_after = 0.0;  // T_2 [N m] of the last gear, left and right limit
};

// What ended a regime: number and name.
struct SwitchingCause {
    int number;
    const char* name;
};
std::vector<SwitchingCause> switching_causes();
// A table of switchings: instant, cause, the modes of all contacts that are shown before and after, 2 of those that the
// train does not have; the torque of the last gear where it has an alias.
class SwitchingTable {
 public:
    explicit SwitchingTable(const model::Assembly& a);
    const std::vector<std::string>& columns() const { return columns_; }
    double* write(const TrainSwitching& s, double* to) const;

 private:
    const model::Assembly& assembly_;
    std::vector<model::ShownContact> contacts_;
    std::vector<std::string> columns_;
    bool torque_;
};

struct TrainEnergy {
    std::string name;
    model::PowerFlow::Kind kind;
    double energy = 0.0;  // [J] since the start
};

struct TrainReport {
    Status status = Status::done;
    std::string message;  // what is wrong with the start; then nothing has run
    double time = 0.0;    // [s] reached
    int contact = -1;     // at the last switching, or -2 - branch of a law that belongs to none
    std::vector<double> x, memory;
    std::vector<TrainSwitching> switchings;
    std::size_t switching_count = 0;
    std::vector<TrainEnergy> energy;
    model::StoredChange stored_change;
    double turned_over = 0.0;                                       // [J]
    double left_data_at = std::numeric_limits<double>::infinity();  // [s]
    long steps = 0;
    SearchCounts searches;
    bool too_many_guards = false;  // a regime has more conditions than the kernel has room for

    // Energy [J] that no power is the rate of.
    void add(const std::string& name, model::PowerFlow::Kind kind, double more);

    // What the balance fails by [J].
    double residual() const;
};

// Why a run has not ended well, or empty.
std::string error_text(const TrainReport& report, const model::Assembly& a);

// The energy ledger by name [J], also of flows that there have not been.
std::vector<std::string> ledger_names(const model::Assembly& a);
NamedInOrder named_ledger(const TrainReport& report, const model::Assembly& a);

// Of the hysteresis of gears [N m], from the memory by the layout; where it has an alias, also where there is none.
NamedInOrder capacities_at(const model::Assembly& a, const double* memory);
// States, and these capacities.
NamedInOrder named_end(const TrainReport& report, const model::Assembly& a);

}  // namespace lostmotion
