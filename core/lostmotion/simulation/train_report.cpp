#include "train_report.hpp"

namespace lostmotion {

double value_of(const Named& values, const std::string& name) {
    const auto found = values.find(name);
    return found == values.end() ? 0.0 : found->second;
}

double* write_switching(const TrainSwitching& s, int contacts, double* to) {
    *to++ = s.time;
    *to++ = s.input_jump ? input_changed : static_cast<int>(s.kind);
    to = std::copy_n(s.before.modes.begin(), contacts, to);
    return std::copy_n(s.after.modes.begin(), contacts, to);
}

double TrainReport::residual() const {
    double sum = -stored_change;
    for (const TrainEnergy& e : energy) sum += e.kind == model::PowerFlow::source ? e.energy : -e.energy;
    return sum;
}

std::string error_text(const TrainReport& report, const model::Assembly& a) {
    if (!report.message.empty()) return report.message;
    return train_status_text(a, report.status, report.time, report.contact, report.too_many_guards);
}

std::vector<std::string> ledger_names(const model::Assembly& a) {
    std::vector<std::string> names = model::flow_names(a);
    for (const char* name : {"stored_change", "residual", "turned_over"}) names.emplace_back(name);
    return names;
}

Named named_ledger(const TrainReport& report, const model::Assembly& a) {
    Named ledger;
    for (const std::string& name : ledger_names(a)) ledger[name] = 0.0;
    for (const TrainEnergy& e : report.energy) ledger.at(e.name) = e.energy;
    ledger["stored_change"] = report.stored_change;
    ledger["residual"] = report.residual();
    ledger["turned_over"] = report.turned_over;
    return ledger;
}

Named named_end(const TrainReport& report, const model::Assembly& a) {
    Named end;
    const std::vector<std::string> states = model::state_names(a);
    for (std::size_t k = 0; k < states.size(); ++k) end[states[k]] = report.x[k];
    for (std::size_t g = 0; g < a.train().gears.size(); ++g)
        if (const int h = a.places().gears[g].hysteresis; h != model::nowhere)
            end[a.train().gears[g].name + "_hysteresis_capacity"] = report.memory[static_cast<std::size_t>(h)];
    return end;
}

}  // namespace lostmotion
