#include "regime_table.hpp"

#include <algorithm>

#include "../kernel/propagator.hpp"

namespace lostmotion::batch {

namespace {

using Matrix = MatrixOf<D>;

// The base interval of the propagator is what may lie between two samples; the series of the motion is eight times as
// long at most.
constexpr int series_doublings = 3, fewest_halvings = 3, most_halvings = 10;

// Bound, entry by entry, on how far G departs from its secant over a length d.
Matrix secant_bound(const Matrix& A, double d) {
    const Matrix size = A.magnitudes();
    Matrix power = Matrix::identity(), sum;
    for (int k = 0; k < 20; ++k) {
        sum.add(1.0, power);
        power = size * power;
        power.scale(d / (k + 1));
    }
    Matrix out = size * sum;
    out.scale(d * d / 8.0);
    return out;
}

Four row_of(const model::PackedForm<D>& f) {
    std::array<double, D::coupled> c;
    std::copy_n(f.c.begin(), D::coupled, c.begin());
    return Four::of(c);
}

// A guard that is zero all through, as of a loss law whose load is zero in the gap, ends nothing.
bool can_fall(const model::PackedGuard<D>& guard) {
    return !guard.behind && std::ranges::any_of(guard.form.c, [](double c) { return c != 0.0; });
}

// R of each guard.
void set_departures(const model::PackedRegime<D>& r, Propagator<D>& flow, double h, int halvings, RegimeTable& out) {
    const int samples = 1 << halvings;
    const double d = h / samples;
    const Matrix &A = flow.rates().rate, over_part = flow.integral(d).coupled, change = A * over_part;
    const Matrix bound = secant_bound(A, d), &end = out.G;
    std::array<Four, D::guards> before{}, most{};
    Matrix G;
    for (int j = 0; j < samples; ++j) {
        Matrix exponential = A * G;
        exponential.add(1.0, Matrix::identity());
        Matrix next = change * G;
        next.add(1.0, G);
        next.add(1.0, over_part);
        for (int g = 0; g < r.n_guards; ++g) {
            const Four C = row_of(r.guards[g].form);
            const Four here = absolute(next.after(C) + (-(j + 1.0) / samples) * end.after(C));
            const Four between = bound.after(absolute(exponential.after(C)));
            most[g] = max_of(most[g], max_of(before[g], here) + between);
            before[g] = here;
        }
        G = next;
    }
    for (int g = 0; g < r.n_guards; ++g)
        for (int k = 0; k < D::coupled; ++k)
            out.guards(g / 4).departure[k][g % 4] = can_fall(r.guards[g]) ? most[g][k] : 0.0;
}

// The speeds that change once each of the moving contacts comes to rest.
void set_stops(const model::Assembly& a, const model::PackedRegime<D>& r, RegimeDetails& out) {
    const auto& contacts = a.places().contacts;
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        if (r.at_rest[c]) continue;
        std::array<std::int8_t, model::max_contacts> modes{};
        for (std::size_t k = 0; k < contacts.size(); ++k) modes[k] = r.at_rest[k] || k == c ? 0 : 1;
        const model::Ties ties = a.places().ties(modes.data(), nullptr, true);
        out.stops_alone[c] = true;
        for (std::size_t k = 0; k < contacts.size(); ++k)
            if (modes[k] != 0 && kept_at_rest(contacts[k], ties)) out.stops_alone[c] = false;
        for (std::size_t s = 0; s < 2 && s < a.train().shafts.size(); ++s) {
            RegimeDetails::Stop& stop = out.stops[c][s];
            const int shaft = static_cast<int>(s);
            if (!ties.at_rest[s] && !ties.follows(shaft)) continue;
            stop.state = static_cast<std::int8_t>(a.places().shafts[s].speed);
            ties.each_share(shaft, [&](int other, double share) {
                stop.other = static_cast<std::int8_t>(a.places().shafts[static_cast<std::size_t>(other)].speed);
                stop.share = share;
            });
        }
    }
}

// Whether the steps of this regime need nothing but its rates and guards.
bool is_plain(const model::PackedRegime<D>& r) {
    bool plain = r.complete && r.solvable && r.drivers.empty() && r.locked.empty() && r.driving_input < 0;
    for (int g = 0; g < r.n_guards; ++g)
        plain = plain && r.guards[g].kind != model::Guard::turning && r.guards[g].kind != model::Guard::set_off &&
                r.guards[g].memory < 0;
    for (std::size_t c = 0; c < D::contacts; ++c) plain = plain && !(r.at_rest[c] && r.key.modes[c] != 0);
    return plain;
}

}  // namespace

RegimeTable::Owned tabulate(const model::Assembly& assembly, const Label& label, double h) {
    const model::Regime rows = assembly.build(label.key());
    const model::PackedRegime<D> r = model::pack<D>(rows, assembly);
    RegimeTable::Owned made = RegimeTable::make(r.n_guards);
    RegimeTable& out = *made;
    out.label = label;
    RegimeDetails& details = *out.details;
    const model::Layout& n = assembly.layout();
    if (!rows.motor_torque.empty()) details.motor_torque = model::pack<D>(rows.motor_torque[0], n);
    details.output_torque = r.output_torque[0];
    const model::Gear& gear = assembly.train().gears[0];
    const model::GearPlace& place = assembly.places().gears[0];
    const model::ShaftPlace& input = assembly.places().shafts[static_cast<std::size_t>(gear.input)];
    details.input_contact = static_cast<std::int8_t>(input.contact);
    details.input_speed = static_cast<std::int8_t>(input.speed);
    details.twist_contact = static_cast<std::int8_t>(place.contact);
    details.twist = static_cast<std::int8_t>(place.twist);
    details.cell = static_cast<std::int8_t>(place.cell);
    details.cell_back = static_cast<std::int8_t>(place.cell_back);
    if (gear.law.has_hysteresis()) details.hysteresis = 0.5 * (1.0 - gear.law.hysteresis_efficiency);
    if (!is_plain(r)) return made;
    const LinearRatesOf<D> rates(r.rate);
    State scale;
    scale.fill(1.0);
    model::balanced_scale(assembly, scale, D::coupled);
    PhaseRotations constant_inputs(h, {});
    Propagator<D> flow;
    flow.prepare(rates, constant_inputs, scale);
    const int halvings = flow.level_of(h);
    if (!flow.resolved() || halvings > most_halvings) return made;
    out.plain = true;
    details.at_rest = r.at_rest;
    for (std::size_t k = 0; k < D::coupled; ++k) out.rate.set(k, r.rate[k]);
    for (int k = 0; k < D::coupled; ++k) {
        double sum = 0.0;
        for (int c = 0; c < D::coupled; ++c) sum += std::fabs(rates.rate(k, c)) * scale[c] / scale[k];
        out.norm = std::fmax(out.norm, sum);
    }
    out.series_step = std::ldexp(h, -std::max(0, halvings - series_doublings));
    const IntegralOf<D> whole = flow.integral(h);
    out.G = whole.coupled;
    out.angle = whole.angle[0];
    out.angle_speed = static_cast<std::int8_t>(rates.angle_speed[0]);
    out.angle_coefficient = rates.angle_coefficient[0];
    for (int g = 0; g < 4 * out.n_blocks; ++g) {
        if (g < r.n_guards && can_fall(r.guards[g]))
            out.guards(g / 4).form.set(g % 4, r.guards[g].form);
        else
            out.guards(g / 4).form.one[g % 4] = 1.0;
        if (g >= r.n_guards) continue;
        const model::PackedGuard<D>& guard = r.guards[g];
        details.mark[static_cast<std::size_t>(g)] = {guard.kind, static_cast<std::int8_t>(guard.contact),
                                                     static_cast<std::int8_t>(guard.branch),
                                                     static_cast<std::int16_t>(guard.neighbour)};
    }
    set_departures(r, flow, h, std::max(halvings, fewest_halvings), out);
    set_stops(assembly, r, details);
    return made;
}

}  // namespace lostmotion::batch
