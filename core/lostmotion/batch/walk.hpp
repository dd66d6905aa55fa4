// A step of one drive from event to event.
#pragma once

#include <algorithm>

#include "drive_batch.hpp"

namespace lostmotion::batch {

inline Four least_of(Four a, const Four& b) {
    for (int p = 0; p < Four::parts; ++p) a.part[p] = min_of(a.part[p], b.part[p]);
    return a;
}
// Where a > b, as bits.
inline unsigned above(const Four& a, const Four& b) {
    unsigned bits = 0;
    for (int p = 0; p < Four::parts; ++p) bits |= lostmotion::above(a.part[p], b.part[p]) << (p * Four::width);
    return bits;
}

// Regimes by their labels, for one drive.
struct Regimes {
    virtual RegimeTable* at(const Label& label) = 0;
    // The cells of the loss law at a torque T_2 [N m] of the mesh and a speed [rad/s] of the input shaft.
    virtual void locate_losses(Label& label, const RegimeDetails& of, double T_2, double speed) const = 0;

 protected:
    ~Regimes() = default;
};

class Walk {
 public:
    Walk(Regimes& regimes, const DriveState& from, const Inputs& u)
        : regimes_(regimes), r_(from.regime), angle_(from.x[D::coupled]), memory_(from.memory), u_(u) {
        x_ = Four::load(from.x.data());
    }

    // False: something is not certain; nothing of this walk may be used.
    bool over(double h);
    void store(DriveState& to) const {
        x_.store(to.x.data());
        to.x[D::coupled] = angle_;
        to.memory = memory_;
        to.regime = r_;
    }
    int switchings() const { return switchings_; }

 private:
    static constexpr int most_degree = 23;
    // |A| s up to which a series of each degree d has all terms above rounding: (|A| s)^d = (d + 1)!/2^56.
    static constexpr std::array<double, most_degree> reach = [] {
        std::array<double, most_degree> out{};
        double factorial = 0x1p-56;
        for (int d = 1; d < most_degree; ++d) {
            factorial *= d + 1;
            double low = 0.0, high = 4.0;
            for (int n = 0; n < 60; ++n) {
                const double middle = 0.5 * (low + high);
                double power = 1.0;
                for (int k = 0; k < d; ++k) power *= middle;
                (power < factorial ? low : high) = middle;
            }
            out[static_cast<std::size_t>(d)] = low;
        }
        return out;
    }();
    static constexpr int least_degree = 4;
    static constexpr std::array<double, most_degree + 2> inverse = [] {
        std::array<double, most_degree + 2> out{};
        for (std::size_t k = 1; k < out.size(); ++k) out[k] = 1.0 / static_cast<double>(k);
        return out;
    }();
    static constexpr int most_switchings = 40, most_halvings = 60, longest_walk = 16;
    static constexpr double doubt = 1e-9;     // of a value over the sum of the magnitudes of its terms
    static constexpr double on_zero = 1e-12;  // the same, where a guard begins on zero
    static constexpr double together = 1e-9;  // of two zeros, in the time of the series

    enum class Verdict { yes, no, unsure };
    enum class Way { done, fired, unsure };
    // Terms of a series in the share of its time; those beyond the degree are not set.
    template <class Term>
    struct Series {
        std::array<Term, most_degree + 1> term;
        std::size_t degree;
        Term& operator[](std::size_t k) { return term[k]; }
        const Term& operator[](std::size_t k) const { return term[k]; }
    };
    using Course = Series<Four>;
    struct Crossing {
        int guard = -1;
        double at = 2.0;
        bool doubtful = false;  // another one is near
    };

    Way advance(double& left, int& fired);
    bool see(const RegimeTable& r, const Course& y, double s, bool fresh, Crossing& first, bool& halve) const;
    Verdict judge(const Series<double>& c, double size, double rate_size, bool fresh, double& at, bool& halve) const;
    void move(const Course& y, double s, double at);

    bool resolve(int fired, bool jump);
    Verdict accept(Label next, unsigned moving, int by_value);
    Verdict verify(const RegimeTable& q, unsigned moving, int by_value, bool lasting, int& violated) const;
    Verdict departs(const RegimeTable& q, const Forms& form, int lane) const;
    double output_torque() const;
    void stop(const RegimeDetails& old, int contact);

    Regimes& regimes_;
    RegimeTable* r_;
    Four x_;
    double angle_;
    Memory memory_;
    Inputs u_;
    int switchings_ = 0;
};

inline bool Walk::over(double h) {
    int violated = -1;
    double left = h;
    const Verdict begin = verify(*r_, ~0u, -1, true, violated);
    if (begin == Verdict::unsure || (begin == Verdict::no && !resolve(violated, true))) return false;
    while (left > 0.0) {
        int fired = -1;
        const Way way = advance(left, fired);
        if (way == Way::unsure) return false;
        if (way == Way::done) return true;
        if (switchings_ > most_switchings || !resolve(fired, false)) return false;
    }
    return true;
}

// Within the regime, to the next guard that falls or to the end.
inline Walk::Way Walk::advance(double& left, int& fired) {
    const RegimeTable& r = *r_;
    const Forms rates = r.rates();
    int halvings = 0;
    for (bool fresh = true; left > 0.0; fresh = false) {
        double s = std::min(r.shared->series_step, left);
        const Four rate = rates.of_state(x_) + rates.constant(memory_, u_);
        Course y;
        y.degree = least_degree;
        while (y.degree < most_degree && r.shared->norm * s > reach[y.degree]) ++y.degree;
        y[0] = x_;
        y[1] = s * rate;
        for (std::size_t k = 2; k <= y.degree; ++k) y[k] = (s * inverse[k]) * rates.of_state(y[k - 1]);
        Crossing first;
        while (true) {
            bool halve = false;
            first = {};
            if (!see(r, y, s, fresh, first, halve)) return Way::unsure;
            if (!halve) break;
            if (++halvings > most_halvings) return Way::unsure;
            s *= 0.5;
            double share = 1.0;
            for (std::size_t k = 0; k <= y.degree; ++k) {
                y[k] = share * y[k];
                share *= 0.5;
            }
        }
        if (first.doubtful) return Way::unsure;
        if (first.guard >= 0) {
            move(y, s, first.at);
            left -= first.at * s;
            fired = first.guard;
            return Way::fired;
        }
        move(y, s, 1.0);
        left = s == left ? 0.0 : left - s;
    }
    return Way::done;
}

// To the share `at` of the time of the series.
inline void Walk::move(const Course& y, double s, double at) {
    const RegimeTable& r = *r_;
    Four x = y[y.degree];
    const auto w = static_cast<int>(r.shared->angle_speed);
    double angle = x[w] * inverse[y.degree + 1];
    for (std::size_t k = y.degree; k-- > 0;) {
        const Four& term = y[k];
        x = at * x + term;
        angle = at * angle + term[w] * inverse[k + 1];
    }
    x_ = x;
    angle_ += r.shared->angle_coefficient * (s * (at * angle));
}

// What the guards do over the series. False: not certain.
inline bool Walk::see(const RegimeTable& r, const Course& y, double s, bool fresh, Crossing& first, bool& halve) const {
    for (int b = 0; b < r.shared->n_blocks; ++b) {
        const Forms form = r.guards(b);
        Course g;
        g.degree = y.degree;
        g[0] = form.of_state(y[0]) + form.constant(memory_, u_);
        for (std::size_t k = 1; k <= g.degree; ++k) g[k] = form.of_state(y[k]);
        Four tail = absolute(g[4]);
        for (std::size_t k = 5; k <= g.degree; ++k) tail = tail + absolute(g[k]);
        // Bernstein coefficients of the cubic.
        const Four b1 = g[0] + (1.0 / 3.0) * g[1], b2 = b1 + (1.0 / 3.0) * (g[1] + g[2]),
                   b3 = (g[0] + g[1]) + (g[2] + g[3]);
        unsigned doubtful = ~above(least_of(least_of(g[0], b1), least_of(b2, b3)), tail) & 15u;
        for (; doubtful != 0; doubtful &= doubtful - 1) {
            const int lane = std::countr_zero(doubtful), guard = 4 * b + lane;
            Series<double> c;
            c.degree = g.degree;
            for (std::size_t k = 0; k <= c.degree; ++k) c[k] = g[k][lane];
            const Four size_of_x = absolute(y[0]);
            const double size = form.magnitude(size_of_x, memory_, u_)[lane];
            double rate_size = 0.0;
            if (c[0] <= on_zero * size)
                rate_size = s * form.magnitude_of_state(r.rates().magnitude(size_of_x, memory_, u_))[lane];
            double at = 0.0;
            const Verdict v = judge(c, size, rate_size, fresh, at, halve);
            if (v == Verdict::unsure) return false;
            if (halve) return true;
            if (v == Verdict::yes) continue;
            if (std::fabs(at - first.at) < together) first.doubtful = true;
            if (at < first.at) {
                if (first.at - at >= together) first.doubtful = false;
                first.guard = guard;
                first.at = at;
            }
        }
    }
    return true;
}

// Does a guard with these coefficients over 0..1 stay positive? No: it falls through zero once, there.
inline Walk::Verdict Walk::judge(const Series<double>& c, double size, double rate_size, bool fresh, double& at,
                                 bool& halve) const {
    double tail = 0.0, slope_tail = 0.0, end = 0.0;
    for (std::size_t k = c.degree; k >= 4; --k) {
        tail += std::fabs(c[k]);
        slope_tail += static_cast<double>(k) * std::fabs(c[k]);
        end += c[k];
    }
    end += c[3] + c[2] + c[1] + c[0];
    const double zero = on_zero * size, no_slope = 10.0 * on_zero * rate_size;
    if (c[0] < -zero) return Verdict::unsure;
    if (c[0] <= zero) {  // it begins on zero: does it depart?
        if (c[1] < -no_slope) {
            at = 0.0;
            return fresh ? Verdict::unsure : Verdict::no;
        }
        if (c[1] > no_slope) {
            const double least = std::fmin(c[1], std::fmin(c[1] + 0.5 * c[2], c[1] + c[2] + c[3]));
            halve = !(least > tail);
            return Verdict::yes;
        }
        if (!(c[2] > no_slope)) return Verdict::unsure;
        halve = !(std::fmin(c[2], c[2] + c[3]) > tail);
        return Verdict::yes;
    }
    const double d0 = c[1], d1 = c[1] + c[2], d2 = c[1] + 2.0 * c[2] + 3.0 * c[3];
    if (std::fmin(d0, std::fmin(d1, d2)) > slope_tail) return Verdict::yes;
    if (!(std::fmax(d0, std::fmax(d1, d2)) < -slope_tail)) {
        halve = true;
        return Verdict::yes;
    }
    if (end >= 0.0) return Verdict::yes;
    // Newton's method within the bracket that the zero lies in. Steps shrink quadratically: once short, one more is
    // enough.
    double low = 0.0, high = 1.0, t = c[0] / (c[0] - end);
    bool last = false;
    for (int n = 0; n < 60; ++n) {
        double value = c[c.degree], slope = 0.0;
        for (std::size_t k = c.degree; k-- > 0;) {
            slope = slope * t + value;
            value = value * t + c[k];
        }
        (value > 0.0 ? low : high) = t;
        const double next = t - value / slope;
        const bool close = std::fabs(next - t) <= 1e-9, inside = next > low && next < high;
        if (close && !inside) break;
        t = inside ? next : 0.5 * (low + high);
        if (close && last) break;
        last = close;
    }
    at = t;
    return Verdict::no;
}

inline double Walk::output_torque() const {
    StateOf<D> x{};
    x_.store(x.data());
    return value_of(r_->details->output_torque, r_->output_torque, x, memory_, u_);
}

// A contact has come to rest: its speed is zero to the last bit, and a turning point sets the hysteresis (16).
inline void Walk::stop(const RegimeDetails& old, int contact) {
    for (const RegimeDetails::Stop& s : old.stops[static_cast<std::size_t>(contact)])
        if (s.state >= 0) x_.set(s.state, s.other < 0 ? 0.0 : s.share * x_[s.other]);
    if (contact != old.twist_contact || old.hysteresis == 0.0) return;
    const double stiffness = old.output_torque[static_cast<std::size_t>(old.twist)];
    memory_[0] = old.hysteresis * std::fabs(stiffness * x_[old.twist] + r_->output_torque);
}

// Finds the regime that follows where a guard has fallen, or, after the inputs have jumped, is below zero.
inline bool Walk::resolve(int fired, bool jump) {
    using Guard = model::Guard;
    const RegimeDetails& old = *r_->details;
    const Label& label = r_->label;
    const RegimeDetails::Mark mark = old.mark[static_cast<std::size_t>(fired)];
    Label next = label;
    unsigned moving = 0;
    for (unsigned c = 0; c < D::contacts; ++c)
        if (!old.at_rest[c]) moving |= 1u << c;
    const double T_2 = old.cell < 0 ? 0.0 : output_torque();
    const auto relocate = [&](Label& l) {
        if (old.cell >= 0) regimes_.locate_losses(l, old, T_2, x_[old.input_speed]);
    };
    ++switchings_;
    if (mark.kind == Guard::edge || mark.kind == Guard::input_limit) {
        next.branch[static_cast<std::size_t>(mark.branch)] = mark.neighbour;
        return accept(next, jump ? moving : 0u, -1) == Verdict::yes;
    }
    const auto c = static_cast<std::size_t>(mark.contact);
    if (mark.kind == Guard::capacity) {
        next.modes[c] = static_cast<std::int8_t>(mark.neighbour);
        relocate(next);
        return accept(next, jump ? moving : moving | 1u << c, -1) == Verdict::yes;
    }
    if (mark.kind != Guard::speed || jump || !old.stops_alone[c]) return false;
    stop(old, mark.contact);
    moving &= ~(1u << c);
    const auto was = label.modes[c];
    for (const int mode : {0, static_cast<int>(-was), static_cast<int>(was)}) {
        next = label;
        next.modes[c] = static_cast<std::int8_t>(mode);
        relocate(next);
        const Verdict v = accept(next, moving, mark.contact);
        if (v == Verdict::yes) return true;
        if (v == Verdict::unsure) return false;
    }
    return false;
}

// Takes the regime of these modes, its branches found by a walk across the edges that are violated, if it holds.
// moving: contacts that go on in their direction, whatever their speed. by_value: a contact that has just come to rest,
// of which the torque alone decides.
inline Walk::Verdict Walk::accept(Label next, unsigned moving, int by_value) {
    for (int n = 0; n < longest_walk; ++n) {
        RegimeTable* q = regimes_.at(next);
        if (!q->plain()) return Verdict::unsure;
        int violated = -1;
        const Verdict v = verify(*q, moving, by_value, false, violated);
        if (v == Verdict::yes) r_ = q;
        if (v != Verdict::no) return v;
        const RegimeDetails::Mark& mark = q->details->mark[static_cast<std::size_t>(violated)];
        if (mark.kind == model::Guard::outside) return Verdict::unsure;
        if (mark.kind != model::Guard::edge && mark.kind != model::Guard::input_limit) return Verdict::no;
        next.branch[static_cast<std::size_t>(mark.branch)] = mark.neighbour;
    }
    return Verdict::unsure;
}

// Does a guard that is zero rise from there, by its first or second derivative?
inline Walk::Verdict Walk::departs(const RegimeTable& q, const Forms& form, int lane) const {
    const Forms rates = q.rates();
    const Four rate = rates.of_state(x_) + rates.constant(memory_, u_);
    const Four size = rates.magnitude(absolute(x_), memory_, u_);
    const double first = form.of_state(rate)[lane], of_first = form.magnitude_of_state(size)[lane];
    if (std::fabs(first) > doubt * of_first) return first > 0.0 ? Verdict::yes : Verdict::no;
    const double next = form.of_state(rates.of_state(rate))[lane],
                 of_next = form.magnitude_of_state(rates.magnitude_of_state(size))[lane];
    return next > doubt * of_next ? Verdict::yes : Verdict::unsure;
}

// Whether a regime holds strictly just after now: each guard is positive or, if it is zero, rises. lasting: of the
// present regime after a change of the inputs: what is zero holds. violated: a guard that is not, edges first.
inline Walk::Verdict Walk::verify(const RegimeTable& q, unsigned moving, int by_value, bool lasting,
                                  int& violated) const {
    using Guard = model::Guard;
    const Four size_of_x = absolute(x_);
    if (lasting) {
        moving = 0;
        for (unsigned c = 0; c < D::contacts; ++c)
            if (!q.details->at_rest[c]) moving |= 1u << c;
    }
    violated = -1;
    bool sure = true, by_contact = false;
    int contacts_violated = 0;
    for (int b = 0; b < q.shared->n_blocks; ++b) {
        const Forms form = q.guards(b);
        const Four value = form.of_state(x_) + form.constant(memory_, u_),
                   near = doubt * form.magnitude(size_of_x, memory_, u_);
        unsigned doubtful = ~above(value, near) & 15u;
        for (; doubtful != 0; doubtful &= doubtful - 1) {
            const int lane = std::countr_zero(doubtful), g = 4 * b + lane;
            const RegimeDetails::Mark& mark = q.details->mark[static_cast<std::size_t>(g)];
            if (mark.kind == Guard::speed && (moving >> mark.contact & 1u) != 0) continue;
            if (!(value[lane] < -near[lane])) {
                if (lasting) continue;
                if (mark.kind == Guard::capacity && mark.contact == by_value) sure = false;
                const Verdict rises = departs(q, form, lane);
                if (rises == Verdict::unsure) sure = false;
                if (rises != Verdict::no) continue;
            }
            const bool of_contact = mark.kind == Guard::speed || mark.kind == Guard::capacity;
            if (of_contact) ++contacts_violated;
            if (violated < 0 || (by_contact && !of_contact)) {
                violated = g;
                by_contact = of_contact;
            }
        }
    }
    if (!sure || (lasting && contacts_violated > 1)) return Verdict::unsure;
    return violated < 0 ? Verdict::yes : Verdict::no;
}

}  // namespace lostmotion::batch
