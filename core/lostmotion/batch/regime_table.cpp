#include "regime_table.hpp"

#ifdef __linux__
#include <sys/mman.h>
#endif

#include <algorithm>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

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

// A guard that is zero all through, as of a loss law whose load is zero in the gap, ends nothing.
bool can_fall(const model::SparseRegime::Guard& guard) {
    return !guard.behind && (guard.form.one != 0.0 || guard.form.inputs != 0);
}

float rounded_up(double v) {
    const auto f = static_cast<float>(v);
    return static_cast<double>(f) < v ? std::nextafterf(f, std::numeric_limits<float>::infinity()) : f;
}

// R of each guard.
void set_departures(const model::SparseRegime& r, Propagator<D>& flow, double h, int halvings, Tabulated& out) {
    const int samples = 1 << halvings;
    const double d = h / samples;
    const Matrix &A = flow.rates().rate, over_part = flow.integral(d).coupled, change = A * over_part;
    const Matrix bound = secant_bound(A, d), &end = out.shared.G;
    std::array<Four, D::guards> before{}, most{};
    Matrix G;
    for (int j = 0; j < samples; ++j) {
        Matrix exponential = A * G;
        exponential.add(1.0, Matrix::identity());
        Matrix next = change * G;
        next.add(1.0, G);
        next.add(1.0, over_part);
        for (std::size_t g = 0; g < r.guards.size(); ++g) {
            const Four C = coupled<D>(r.guards[g].form);
            const Four here = absolute(next.after(C) + (-(j + 1.0) / samples) * end.after(C));
            const Four between = bound.after(absolute(exponential.after(C)));
            most[g] = max_of(most[g], max_of(before[g], here) + between);
            before[g] = here;
        }
        G = next;
    }
    for (std::size_t g = 0; g < r.guards.size(); ++g) {
        if (!can_fall(r.guards[g])) continue;
        SharedTable::Departure R;
        Column* place = out.block(static_cast<int>(g / 4)) + D::coupled;
        std::memcpy(&R, place, sizeof R);
        for (int k = 0; k < D::coupled; ++k) R[k][g % 4] = rounded_up(most[g][k]);
        std::memcpy(place, &R, sizeof R);
    }
}

// The speeds that change once each of the moving contacts comes to rest.
void set_stops(const model::Assembly& a, const model::SparseRegime& r, RegimeDetails& out) {
    const auto& contacts = a.places().contacts;
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        if (r.at_rest[c]) continue;
        std::vector<std::int8_t> modes(contacts.size());
        for (std::size_t k = 0; k < contacts.size(); ++k) modes[k] = r.at_rest[k] || k == c ? 0 : 1;
        const model::Ties ties = a.places().ties(modes, nullptr, true);
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
bool is_plain(const model::SparseRegime& r) {
    bool plain =
        r.guards.size() <= D::guards && r.solvable && r.drivers.empty() && r.locked.empty() && r.driving_input < 0;
    for (const auto& g : r.guards)
        plain = plain && g.kind != model::Guard::turning && g.kind != model::Guard::set_off && g.memory < 0;
    for (std::size_t c = 0; c < D::contacts; ++c) plain = plain && !(r.at_rest[c] && r.key.modes[c] != 0);
    return plain;
}

}  // namespace

Coefficients coefficients_of(const LinearForm& f) {
    Coefficients out{};
    each_state_of<D>(f, [&](int k, double c) { out[static_cast<std::size_t>(k)] = c; });
    out[D::one] = f.one;
    for (const auto& [k, c] : f.of_memory()) out[static_cast<std::size_t>(D::first_memory + k)] = c;
    for (const auto& [i, c] : f.of_inputs()) out[static_cast<std::size_t>(D::first_input + i)] = c;
    return out;
}

double value_of(const Coefficients& c, double constant, const State& x, const Memory& m, const Inputs& u) {
    for (std::size_t k = 0; k < D::memory; ++k) constant += c[D::first_memory + k] * m[k];
    double input = 0.0, own = (Four::load(c.data()) * coupled(x)).sum();
    for (std::size_t i = 0; i < D::inputs; ++i) input += c[D::first_input + i] * u[i];
    for (std::size_t k = D::coupled; k < D::states; ++k) own += c[k] * x[k];
    return (constant + input) + own;
}

Tabulated tabulate(const model::Assembly& assembly, const Label& label, double h) {
    const auto regime = model::SparseRegimes(assembly).make(label.key());
    const model::SparseRegime& r = *regime;
    Tabulated out;
    out.table.label = label;
    RegimeDetails& details = out.details;
    const auto torque = [](const LinearForm& form, Coefficients& to, double& constant) {
        to = coefficients_of(form);
        constant = std::exchange(to[D::one], 0.0);
    };
    if (!r.motor_torque.empty()) torque(r.motor_torque[0], details.motor_torque, out.table.motor_torque);
    torque(r.output_torque[0], details.output_torque, out.table.output_torque);
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
    if (!is_plain(r)) return out;
    const LinearRatesOf<D> rates({}, r.rate, r.angle_rate);
    State scale;
    scale.fill(1.0);
    model::balanced_scale(assembly, scale, D::coupled);
    PhaseRotations constant_inputs(h, {});
    Propagator<D> flow;
    flow.prepare(rates, constant_inputs, scale);
    const int halvings = flow.level_of(h);
    if (!flow.resolved() || halvings > most_halvings) return out;
    for (std::size_t c = 0; c < D::contacts; ++c) details.at_rest[c] = r.at_rest[c];
    SharedTable& shared = out.shared;
    for (int k = 0; k < D::coupled; ++k) {
        double sum = 0.0;
        for (int c = 0; c < D::coupled; ++c) sum += std::fabs(rates.rate(k, c)) * scale[c] / scale[k];
        shared.norm = std::fmax(shared.norm, sum);
    }
    shared.series_step = std::ldexp(h, -std::max(0, halvings - series_doublings));
    const IntegralOf<D> whole = flow.integral(h);
    shared.G = whole.coupled;
    shared.angle = whole.angle[0];
    shared.angle_speed = static_cast<std::int8_t>(rates.angle_speed[0]);
    shared.angle_coefficient = rates.angle_coefficient[0];
    shared.state = rates.rate.column;
    shared.input = rates.input_column;
    shared.n_blocks = static_cast<std::int8_t>((r.guards.size() + 3) / 4);
    const auto& guards = r.guards;
    const auto by_memory = [](const LinearForm& f) { return !f.of_memory().empty(); };
    out.table.by_memory = std::ranges::any_of(r.rate, by_memory);
    for (const auto& g : guards) {
        out.table.by_memory = out.table.by_memory || by_memory(g.form);
        shared.guards_by_input = shared.guards_by_input || !g.form.of_inputs().empty();
    }
    const auto blocks = static_cast<std::size_t>(shared.n_blocks);
    out.blocks.resize(blocks * shared.block_columns());
    out.own.resize((1 + blocks) * out.table.own_columns());
    const auto set_own = [&](std::size_t forms, std::size_t row, const LinearForm& form) {
        const Coefficients c = coefficients_of(form);
        Column* own = out.own.data() + forms * out.table.own_columns();
        own[0][row] = c[D::one];
        for (std::size_t k = 0; out.table.by_memory && k < D::memory; ++k) own[1 + k][row] = c[D::first_memory + k];
    };
    for (std::size_t k = 0; k < D::coupled; ++k) set_own(0, k, r.rate[k]);
    details.mark.resize(guards.size());
    for (std::size_t g = 0; g < 4 * blocks; ++g) {
        if (g < guards.size())
            details.mark[g] = {guards[g].kind, static_cast<std::int8_t>(guards[g].contact),
                               static_cast<std::int8_t>(guards[g].branch),
                               static_cast<std::int16_t>(guards[g].neighbour)};
        if (g >= guards.size() || !can_fall(guards[g])) {
            out.own[(1 + g / 4) * out.table.own_columns()][g % 4] = 1.0;
            continue;
        }
        set_own(1 + g / 4, g % 4, guards[g].form);
        const Coefficients form = coefficients_of(guards[g].form);
        const auto varies = [](std::size_t term) { return term < D::coupled || term >= D::first_input; };
        double sign = 0.0;
        for (std::size_t term = 0; term < D::terms && sign == 0.0; ++term)
            if (varies(term) && form[term] != 0.0) sign = form[term] < 0.0 ? -1.0 : 1.0;
        if (sign < 0.0) out.table.signs[g / 4] |= static_cast<std::uint8_t>(1u << g % 4);
        Column* to = out.block(static_cast<int>(g / 4));
        for (std::size_t k = 0; k < D::coupled; ++k) to[k][g % 4] = sign * form[k] + 0.0;
        to += D::coupled + SharedTable::departure_columns;
        for (std::size_t k = 0; shared.guards_by_input && k < D::inputs; ++k)
            to[k][g % 4] = sign * form[D::first_input + k] + 0.0;
    }
    set_departures(r, flow, h, std::max(halvings, fewest_halvings), out);
    set_stops(assembly, r, details);
    // No zero has a sign, so that what is equal has the same bits.
    const auto plain_zeros = [](auto& columns) {
        for (Column& c : columns)
            for (double& v : c) v += 0.0;
    };
    plain_zeros(shared.state);
    plain_zeros(shared.input);
    plain_zeros(shared.G.column);
    return out;
}

void* TableStore::take(std::size_t bytes) {
    bytes = (bytes + line - 1) / line * line;
    if (used_ + bytes > length_) {
        length_ = std::max(std::min(2 * length_, longest_chunk), bytes);
        chunks_.emplace_back(static_cast<std::byte*>(::operator new(length_, std::align_val_t{longest_chunk})));
#ifdef __linux__
        // Large pages, where the system has some: tables of one drive lie far apart.
        if (length_ == longest_chunk) ::madvise(chunks_.back().get(), length_, MADV_HUGEPAGE);
#endif
        used_ = 0;
    }
    memory_ += bytes;
    return chunks_.back().get() + std::exchange(used_, used_ + bytes);
}

// Only the last ones are looked through: those of drives that differ in nothing that is kept here.
const RegimeDetails* TableStore::same(const RegimeDetails& details) {
    for (std::size_t k = details_.size(); k > 0 && k + recent > details_.size(); --k)
        if (*details_[k - 1] == details) return details_[k - 1].get();
    memory_ += details.size();
    return details_.emplace_back(std::make_unique<const RegimeDetails>(details)).get();
}

const SharedTable* TableStore::same(const Tabulated& made, const RegimeTable* others) {
    const std::size_t more = made.blocks.size() * sizeof(Column);
    for (; others != nullptr; others = others->next)
        if (const SharedTable* s = others->shared; s != nullptr && s->size() == made.shared.size() &&
                                                   std::memcmp(s, &made.shared, sizeof *s) == 0 &&
                                                   std::memcmp(s + 1, made.blocks.data(), more) == 0)
            return s;
    auto* s = static_cast<SharedTable*>(take(sizeof(SharedTable) + more));
    std::memcpy(static_cast<void*>(s), &made.shared, sizeof *s);
    std::memcpy(static_cast<void*>(s + 1), made.blocks.data(), more);
    return s;
}

RegimeTable* TableStore::add(const Tabulated& made, RegimeTable* others) {
    RegimeTable table = made.table;
    table.details = same(made.details);
    if (!made.own.empty()) table.shared = same(made, others);
    table.next = others;
    const std::size_t more = made.own.size() * sizeof(Column);
    auto* t = static_cast<RegimeTable*>(take(sizeof table + more));
    std::memcpy(static_cast<void*>(t), &table, sizeof table);
    if (more > 0) std::memcpy(static_cast<void*>(t + 1), made.own.data(), more);
    return t;
}

}  // namespace lostmotion::batch
