#include "sparse_regime.hpp"

#include <ranges>

#include "power_flows.hpp"
#include "scales.hpp"

namespace lostmotion::model {

namespace {

// The share of a guard, at rated load and speed, of a term that is rounding.
constexpr double left_by_elimination = 64.0 * std::numeric_limits<double>::epsilon();

// The speeds that are given, and those that follow these alone.
std::vector<GivenState> given_states(const Regime& r, const Places& places) {
    std::vector<GivenState> out;
    if (places.driven.empty()) return out;
    const auto is_driven = [&](int s) { return std::ranges::binary_search(places.driven, s); };
    for (int s = 0; s < static_cast<int>(places.shafts.size()); ++s) {
        const bool follows =
            r.ties.follows(s) && std::ranges::all_of(r.ties.of[static_cast<std::size_t>(s)], is_driven, &Share::shaft);
        if (r.ties.at_rest[s] || !(follows || is_driven(s))) continue;
        GivenState& given = out.emplace_back(GivenState{places.shafts[s].speed, {}});
        const auto add = [&](int k, double share) {
            given.shares.push_back({places.shafts[k].given_speed, places.shafts[k].given_acceleration, share});
        };
        if (follows)
            r.ties.each_share(s, add);
        else
            add(s, 1.0);
    }
    return out;
}

}  // namespace

SparseRegime::SparseRegime(const Regime& r, const Assembly& a, std::span<const double> near_state,
                           std::span<const double> near_input, FormMaker& sparse)
    : key(r.key),
      given(given_states(r, a.places())),
      at_rest(r.at_rest),
      redundant(r.ties.redundant),
      solvable(r.solvable),
      in_data(r.in_data),
      driving_input(r.driving_input),
      driving_way(r.driving_way) {
    const Layout& n = a.layout();
    const std::size_t gears = r.output_torque.size();
    std::size_t torques = gears;
    for (const auto* rows : {&r.output_torque, &r.input_torque, &r.contact_torque, &r.motor_torque, &r.drive_torque})
        torques += rows->size();
    const auto coupled = static_cast<std::size_t>((n.coupled + 3) / 4 * 4);
    const std::size_t forms = coupled + static_cast<std::size_t>(n.angles) + torques + r.massless.size() + 1;
    forms_.reserve(forms);
    sparse.begin(n, forms + r.guards.size() + 2 * r.drivers.size() + 4 * r.locked.size());

    const auto all = [&](const auto& rows, auto&& row) {
        const LinearForm* first = forms_.data() + forms_.size();
        for (auto&& f : rows) forms_.push_back(sparse(row(f)));
        return Forms(first, rows.size());
    };
    const auto itself = [](const Row& f) -> const Row& { return f; };
    all(std::span(r.rate).first(static_cast<std::size_t>(n.coupled)), itself);
    forms_.resize(coupled);
    rate = forms_;
    angle_rate = all(std::span(r.rate).subspan(static_cast<std::size_t>(n.coupled)), itself);
    output_torque = all(r.output_torque, itself);
    if (gears == 0) output_torque = Forms(&forms_.emplace_back(), 1);
    input_torque = all(r.input_torque, itself);
    mesh_loss = all(std::views::iota(std::size_t{0}, gears), [&](std::size_t g) {
        const Gear& gear = a.train().gears[g];
        return Row(gear.sense() * (gear.law.ratio * r.input_torque[g] - r.output_torque[g]));
    });
    contact_torque = all(r.contact_torque, itself);
    motor_torque = all(r.motor_torque, itself);
    drive_torque = all(r.drive_torque, itself);
    massless_speed = all(r.massless, [](const MasslessSpeed& m) -> const Row& { return m.form; });

    guards.reserve(r.guards.size());
    near_event.reserve(r.guards.size());
    for (const model::Guard& g : r.guards) {
        const auto each_variable = [&](auto&& coefficients, auto&& use) {
            for (int k = 0; k < n.coupled; ++k) use(coefficients[k], near_state[static_cast<std::size_t>(k)]);
            for (int i = 0; i < n.inputs; ++i)
                use(coefficients[n.first_input + i], near_input[static_cast<std::size_t>(i)]);
        };
        double near = 0.0;
        each_variable(g.form.c, [&](double factor, double size) { near += std::fabs(factor) * size; });
        near_event.push_back(near);
        if (r.drivers.empty()) {
            guards.push_back(g.with(sparse(g.form)));
            continue;
        }
        // Contacts at their limits leave all torques at rest to one elimination. What it has left of a term that is
        // none must not decide where all other terms are zero.
        Row f = g.form;
        each_variable(f.c, [&](double& factor, double size) {
            if (std::fabs(factor) * size <= left_by_elimination * near) factor = 0.0;
        });
        guards.push_back(g.with(sparse(f)));
    }
    for (const Driver<Row>& d : r.drivers) drivers.push_back({d.contact, sparse(d.torque), sparse(d.rate)});
    for (const LockedTorque<Row>& l : r.locked) locked.push_back(l.with(sparse));
    terms_ = sparse.terms();
    block_ = sparse.block();
    const auto move = [&](LinearForm& f) {
        if (f.begin != nullptr) sparse.move(f, block_);
    };
    for (LinearForm& f : forms_) move(f);
    for (Guard& g : guards) move(g.form);
    for (Driver<LinearForm>& d : drivers) move(d.torque), move(d.rate);
    for (LockedTorque<LinearForm>& l : locked) move(l.low), move(l.high), move(l.needs), move(l.friction);
    const auto& shafts = a.places().shafts;
    for (std::size_t s = 0; s < shafts.size(); ++s) {
        if (r.ties.at_rest[s]) resting[shafts[s].speed] = true;
        if (r.ties.follows(static_cast<int>(s))) following[shafts[s].speed] = true;
    }
}

SparseRegimes::SparseRegimes(const Assembly& assembly) : assembly_(assembly) {
    const Layout& n = assembly.layout();
    near_state_.resize(static_cast<std::size_t>(n.states));
    near_input_.assign(static_cast<std::size_t>(n.inputs), far_from_event);
    rated_scale(assembly, near_state_);
    for (double& x : near_state_) x *= far_from_event;
    for (int a = 0; a < n.angles; ++a) near_state_[static_cast<std::size_t>(n.coupled + a)] = far_from_event;
    for (std::size_t s = 0; s < assembly.train().shafts.size(); ++s)
        if (const int load = assembly.places().shafts[s].load; load != nowhere)
            near_input_[static_cast<std::size_t>(load)] =
                far_from_event * rated_torque(assembly.train(), static_cast<int>(s));
}

const SharedRegime& SparseRegimes::share(const Key& key) {
    const SharedRegime*& known = table_[key];
    if (known != nullptr) return *known;
    const SharedRegime& made =
        known_.emplace_back(SharedRegime::make(composed(key), assembly_, near_state_, near_input_, form_));
    table_.put(known, made);
    bytes_ += made->bytes();
    return made;
}

void SparseRegimes::make_room() {
    if (bytes_ <= most_bytes) return;
    known_.clear();
    table_.clear();
    bytes_ = 0;
}

const std::vector<SparseRegime::PowerTerms>& SparseRegimes::flows(const SparseRegime& r) {
    if (r.flows == nullptr) {
        auto flows = std::make_unique<SparseRegime::AllPowers>();
        const std::vector<NumberedPower> powers = power_flows(assembly_, composed(r.key));
        form_.begin(assembly_.layout(), 2 * powers.size());
        for (const NumberedPower& f : powers)
            flows->all.push_back({f.flow, form_(f.power.torque), form_(f.power.speed)});
        flows->block = form_.block();
        for (SparseRegime::PowerTerms& f : flows->all)
            for (LinearForm* form : {&f.torque, &f.speed}) form_.move(*form, flows->block);
        r.flows = std::move(flows);
    }
    return r.flows->all;
}

const Regime& SparseRegimes::composed(const Key& key) {
    if (composed_.rate.empty() || !(composed_.key == key)) assembly_.build(key, composed_);
    return composed_;
}

}  // namespace lostmotion::model
