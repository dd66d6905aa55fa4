// Sensitivities and periodic motions of trains.
#include <doctest/doctest.h>

#include <cstdio>

#include "kernels/train_response.hpp"
#include "lostmotion/model/check.hpp"
#include "random_trains.hpp"

using namespace lostmotion;
using namespace lostmotion::model;

namespace {

using D = Any;
using System = TrainSystem<D>;

// A run of a train from a state, with what is asked of it.
struct Path final : Observer<System> {
    std::vector<std::pair<int, int>> events;  // guard kinds and contacts
    StateOf<D> x{};
    D::Memory memory{};
    model::Key key;

    bool wants_switching() const override { return true; }
    void switching(const SwitchingOf<System>& s) override {
        events.emplace_back(s.input_jump ? -1 : s.kind, s.contact);
    }
    friend bool same_events(const Path& a, const Path& b) { return a.events == b.events && a.key == b.key; }
};

struct Case {
    explicit Case(Train train) : assembly(std::move(train)), system(assembly), cache(system), laws(system) {}

    const Assembly assembly;
    const System system;
    RegimeCache<System> cache;
    const ComponentLaws<System> laws;
    SignalsOf<D> signals{};

    StateOf<D> place(const model::Instant& now) const {
        StateOf<D> x{};
        for (int k = 0; k < assembly.layout().coupled; ++k) x[k] = now.x[k];
        return x;
    }
    // Continues from a regime that is known.
    bool run(const StateOf<D>& x, const D::Memory& memory, const model::Key& key, double begin, double end,
             Observer<System>& observer, Path& out) {
        ExactSolver<System> solver(system, signals, 1e-2, system.balanced_scale(), &cache);
        solver.resume(begin, x, memory, key);
        if (solver.inputs_changed() != Status::done || solver.advance(end, observer) != Status::done) return false;
        out.x = solver.state();
        out.memory = solver.memory();
        out.key = solver.key();
        return true;
    }
};

double component(const Path& c, int k) {
    return k < D::states ? c.x[k] : c.memory[static_cast<std::size_t>(k - D::states)];
}

}  // namespace

TEST_SUITE("train_periodic") {
    // Where both disturbed runs pass through the same events as the plain one, their difference has an error of the
    // second order in the step: two steps show it, and their extrapolation takes it off.
    // The last third has a continuous controller.
    TEST_CASE("Jacobians of random trains are those of central differences") {
        RandomTrains random(20261122);
        int compared = 0, kinked = 0, locked = 0, stopped = 0, limited = 0;
        double worst = 0.0;
        for (int n = 0; n < cases(600); ++n) {
            CAPTURE(n);
            Train train = random.train(random.pick(2, 5), random.coin(0.7));
            if (random.coin(0.3))
                train.angle_torques.push_back({"gravity", random.pick(0, 1), PeriodicCurve::sine(1.0, 1, 0.3, 0.02)});
            if (n >= cases(400)) train.controllers.push_back(random.controller(train));
            if (!model::check(train).empty()) continue;
            Case c(train);
            const double duration = 1.0;
            const std::vector<Signal> inputs = random.signals(c.assembly, duration);
            c.signals = model::packed_signals<D>(inputs);
            const model::Instant now = random.instant(c.assembly, 0.7);
            ExactSolver<System> first(c.system, c.signals, 1e-2, c.system.balanced_scale(), &c.cache);
            D::Memory memory{};
            for (int k = 0; k < c.assembly.layout().memory; ++k) memory[k] = std::as_const(now.memory)[k];
            if (first.begin(0.0, c.place(now), memory) != Status::done) continue;
            Path lead_in;
            if (first.advance(0.1, lead_in) != Status::done) continue;
            const StateOf<D> x = first.state();
            memory = first.memory();
            const model::Key key = first.key();

            SensitivityOf<System> sensitivity(c.system.counts(), c.laws, c.cache);
            Path plain, seen;
            if (!c.run(x, memory, key, 0.1, duration, plain, plain)) continue;
            REQUIRE(c.run(x, memory, key, 0.1, duration, sensitivity, seen));
            if (!sensitivity.smooth) {
                ++kinked;
                continue;
            }
            const auto& regime = c.cache.regime(key);
            for (const NamedComponent& by : train_components<D>(c.assembly)) {
                // A speed that rests, or follows another, cannot be disturbed by itself, and those that follow go
                // along; a locked torque has no effect unless it is in use.
                if (by.place < D::coupled && (regime.resting[by.place] || regime.following[by.place])) continue;
                ComponentsOf<D> direction{};
                direction[by.place] = 1.0;
                auto at_rest = regime.at_rest;
                struct {
                    ComponentsOf<D>& x;
                    typename D::Memory& memory;
                } disturbed{direction, memory};
                if (by.place < D::coupled) c.system.stop(disturbed, at_rest);
                const double h = 1e-4;
                if (by.name.ends_with("_hysteresis_capacity") &&
                    memory[static_cast<std::size_t>(by.place - D::states)] < h)
                    continue;  // it is never negative
                if (by.name.ends_with("_locked_torque")) {
                    if (!c.laws.matters(key, by.place)) continue;
                    ++locked;
                }
                const auto difference = [&](double h, ComponentsOf<D>& out) {
                    Path ends[2];
                    for (int side : {0, 1}) {
                        StateOf<D> disturbed = x;
                        D::Memory m = memory;
                        each_component<D>(c.system.counts(), [&](int k) {
                            (k < D::states ? disturbed[k] : m[k - D::states]) += (side == 0 ? -h : h) * direction[k];
                        });
                        if (!c.run(disturbed, m, key, 0.1, duration, ends[side], ends[side])) return false;
                        if (!same_events(ends[side], plain)) return false;
                    }
                    each_component<D>(c.system.counts(), [&](int k) {
                        out[k] = (component(ends[1], k) - component(ends[0], k)) / (2.0 * h);
                    });
                    return true;
                };
                ComponentsOf<D> coarse{}, fine{};
                if (!difference(h, coarse) || !difference(0.5 * h, fine)) continue;
                ++compared;
                stopped += plain.events.size() > 2;
                limited += n >= cases(400) && std::count(plain.events.begin(), plain.events.end(),
                                                         std::pair<int, int>(model::Guard::edge, nowhere)) > 0;
                for (const NamedComponent& of : train_components<D>(c.assembly)) {
                    if (!c.laws.matters(plain.key, of.place)) continue;
                    double found = 0.0;
                    each_component<D>(c.system.counts(),
                                      [&](int k) { found += sensitivity.jacobian.row[of.place][k] * direction[k]; });
                    const double expected = (4.0 * fine[of.place] - coarse[of.place]) / 3.0;
                    const double bend = std::fabs(fine[of.place] - coarse[of.place]);
                    const double allowed = 1e-7 * (1.0 + std::fabs(expected)) + 0.5 * bend;
                    CAPTURE(by.name);
                    CAPTURE(of.name);
                    CAPTURE(found);
                    CAPTURE(expected);
                    CAPTURE(bend);
                    CHECK(std::fabs(found - expected) <= allowed);
                    worst = std::fmax(worst, std::fabs(found - expected));
                }
            }
        }
        std::printf(
            "train_periodic: %d columns compared, %d with events, %d of locked torques; largest error %.1e; %d "
            "grazing\n",
            compared, stopped, locked, worst, kinked);
        CHECK(compared > share(800));
        CHECK(locked > share(5));
        CHECK(limited > share(50));
    }
}
