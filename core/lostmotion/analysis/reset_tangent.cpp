#include "reset_tangent.hpp"

namespace lostmotion {

double FormTangent::value(const model::Row& f, const double* w) const {
    double sum = 0.0;
    inputs_.each_term([&](int at, int term) { sum += f.c[static_cast<std::size_t>(term)] * w[at]; });
    return sum;
}

void FormTangent::add_own(const Varied& forms, int row, const double* w, double factor, double* to) const {
    inputs_.each_term([&](int at, int term) {
        if (w[at] != 0.0) add_scaled(to, factor * w[at], forms.at(row, term), inputs_.parameters());
    });
}

void FormTangent::add_inputs(const model::Row& f, const double* derivative, double factor, double* to) const {
    inputs_.each_term([&](int at, int term) {
        if (term >= n_.first_input) add_term(f, at, term, derivative, factor, to);
    });
}

void FormTangent::add_term(const model::Row& f, int at, int term, const double* derivative, double factor,
                           double* to) const {
    const int P = inputs_.parameters();
    if (const double c = f.c[static_cast<std::size_t>(term)]; c != 0.0)
        add_scaled(to, factor * c, derivative + at * P, P);
}

void ResetTangent::tied_speeds(std::span<const std::int8_t> modes, const double* x, double* to) const {
    const model::Assembly& a = trains_.base();
    const model::Ties ties = tie(a, modes);
    for (const VariedTrain::Beside& b : trains_.beside()) {
        if (!b.other_ratios) continue;
        const model::Ties other = tie(b.assembly(), modes);
        for (std::size_t s = 0; s < a.train().shafts.size(); ++s) {
            if (!ties.follows(static_cast<int>(s)) ||
                !std::ranges::equal(ties.of[s], other.of[s], {}, &model::Share::shaft, &model::Share::shaft))
                continue;
            double& sum = to[a.places().shafts[s].speed * parameters_ + b.parameter];
            ties.each_share(static_cast<int>(s), [&](int k, double share) {
                sum += b.weight * (other.of[s].of(k) - share) * x[a.places().shafts[static_cast<std::size_t>(k)].speed];
            });
        }
    }
}

void ResetTangent::capacity(std::size_t gear, double twist, const model::Key& key, double* to) const {
    const model::Assembly& a = trains_.base();
    const int row = a.layout().first_memory + a.places().gears[gear].hysteresis;
    const auto of = [&](const model::Assembly& one) {
        return one.stiffness_factor(static_cast<int>(gear), key) *
               one.train().gears[gear].law.hysteresis_capacity(twist);
    };
    const double own = of(a);
    for (const VariedTrain::Beside& b : trains_.beside())
        to[row * parameters_ + b.parameter] += b.weight * (of(b.assembly()) - own);
}

void ResetTangent::turn(const RegimeTangent& before, std::size_t guard, double* to) const {
    const model::Guard& g = before.regime.guards[guard];
    if (g.memory == model::nowhere) return;
    const int row = trains_.base().layout().first_memory + g.memory;
    add_scaled(to + row * parameters_, 1.0, before.shift.at(static_cast<int>(guard), 0), parameters_);
}

void ResetTangent::given(const VariedForm& torque, const double* w, const double* derivative, int memory,
                         double* to) const {
    std::vector<double> sum(static_cast<std::size_t>(parameters_));
    add_now(torque, w, derivative, 1.0, to, sum.data());
    std::copy(sum.begin(), sum.end(), to + (trains_.base().layout().first_memory + memory) * parameters_);
}

void ResetTangent::at_bound(const RegimeTangent& after, std::size_t k, model::Bound bound, const double* w,
                            const double* derivative, const double* torques, const double* torque_derivatives,
                            double* to) const {
    const model::Layout& n = trains_.base().layout();
    const model::LockedTorque<model::Row>& l = after.regime.locked[k];
    std::vector<double> sum(static_cast<std::size_t>(parameters_));
    const auto forms = locked_forms(l);
    const bool with_torques = l.each_form(bound, [&](const model::Row& form, double factor) {
        const auto number = static_cast<std::size_t>(std::find(forms.begin(), forms.end(), &form) - forms.begin());
        add_now({form, after.locked, static_cast<int>(k * n_locked_forms + number)}, w, derivative, factor, to,
                sum.data());
    });
    if (with_torques)
        for (int c = 0; c < n.contacts; ++c) {
            add_scaled(sum.data(), torques[c], after.needs_torque.at(static_cast<int>(k), c), parameters_);
            add_scaled(sum.data(), l.needs_torque[static_cast<std::size_t>(c)], torque_derivatives + c * parameters_,
                       parameters_);
        }
    std::copy(sum.begin(), sum.end(), to + (n.first_memory + l.memory) * parameters_);
}

void ResetTangent::add_now(const VariedForm& f, const double* w, const double* derivative, double factor,
                           const double* to, double* sum) const {
    form_.add_own(f.varied, f.row, w, factor, sum);
    form_.add_inputs(f.form, derivative, factor, sum);
    for (int j = 0; j < trains_.base().layout().first_input; ++j)
        if (const double c = f.form.c[static_cast<std::size_t>(j)]; c != 0.0)
            add_scaled(sum, factor * c, to + j * parameters_, parameters_);
}

}  // namespace lostmotion
