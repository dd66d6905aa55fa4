#include "searched_regime.hpp"

#include "scales.hpp"

namespace lostmotion::model {

SearchedRegime::SearchedRegime(const Regime& r, const Layout& n, const std::vector<double>& near_state,
                               const std::vector<double>& near_input)
    : key(r.key), at_rest(r.at_rest), solvable(r.solvable) {
    const auto each_row = [&](auto&& use) {
        for (const auto* rows : {&r.rate, &r.output_torque, &r.contact_torque})
            for (const Row& f : *rows) use(f);
        for (const model::Guard& g : r.guards) use(g.form);
        for (const Driver<Row>& d : r.drivers) use(d.torque), use(d.rate);
        for (const LockedTorque<Row>& l : r.locked) use(l.low), use(l.high), use(l.needs), use(l.friction);
    };
    std::size_t terms = 0;  // the forms refer to the block, which must not grow
    each_row([&](const Row& f) {
        terms += static_cast<std::size_t>(std::count_if(f.c.begin(), f.c.end(), [](double c) { return c != 0.0; }));
    });
    block_.reserve(terms);
    const auto sparse = [&](const Row& f) { return SparseForm(f, n, block_); };
    const auto all = [&](const std::vector<Row>& rows, std::vector<SparseForm>& out) {
        out.reserve(rows.size());
        for (const Row& f : rows) out.push_back(sparse(f));
    };
    all(r.rate, rate);
    all(r.output_torque, output_torque);
    all(r.contact_torque, contact_torque);
    guards.reserve(r.guards.size());
    near_event.reserve(r.guards.size());
    for (const model::Guard& g : r.guards) {
        const SparseForm& f = guards.emplace_back(g.with(sparse(g.form))).form;
        double near = 0.0;
        const SparseForm::Term* t = f.begin;
        for (; t != f.begin + f.states; ++t)
            near += std::fabs(t->factor) * near_state[static_cast<std::size_t>(t->place)];
        for (t = f.begin + f.memory; t != f.begin + f.inputs; ++t)
            near += std::fabs(t->factor) * near_input[static_cast<std::size_t>(t->place)];
        near_event.push_back(near);
    }
    for (const Driver<Row>& d : r.drivers) drivers.push_back({d.contact, sparse(d.torque), sparse(d.rate)});
    for (const LockedTorque<Row>& l : r.locked) locked.push_back(l.with(sparse));
}

SearchedRegimes::SearchedRegimes(const Assembly& assembly) : assembly_(assembly), slots_(first_slots, nullptr) {
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

const SearchedRegime& SearchedRegimes::operator[](const Key& key) {
    std::size_t k = slot(key);
    if (slots_[k] == nullptr) {
        if (2 * (known_.size() + 1) > slots_.size()) {
            slots_.assign(2 * slots_.size(), nullptr);
            for (const auto& r : known_) slots_[slot(r->key)] = r.get();
            k = slot(key);
        }
        known_.push_back(
            std::make_unique<const SearchedRegime>(composed(key), assembly_.layout(), near_state_, near_input_));
        slots_[k] = known_.back().get();
        bytes_ += known_.back()->bytes();
    }
    return *slots_[k];
}

std::size_t SearchedRegimes::slot(const Key& key) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t k = key.hash() & mask;
    while (slots_[k] != nullptr && !(slots_[k]->key == key)) k = (k + 1) & mask;
    return k;
}

void SearchedRegimes::make_room() {
    if (bytes_ <= most_bytes) return;
    known_.clear();
    slots_.assign(first_slots, nullptr);
    bytes_ = 0;
}

const Regime& SearchedRegimes::composed(const Key& key) {
    if (composed_.rate.empty() || !(composed_.key == key)) assembly_.build(key, composed_);
    return composed_;
}

}  // namespace lostmotion::model
