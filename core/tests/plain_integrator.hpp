// A plain integrator for trains: Taylor steps of fixed length, guards watched at points of each step and bisected.
#pragma once

#include <memory>
#include <unordered_map>

#include "lostmotion/model/power_flows.hpp"
#include "train_support.hpp"

namespace lostmotion::model {

// value + slope t + amplitude sin(omega t + phase), from `from` on.
struct TestInput {
    double value = 0.0, slope = 0.0, amplitude = 0.0, omega = 0.0, phase = 0.0, from = 0.0;

    double derivative(int k, double t) const {
        const double wave = amplitude * std::pow(omega, k) * std::sin(omega * t + phase + 0.5 * pi * k);
        return wave + (k == 0 ? value + slope * (t - from) : k == 1 ? slope : 0.0);
    }
};

struct TrainEvent {
    double time;
    Guard::Kind kind;
    int contact, branch;
    Key before, after;
};

class TrainRun {
 public:
    // Each input has pieces, rising in `from`.
    std::vector<std::vector<TestInput>> inputs;
    std::vector<TrainEvent> events;
    Instant now;
    Key key;
    Found found = Found::yes;
    double step = 1e-3;

    explicit TrainRun(Train train) : inputs(100, {TestInput{}}), assembly(std::move(train)), search(assembly) {}

    const Assembly assembly;
    SwitchedTrain search;

    const Layout& layout() const { return assembly.layout(); }
    double& speed(int shaft) { return now.x[assembly.places().shafts[shaft].speed]; }
    double& angle(int part) { return now.x[layout().coupled + part]; }
    double& shaft_angle(int shaft) { return now.x[assembly.places().shafts[shaft].angle]; }
    double& twist(int gear) { return now.x[assembly.places().gears[gear].twist]; }
    int command(int motor) const { return assembly.places().motors[motor].command; }
    int load(int shaft) const { return assembly.places().shafts[shaft].load; }
    const Regime& regime() {
        auto& r = regimes_[key];
        if (!r) r = std::make_unique<Regime>(assembly.build(key));
        return *r;
    }
    double value(const Row& f) { return evaluate(layout(), f, now); }
    int mode(int contact) const { return key.modes[contact]; }

    bool begin() {
        begun_ = true;
        see_inputs(now.time);
        found = search.start(now, key);
        return found == Found::yes;
    }
    // Runs to t_end, from its start if it has not begun; false if no regime follows.
    bool run(double t_end) {
        if (!begun_ && !begin()) return false;
        while (now.time < t_end && found == Found::yes) {
            double limit = t_end;
            for (const auto& pieces : inputs)
                for (const TestInput& p : pieces)
                    if (p.from > now.time) limit = std::min(limit, p.from);
            see_inputs(now.time);
            const double end = std::min(limit, now.time + step), turn = turning(end);
            const Guard* fired = advance(turn);
            if (fired != nullptr) {
                events.push_back({now.time, fired->kind, fired->contact, fired->branch, key, key});
                const auto number = static_cast<int>(fired - regime().guards.data());
                found = fired->kind == Guard::outside ? Found::outside : search.next(now, number, key, now.input[0]);
                events.back().after = key;
            } else if ((now.time == limit && limit < t_end) || turn < end) {
                auto before = now.input[0];
                for (int i = 0; i < layout().inputs; ++i)
                    before[static_cast<std::size_t>(i)] =
                        left_piece(static_cast<std::size_t>(i), now.time).derivative(0, now.time);
                see_inputs(now.time);
                found = search.next(now, nowhere, key, before);
            }
            if (events.size() > 100000) return false;
        }
        return found == Found::yes;
    }

 private:
    static constexpr int order = 14, points = 16;
    using Derivatives = std::array<std::array<double, 64>, order + 1>;

    const TestInput& piece(std::size_t input, double t) const {
        const auto& all = inputs[input];
        std::size_t k = 0;
        while (k + 1 < all.size() && all[k + 1].from <= t) ++k;
        return all[k];
    }
    // Where the input that drives a contact at its limit turns back, or `end`.
    double turning(double end) {
        const int i = regime().driving_input;
        if (i < 0) return end;
        const TestInput& input = piece(static_cast<std::size_t>(i), now.time);
        const auto way = [&](double t) { return regime().driving_way * input.derivative(1, t); };
        if (way(end) >= 0.0 || way(now.time) <= 0.0) return end;
        double low = now.time, high = end;
        for (int b = 0; b < 60; ++b) {
            const double middle = 0.5 * (low + high);
            (way(middle) >= 0.0 ? low : high) = middle;
        }
        return high;
    }
    const TestInput& left_piece(std::size_t input, double t) const {
        const auto& all = inputs[input];
        std::size_t k = 0;
        while (k + 1 < all.size() && all[k + 1].from < t) ++k;
        return all[k];
    }
    void see_inputs(double t) {
        for (int i = 0; i < layout().inputs; ++i) {
            const TestInput& p = piece(static_cast<std::size_t>(i), t);
            for (int k = 0; k < n_derivatives; ++k) now.input[k][i] = p.derivative(k, t);
            now.input_magnitudes[i] = std::fabs(p.value) + std::fabs(p.slope * (t - p.from)) + std::fabs(p.amplitude);
        }
    }
    // Advances to `to`, or to where a guard falls through zero.
    const Guard* advance(double to) {
        const Regime& r = regime();
        const Layout& n = layout();
        const double from = now.time, h = to - from;
        Derivatives d{};
        std::vector<const TestInput*> input;
        for (int i = 0; i < n.inputs; ++i) input.push_back(&piece(static_cast<std::size_t>(i), from));
        for (int s = 0; s < n.states; ++s) d[0][s] = now.x[s];
        for (int k = 0; k < order; ++k)
            for (int s = 0; s < n.states; ++s) {
                const Row& f = r.rate[s];
                double sum = 0.0;
                if (k == 0) {
                    sum = f.c[n.one];
                    for (int m = 0; m < n.memory; ++m) sum += f.c[n.first_memory + m] * now.memory[m];
                }
                for (int i = 0; i < n.inputs; ++i) sum += f.c[n.first_input + i] * input[i]->derivative(k, from);
                for (int j = 0; j < n.states; ++j) sum += f.c[j] * d[k][j];
                d[k + 1][s] = sum;
            }
        const auto at = [&](double t) {
            Instant out = now;
            out.time = from + t;
            for (int s = 0; s < n.states; ++s) {
                double sum = 0.0;
                for (int k = order; k >= 0; --k) sum = sum * t / (k + 1) + d[k][s];
                out.x[s] = sum;
            }
            for (int i = 0; i < n.inputs; ++i) out.input[0][i] = input[i]->derivative(0, from + t);
            return out;
        };
        const auto fallen = [&](const Guard& g, const Instant& x) {
            return evaluate(n, g.form, x) < -rounding * magnitude(n, g.form, x);
        };
        const Guard* fired = nullptr;
        double end = h;
        for (int k = 1; k <= points && fired == nullptr; ++k) {
            const Instant x = at(h * k / points);
            for (const Guard& g : r.guards) {
                if (!fallen(g, x)) continue;
                double low = h * (k - 1) / points, high = h * k / points;
                for (int b = 0; b < 60; ++b) {
                    const double middle = 0.5 * (low + high);
                    (evaluate(n, g.form, at(middle)) >= 0.0 ? low : high) = middle;
                }
                if (fired == nullptr || high < end) {
                    fired = &g;
                    end = high;
                }
            }
        }
        integrate_powers(r, at, end);
        now = at(end);
        now.time = fired == nullptr ? to : from + end;
        see_inputs(now.time);
        return fired;
    }
    // By the Gauss rule of five points.
    template <class At>
    void integrate_powers(const Regime& r, const At& at, double h) {
        if (!energy) return;
        constexpr double node[5] = {-0.906179845938663993, -0.538469310105683091, 0.0, 0.538469310105683091,
                                    0.906179845938663993},
                         weight[5] = {0.236926885056189088, 0.478628670499366468, 0.568888888888888889,
                                      0.478628670499366468, 0.236926885056189088};
        const std::vector<NumberedPower> flows = power_flows(assembly, r);
        const std::vector<PowerFlow> all = all_flows(assembly);
        for (int k = 0; k < 5; ++k) {
            const Instant x = at(0.5 * h * (1.0 + node[k]));
            for (const NumberedPower& f : flows) {
                const PowerFlow::Kind kind = all[static_cast<std::size_t>(f.flow)].kind;
                const double E =
                    0.5 * h * weight[k] * evaluate(layout(), f.power.torque, x) * evaluate(layout(), f.power.speed, x);
                gained += kind == PowerFlow::source ? E : -E;
                turned_over += std::fabs(E);
                if (kind == PowerFlow::loss) least_loss = std::min(least_loss, E);
            }
        }
    }

 public:
    bool energy = false;
    double gained = 0.0, turned_over = 0.0, least_loss = 0.0;  // [J]

 private:
    bool begun_ = false;
    std::unordered_map<Key, std::unique_ptr<Regime>, KeyHash> regimes_;
};

}  // namespace lostmotion::model
