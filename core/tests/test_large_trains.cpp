// Trains with more than 16 coupled states: published runs, the bound of their series, other solvers.
#include <doctest/doctest.h>
#include <quadmath.h>

#include "../../benchmarks/train_runs.hpp"
#include "random_train_runs.hpp"

TEST_SUITE_BEGIN("large_trains");

namespace lostmotion::model {

namespace {

using System = TrainSystem<Any>;
using Quad = __float128;

struct Ended {
    std::size_t switchings;
    double speed;  // of the first mass [rad/s]
};
Ended run(const ChainOf& chain) {
    const TimedTrain t = chain_of(chain);
    const TrainIn<Any> in(t);
    ExactSolver<System> solver(in.system, in.signals, 1e-3, in.system.balanced_scale());
    Observer<System> nobody;
    REQUIRE(solver.begin(0.0, in.start, {}) == Status::done);
    REQUIRE(solver.advance(t.duration, nobody) == Status::done);
    return {solver.switchings(), solver.state()[in.assembly.places().shafts[0].speed]};
}

// The terms c_k of the series over h in quadruple precision, and their largest scaled magnitude.
struct ExactSeries {
    ExactSeries(const LinearRatesOf<Any>& rates, const Numbers& rate, const StateOf<Any>& scale, Quad h, int count) {
        std::vector<Quad> c(static_cast<std::size_t>(rates.n.coupled));
        for (std::size_t r = 0; r < c.size(); ++r) c[r] = h * rate[r];
        for (int k = 1; k <= count; ++k) {
            terms.push_back(c);
            sizes.push_back(size(c, scale));
            std::vector<Quad> next(c.size());
            for (std::size_t r = 0; r < c.size(); ++r)
                rates.each_in_row(static_cast<int>(r), [&](int j, double a) {
                    next[r] += static_cast<Quad>(a) * c[static_cast<std::size_t>(j)];
                });
            for (Quad& v : next) v *= h / (k + 1);
            c = std::move(next);
        }
    }
    static double size(const std::vector<Quad>& c, const StateOf<Any>& scale) {
        double most = 0.0;
        for (std::size_t r = 0; r < c.size(); ++r)
            most = std::fmax(most, std::fabs(static_cast<double>(c[r])) / scale[static_cast<int>(r)]);
        return most;
    }
    // What is left out after this many terms.
    double rest(std::size_t count, const StateOf<Any>& scale) const {
        std::vector<Quad> sum(terms[0].size());
        for (std::size_t k = terms.size(); k-- > count;)
            for (std::size_t r = 0; r < sum.size(); ++r) sum[r] += terms[k][r];
        return size(sum, scale);
    }
    std::vector<std::vector<Quad>> terms;
    std::vector<double> sizes;
};

// The equations of a tree of masses by themselves, segment by segment from the state that the exact solver has there:
// Runge-Kutta steps of at most 2 us, and whether friction stays within its limit and against the speed.
struct Tree {
    struct Joint {
        int a, b;
        double ratio, stiffness, half_gap, damping;
    };
    std::vector<double> inertia, viscous, friction;
    std::vector<Joint> joints;
    double amplitude, frequency;

    Tree(RandomTrains& random, int masses) : amplitude(random.spread(1.0, 10.0)), frequency(random.spread(2.0, 40.0)) {
        for (int s = 0; s < masses; ++s) {
            inertia.push_back(random.spread(1e-3, 1e-1));
            viscous.push_back(random.coin() ? random.spread(1e-3, 1e-1) : 0.0);
            friction.push_back(random.coin(0.6) ? random.spread(0.01, 1.0) : 0.0);
            if (s == 0) continue;
            const bool gap = random.coin(0.4);
            joints.push_back({random.pick(std::max(0, s - 3), s - 1), s, random.spread(0.5, 2.0),
                              random.spread(1e2, 1e4), gap ? random.spread(1e-4, 1e-2) : 0.0,
                              gap || random.coin() ? 0.0 : random.spread(0.01, 1.0)});
        }
    }
    TimedTrain timed() const {
        TimedTrain t{"tree", {}, {sine(amplitude, frequency)}, 0.1, 0};
        for (std::size_t s = 0; s < inertia.size(); ++s) {
            t.train.shafts.push_back(shaft(s == 0 ? 0.0 : inertia[s]));
            t.train.shafts[s].viscous_friction = viscous[s];
            t.train.shafts[s].friction.torque = friction[s];
        }
        t.train.motors = {torque_motor(0)};
        t.train.motors[0].law.rotor_inertia = inertia[0];
        t.train.motors[0].law.friction_torque = 0.0;
        for (const Joint& j : joints) {
            t.train.gears.push_back(spring(
                j.a, j.b, j.ratio,
                j.half_gap > 0.0 ? TorsionCurve({j.half_gap}, {0.0, j.stiffness}) : TorsionCurve({}, {j.stiffness})));
            t.train.gears.back().mesh_damping = j.damping;
        }
        return t;
    }
    // y: speeds, then twists. free: the net torque without friction.
    void rates(double t, const std::vector<double>& y, const std::vector<int>& modes, std::vector<double>& out,
               std::vector<double>& free) const {
        const std::size_t n = inertia.size();
        std::fill(free.begin(), free.end(), 0.0);
        free[0] = amplitude * std::sin(2.0 * std::numbers::pi * frequency * t);
        for (std::size_t g = 0; g < joints.size(); ++g) {
            const Joint& j = joints[g];
            const auto a = static_cast<std::size_t>(j.a), b = static_cast<std::size_t>(j.b);
            const double d = y[n + g], rate = y[a] / j.ratio - y[b];
            const double T = j.stiffness * (d - std::clamp(d, -j.half_gap, j.half_gap)) + j.damping * rate;
            free[a] -= T / j.ratio;
            free[b] += T;
            out[n + g] = rate;
        }
        for (std::size_t s = 0; s < n; ++s) {
            free[s] -= viscous[s] * y[s];
            out[s] = friction[s] > 0.0 && modes[s] == 0 ? 0.0 : (free[s] - modes[s] * friction[s]) / inertia[s];
        }
    }
};

struct Checked final : Observer<System> {
    Checked(const Tree& tree, const TrainIn<Any>& in) : tree(tree), places(in.assembly.places()) {}

    bool segment(const Segment<System>& s) override {
        const std::size_t n = tree.inertia.size(), size = n + tree.joints.size();
        std::vector<double> y(size), z(size), k[4], free(n);
        for (auto& rate : k) rate.resize(size);
        std::vector<int> modes(n);
        for (std::size_t i = 0; i < n; ++i) {
            y[i] = s.at.x()[places.shafts[i].speed];
            if (tree.friction[i] > 0.0) modes[i] = s.entry.regime->key.modes[places.shafts[i].contact];
        }
        for (std::size_t g = 0; g < tree.joints.size(); ++g) y[n + g] = s.at.x()[places.gears[g].twist];
        const double length = s.end - s.begin;
        const auto steps = static_cast<long>(std::ceil(length / 2e-6));
        const double h = steps > 0 ? length / static_cast<double>(steps) : 0.0;
        for (long j = 0; j < steps; ++j) {
            const double t = s.begin + h * static_cast<double>(j);
            for (int stage = 0; stage < 4; ++stage) {
                const double part = stage == 0 ? 0.0 : stage == 3 ? h : 0.5 * h;
                for (std::size_t i = 0; i < size; ++i) z[i] = y[i] + (stage == 0 ? 0.0 : part * k[stage - 1][i]);
                tree.rates(t + part, z, modes, k[stage], free);
                for (std::size_t i = 0; stage == 0 && i < n; ++i) {
                    if (tree.friction[i] == 0.0) continue;
                    if (modes[i] == 0) beyond = std::fmax(beyond, std::fabs(free[i]) / tree.friction[i] - 1.0);
                    if (modes[i] * y[i] < 0.0) against = std::fmax(against, std::fabs(y[i]));
                }
            }
            for (std::size_t i = 0; i < size; ++i)
                y[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
        }
        for (std::size_t i = 0; i < n; ++i) gap = std::fmax(gap, std::fabs(y[i] - s.x_end[places.shafts[i].speed]));
        for (std::size_t g = 0; g < tree.joints.size(); ++g)
            gap = std::fmax(gap, 1e3 * std::fabs(y[n + g] - s.x_end[places.gears[g].twist]));
        ++segments;
        return true;
    }

    const Tree& tree;
    const Places& places;
    long segments = 0;
    double gap = 0.0;      // of speeds [rad/s] and of twists [mrad] at the ends of segments
    double beyond = 0.0;   // of a torque at rest over what friction holds
    double against = 0.0;  // speed against the direction of slip [rad/s]
};

}  // namespace

// By a solver of its own, with sparse rows and series (shared with nobody), and by Runge-Kutta steps of 2 us.
TEST_CASE("chains of 20 and 30 masses switch as often as known, and end at the known speed") {
    const Ended twenty = run({20, 1, 3, 0.05, 3.0, 2.0}), thirty = run({30, 1, 3, 0.05, 3.0, 2.0});
    CHECK(twenty.switchings == 138);
    CHECK(twenty.speed == doctest::Approx(-8.09257568461238).epsilon(1e-12));
    CHECK(thirty.switchings == 394);
    CHECK(thirty.speed == doctest::Approx(-2.67442633135752).epsilon(1e-12));
}

TEST_CASE("what the series leaves out is within its bound, and a step is exact to rounding") {
    for (const int masses : {12, 30, 64}) {
        const TrainIn<Any> in(chain_of({masses, masses / 2, 3, 0.05, 3.0, 2.0}));
        RegimeCache<System> cache(in.system);
        ExactSolver<System> solver(in.system, in.signals, 1e-3, in.system.balanced_scale(), &cache);
        Observer<System> nobody;
        REQUIRE(solver.begin(0.0, in.start, {}) == Status::done);
        REQUIRE(solver.advance(0.123, nobody) == Status::done);
        auto& entry = cache.entry(solver.key());
        REQUIRE(entry.propagator.by_series());
        const StateOf<Any> scale = in.system.balanced_scale();
        SignalsOf<Any> still(1);
        const InputState<Any> input(still, input_basis(still));
        LanesOf<Any> rate;
        rate.coupled = (entry.rates * solver.state().coupled);
        for (int level = 0; level <= entry.propagator.longest_level(); ++level) {
            const double h = entry.propagator.length(level), theta = entry.propagator.theta(h);
            const ExactSeries exact(entry.rates, rate.coupled, scale, h, 60);
            double share = 1.0;  // theta^K/(K + 1)!
            for (std::size_t K = 1; K <= 40; ++K) {
                share *= theta / static_cast<double>(K + 1);
                const double bound = exact.sizes[0] * share / (1.0 - theta / static_cast<double>(K + 2));
                if (theta < static_cast<double>(K + 2)) CHECK(exact.rest(K, scale) <= bound);
            }
            Series series;
            series.expand(entry.rates, rate, input, h, theta);
            const Numbers change = series.change().coupled;
            std::vector<Quad> gap(exact.terms[0].size());
            for (std::size_t r = 0; r < gap.size(); ++r) {
                for (const auto& term : exact.terms) gap[r] += term[r];
                gap[r] -= static_cast<Quad>(change[r]);
            }
            CHECK(ExactSeries::size(gap, scale) <= 64.0 * 0x1p-53 * exact.sizes[0]);
        }
    }
}

TEST_CASE("a stiff chain is doubled, and takes no more event checks than one that is not") {
    const ChainOf soft{12, 6, 3, 0.05, 3.0, 2.0, 0.05}, damped{12, 6, 3, 0.05, 3.0, 2.0, 50.0};
    for (const ChainOf& chain : {soft, damped}) {
        const TrainIn<Any> in(chain_of(chain));
        RegimeCache<System> cache(in.system);
        ExactSolver<System> solver(in.system, in.signals, 1e-3, in.system.balanced_scale(), &cache);
        Observer<System> nobody;
        REQUIRE(solver.begin(0.0, in.start, {}) == Status::done);
        REQUIRE(solver.advance(1.0, nobody) == Status::done);
        CHECK(cache.entry(solver.key()).propagator.by_series() == (chain.mesh_damping < 1.0));
        CHECK(solver.event_checks() < 2000);
    }
}

TEST_CASE(
    "each segment of random trees of 9 to 40 masses is that of Runge-Kutta steps, with friction within its limits") {
    RandomTrains random(92);
    long segments = 0;
    double gap = 0.0, beyond = 0.0, against = 0.0;
    for (int n = 0; n < cases(300); ++n) {
        CAPTURE(n);
        const Tree tree(random, random.pick(9, 40));
        const TimedTrain t = tree.timed();
        const TrainIn<Any> in(t);
        ExactSolver<System> solver(in.system, in.signals, 1e-3, in.system.balanced_scale());
        Checked checked(tree, in);
        REQUIRE(solver.begin(0.0, in.start, {}) == Status::done);
        REQUIRE(solver.advance(t.duration, checked) == Status::done);
        segments += checked.segments;
        gap = std::fmax(gap, checked.gap);
        beyond = std::fmax(beyond, checked.beyond);
        against = std::fmax(against, checked.against);
    }
    MESSAGE(segments << " segments, largest difference " << gap << ", torque at rest beyond friction " << beyond
                     << ", speed against slip " << against);
    CHECK(gap < 1e-9);
    CHECK(beyond < 1e-9);
    CHECK(against < 1e-9);
    CHECK(segments > 10 * share(300));
}

TEST_CASE("an interruption ends the search of modes itself") {
    TimedTrain t = chain_of({64, 1, 3});
    for (int g = 0; g < 63; ++g) t.twists.emplace_back(g, g % 2 == 0 ? 0.01 : -0.01);  // all shafts break away at once
    const TrainIn<Any> in(t);
    ExactSolver<System> solver(in.system, in.signals, 1e-3, in.system.balanced_scale());
    int asked = 0;
    const auto yes = [](void* count) { return ++*static_cast<int*>(count) > 0; };
    solver.set_interruption({yes, &asked});
    CHECK(solver.begin(0.0, in.start, {}) == Status::interrupted);
    CHECK(asked == 1);
    solver.set_interruption({});
    CHECK(solver.begin(0.0, in.start, {}) == Status::done);
}

TEST_CASE("exact and adaptive solver agree on random trains of 9 to 40 shafts with all elements") {
    RandomTrains random(91);
    SolverTally tally;
    for (int n = 0; n < cases(30); ++n) {  // of which some take a minute by the adaptive solver
        CAPTURE(n);
        compare_solvers(RandomRun(random, 40, 0.05, 9), {}, 0.05, tally, ("large 91 " + std::to_string(n)).c_str());
    }
    MESSAGE(tally.text());
    CHECK(tally.compared > share(25));
    CHECK(tally.wrong == 0);
}

}  // namespace lostmotion::model

TEST_SUITE_END();
