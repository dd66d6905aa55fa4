#include "train_report.hpp"

#include <algorithm>

namespace lostmotion {

double value_of(const Named& values, const std::string& name) {
    const auto found = values.find(name);
    return found == values.end() ? 0.0 : found->second;
}

double value_of(const NamedInOrder& values, const std::string& name) {
    const auto found = std::ranges::find(values, name, &NamedInOrder::value_type::first);
    return found == values.end() ? 0.0 : found->second;
}

namespace {

// Of switchings, in results.
enum Cause : int {
    torsion_piece = model::Guard::capacity + 1,
    loss_cell,
    loss_cell_back,
    limit,
    turned,
    mesh_step,
    set_off,
    impact,
    law
};

int cause_of(const model::Assembly& a, const TrainSwitching& s) {
    if (s.input_jump) return input_changed;
    switch (s.kind) {
        case model::Guard::edge: break;
        case model::Guard::input_limit: return limit;
        case model::Guard::turning: return turned;
        case model::Guard::set_off: return set_off;
        case model::Guard::impact: return impact;
        default: return s.kind;
    }
    for (const model::GearPlace& gear : a.places().gears) {
        const int pieces[] = {gear.mesh.piece, gear.piece, gear.cell, gear.cell_back};
        const int causes[] = {mesh_step, torsion_piece, loss_cell, loss_cell_back};
        for (int k = 0; k < 4; ++k)
            if (s.branch >= 0 && s.branch == pieces[k]) return causes[k];
    }
    return law;
}

constexpr double no_contact = 2.0;

}  // namespace

std::vector<SwitchingCause> switching_causes() {
    return {{input_changed, input_changed_name},
            {model::Guard::speed, "came to rest"},
            {model::Guard::capacity, "broke away"},
            {torsion_piece, "torsion piece"},
            {loss_cell, "loss cell"},
            {loss_cell_back, "loss cell"},
            {limit, "limit of a command"},
            {turned, "driving torque turned"},
            {mesh_step, "step of the mesh stiffness"},
            {set_off, "given motion began"},
            {impact, "struck"},
            {law, "piece of a law"}};
}

SwitchingTable::SwitchingTable(const model::Assembly& a) : assembly_(a), contacts_(model::shown_contacts(a)) {
    const model::Train& t = a.train();
    const std::size_t last = t.gears.size() - 1;
    torque_ = !t.gears.empty() && model::has_alias(t, model::gear_name(t, last, "output_torque"));
    columns_ = {"instant", "cause"};
    for (const char* when : {"_before", "_after"})
        for (const model::ShownContact& c : contacts_) columns_.push_back(c.name + when);
    for (const char* when : {"_before", "_after"})
        if (torque_) columns_.push_back(model::gear_result(t, last, "output_torque") + when);
}

double* SwitchingTable::write(const TrainSwitching& s, double* to) const {
    *to++ = s.time;
    *to++ = cause_of(assembly_, s);
    for (const TrainSwitching::Modes* modes : {&s.before, &s.after})
        for (const model::ShownContact& c : contacts_)
            *to++ = c.contact == model::nowhere ? no_contact : (*modes)[static_cast<std::size_t>(c.contact)];
    for (const double torque : {s.torque_before, s.torque_after})
        if (torque_) *to++ = torque;
    return to;
}

double TrainReport::residual() const {
    const auto given = [](const TrainEnergy& e) { return e.kind == model::PowerFlow::source ? e.energy : -e.energy; };
    double sum = energy.empty() ? 0.0 : given(energy[0]);
    sum = sum - stored_change.kinetic - stored_change.elastic;
    for (std::size_t k = 1; k < energy.size(); ++k) sum += given(energy[k]);
    return sum;
}

namespace {

NamedInOrder ledger_of(const TrainReport& report, const model::Assembly& a) {
    const model::Train& t = a.train();
    NamedInOrder ledger;
    const auto add = [&](const std::string& name, double energy) {
        if (const std::string shown = model::shown_name(t, name); !shown.empty()) ledger.emplace_back(shown, energy);
    };
    const auto [kinetic, elastic, all] = report.stored_change;
    for (const model::PowerFlow& f : model::all_flows(a)) {
        const auto found = std::ranges::find(report.energy, f.name, &TrainEnergy::name);
        add(f.name, found == report.energy.end() ? 0.0 : found->energy);
    }
    add("stored_change", all);
    for (const auto& [name, change] : {std::pair{"kinetic_change", kinetic}, std::pair{"elastic_change", elastic}})
        if (model::has_alias(t, name)) add(name, change);
    add("residual", report.residual());
    add("turned_over", report.turned_over);
    model::as_in_tables(t, ledger, &NamedInOrder::value_type::first);
    return ledger;
}

}  // namespace

NamedInOrder named_ledger(const TrainReport& report, const model::Assembly& a) {
    NamedInOrder ledger = ledger_of(report, a);
    if (a.train().aliases.empty()) std::ranges::sort(ledger);
    return ledger;
}

std::string error_text(const TrainReport& report, const model::Assembly& a) {
    if (!report.message.empty()) return report.message;
    return train_status_text(a, report.status, report.time, report.contact, report.too_many_guards);
}

void TrainReport::add(const std::string& name, model::PowerFlow::Kind kind, double more) {
    const auto entry = std::ranges::find(energy, name, &TrainEnergy::name);
    if (entry == energy.end())
        energy.push_back({name, kind, more});
    else
        entry->energy += more;
    turned_over += std::fabs(more);
}

std::vector<std::string> ledger_names(const model::Assembly& a) {
    std::vector<std::string> names;
    for (const auto& [name, energy] : ledger_of({}, a)) names.push_back(name);
    return names;
}

NamedInOrder capacities_at(const model::Assembly& a, const double* memory) {
    NamedInOrder out;
    for (std::size_t g = 0; g < a.train().gears.size(); ++g) {
        const int h = a.places().gears[g].hysteresis;
        if (h != model::nowhere || model::has_alias(a.train(), model::gear_name(a.train(), g, "hysteresis_capacity")))
            out.emplace_back(model::gear_result(a.train(), g, "hysteresis_capacity"),
                             h == model::nowhere ? 0.0 : memory[h]);
    }
    return out;
}

NamedInOrder named_end(const TrainReport& report, const model::Assembly& a) {
    NamedInOrder end;
    const std::vector<std::string> states = model::state_names(a);
    for (std::size_t k = 0; k < states.size(); ++k) {
        // An angle that something depends on is integrated once more, and is at an end stop to the last bit.
        const auto known = std::ranges::find(end, states[k], &NamedInOrder::value_type::first);
        const auto strikes_at = [&](const model::ContactPlace& c) { return c.gap.at == known - end.begin(); };
        if (known == end.end())
            end.emplace_back(states[k], report.x[k]);
        else if (!std::ranges::any_of(a.places().contacts, strikes_at))
            known->second = report.x[k];
    }
    for (auto& capacity : capacities_at(a, report.memory.data())) end.push_back(std::move(capacity));
    if (a.train().aliases.empty()) std::ranges::sort(end);
    return end;
}

}  // namespace lostmotion
