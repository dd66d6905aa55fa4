#include "train_report.hpp"

#include <algorithm>
#include <numeric>

namespace lostmotion {

double value_of(const Named& values, const std::string& name) {
    const auto found = values.find(name);
    return found == values.end() ? 0.0 : found->second;
}

double value_of(const NamedInOrder& values, const std::string& name) {
    const auto found = std::ranges::find(values, name, &NamedInOrder::value_type::first);
    return found == values.end() ? 0.0 : found->second;
}

// Of switchings of a drive; a train has the kinds of guards.
enum CauseOfDrive : int {
    torsion_piece = model::Guard::capacity + 1,
    loss_cell,
    loss_cell_back,
    voltage_limit,
    torque_turned
};
constexpr int mesh_step = model::Guard::impact + 1;  // of a drive and of a train

std::vector<SwitchingCause> switching_causes(bool short_form) {
    std::vector<SwitchingCause> all{{input_changed, input_changed_name},
                                    {model::Guard::speed, "came to rest"},
                                    {model::Guard::capacity, "broke away"}};
    if (short_form)
        for (const SwitchingCause& c :
             {SwitchingCause{torsion_piece, "torsion piece"}, SwitchingCause{loss_cell, "loss cell"},
              SwitchingCause{loss_cell_back, "loss cell"}, SwitchingCause{voltage_limit, "voltage limit"},
              SwitchingCause{torque_turned, "motor torque turned"}})
            all.push_back(c);
    else
        for (const SwitchingCause& c : {SwitchingCause{model::Guard::edge, "piece or cell of a law"},
                                        SwitchingCause{model::Guard::input_limit, "limit of a command"},
                                        SwitchingCause{model::Guard::turning, "driving torque turned"},
                                        SwitchingCause{model::Guard::set_off, "given motion began"},
                                        SwitchingCause{model::Guard::impact, "flanks struck"}})
            all.push_back(c);
    all.push_back({mesh_step, "step of the mesh stiffness"});
    return all;
}

namespace {

int cause_of(const model::Assembly& a, const TrainSwitching& s) {
    if (s.input_jump) return input_changed;
    const auto steps = [&s](const model::GearPlace& g) { return s.branch >= 0 && s.branch == g.mesh.piece; };
    if (s.kind == model::Guard::edge && std::ranges::any_of(a.places().gears, steps)) return mesh_step;
    if (!a.train().short_form) return s.kind;
    const model::GearPlace& gear = a.places().gears[0];
    switch (s.kind) {
        case model::Guard::edge:
            return s.branch == gear.piece ? torsion_piece : s.branch == gear.cell ? loss_cell : loss_cell_back;
        case model::Guard::input_limit: return voltage_limit;
        case model::Guard::turning: return torque_turned;
        default: return s.kind;
    }
}

// The contacts in the order of a table, nowhere for those that the short form shows without having them.
std::vector<int> shown_contacts(const model::Assembly& a) {
    const model::Places& p = a.places();
    if (a.train().short_form) return {p.shafts[0].contact, p.gears[0].contact, p.shafts[1].contact};
    std::vector<int> all(p.contacts.size());
    std::iota(all.begin(), all.end(), 0);
    return all;
}
constexpr const char* short_contacts[] = {"input_contact", "twist_contact", "load_contact"};
constexpr double no_contact = 2.0;

}  // namespace

std::vector<std::string> switching_columns(const model::Assembly& a) {
    std::vector<std::string> names{"instant", "cause"};
    const std::vector<int> contacts = shown_contacts(a);
    for (const char* when : {"_before", "_after"})
        for (std::size_t k = 0; k < contacts.size(); ++k)
            names.push_back((a.train().short_form ? short_contacts[k] : model::contact_name(a, contacts[k])) +
                            std::string(when));
    if (a.train().short_form)
        for (const char* when : {"_before", "_after"}) names.push_back(std::string("output_torque") + when);
    return names;
}

double* write_switching(const model::Assembly& a, const TrainSwitching& s, double* to) {
    *to++ = s.time;
    *to++ = cause_of(a, s);
    for (const TrainSwitching::Modes* modes : {&s.before, &s.after})
        for (const int c : shown_contacts(a))
            *to++ = c == model::nowhere ? no_contact : (*modes)[static_cast<std::size_t>(c)];
    if (a.train().short_form)
        for (const double torque : {s.torque_before, s.torque_after}) *to++ = torque;
    return to;
}

namespace {

// The ledger of the short form, in the words of the paper, and of what it is made.
struct ShortFlow {
    const char *name, *flow;
};
constexpr ShortFlow short_flows[] = {
    {"source", "motor: motor"},
    {"input_damper", "motor: viscous friction"},
    {"motor_friction", "motor: dry friction"},
    {"gear_losses", "gearbox: mesh"},
    {"hysteresis", "gearbox: hysteresis and damping"},
    {"load_damper", "load: viscous friction"},
    {"load_friction", "load: dry friction"},
    {"load_work", "load: load"},
};

}  // namespace

namespace {

NamedInOrder ledger_of(const TrainReport& report, const model::Assembly& a) {
    NamedInOrder ledger;
    const auto flow = [&](const std::string& name) {
        const auto found = std::ranges::find(report.energy, name, &TrainEnergy::name);
        return found == report.energy.end() ? 0.0 : found->energy;
    };
    if (a.train().short_form) {
        const auto [kinetic, elastic, all] = report.stored_change;
        for (const ShortFlow& f : short_flows) ledger.emplace_back(f.name, flow(f.flow));
        double residual = ledger[0].second - kinetic - elastic;
        for (std::size_t k = 1; k < ledger.size(); ++k) residual -= ledger[k].second;
        if (a.train().gears[0].mesh_stiffness.present()) {
            ledger.emplace_back("parametric_work", flow("gearbox: parametric work"));
            residual += ledger.back().second;
        }
        ledger.emplace_back("kinetic_change", kinetic);
        ledger.emplace_back("elastic_change", elastic);
        ledger.emplace_back("residual", residual);
    } else {
        for (const model::PowerFlow& f : model::all_flows(a)) ledger.emplace_back(f.name, flow(f.name));
        ledger.emplace_back("stored_change", report.stored_change.all);
        ledger.emplace_back("residual", report.residual());
    }
    ledger.emplace_back("turned_over", report.turned_over);
    return ledger;
}

}  // namespace

NamedInOrder named_ledger(const TrainReport& report, const model::Assembly& a) {
    NamedInOrder ledger = ledger_of(report, a);
    if (!a.train().short_form) std::ranges::sort(ledger);
    return ledger;
}

double TrainReport::residual() const {
    double sum = -stored_change.all;
    for (const TrainEnergy& e : energy) sum += e.kind == model::PowerFlow::source ? e.energy : -e.energy;
    return sum;
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
        if (h != model::nowhere || a.train().short_form)
            out.emplace_back(model::gear_result(a.train(), g, "hysteresis_capacity"),
                             h == model::nowhere ? 0.0 : memory[h]);
    }
    return out;
}

NamedInOrder named_end(const TrainReport& report, const model::Assembly& a) {
    NamedInOrder end;
    const std::vector<std::string> states = model::state_names(a);
    for (std::size_t k = 0; k < states.size(); ++k) {
        // An angle that something depends on is integrated once more.
        const auto known = std::ranges::find(end, states[k], &NamedInOrder::value_type::first);
        if (known == end.end())
            end.emplace_back(states[k], report.x[k]);
        else
            known->second = report.x[k];
    }
    for (auto& capacity : capacities_at(a, report.memory.data())) end.push_back(std::move(capacity));
    if (!a.train().short_form) std::ranges::sort(end);
    return end;
}

}  // namespace lostmotion
