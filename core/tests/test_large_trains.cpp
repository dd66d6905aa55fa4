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

TEST_CASE("exact and adaptive solver agree on random trains of 9 to 40 shafts with all elements") {
    RandomTrains random(91);
    SolverTally tally;
    for (int n = 0; n < cases(30); ++n) {  // of which some take a minute by the adaptive solver
        CAPTURE(n);
        compare_solvers(RandomRun(random, 40, 0.05, 9), {}, 0.05, tally, ("large 91 " + std::to_string(n)).c_str());
    }
    MESSAGE(tally.compared << " trains compared, largest difference " << tally.worst << "; " << tally.undecided
                           << " that the adaptive solver does not settle, " << tally.forked << " with two motions, "
                           << tally.outlasted << " that the adaptive solver follows for a time, " << tally.jammed
                           << " that jam");
    CHECK(tally.compared > share(25));
    CHECK(tally.wrong == 0);
}

}  // namespace lostmotion::model

TEST_SUITE_END();
