// Which regime of a train follows at an event: by independent principles, and against all combinations.
#include <doctest/doctest.h>

#include "gauss_principle.hpp"
#include "kernels/system.hpp"
#include "lostmotion/model/check.hpp"
#include "lostmotion/solver/regime_cache.hpp"
#include "paused_run.hpp"
#include "random_trains.hpp"
#include "referee_polynomial.hpp"

TEST_SUITE_BEGIN("train_modes");

namespace lostmotion::model {
namespace {

Train row_of_shafts(const std::vector<double>& inertia, const std::vector<double>& friction) {
    Train t;
    for (std::size_t s = 0; s < inertia.size(); ++s) {
        t.shafts.push_back(shaft(inertia[s]));
        t.shafts.back().friction.torque = friction[s];
        t.shafts.back().loaded = true;
    }
    return t;
}

// Accelerations of shafts that rigid gears tie together, from all balances and ties at once in four times the digits:
// full pivoting, no division by an inertia.
std::vector<double> tied_accelerations(const Train& t, const std::vector<double>& torque) {
    using test::referee::Quad;
    const std::size_t shafts = t.shafts.size(), n = shafts + t.gears.size();
    std::vector<std::vector<Quad>> A(n, std::vector<Quad>(n + 1));
    for (std::size_t s = 0; s < shafts; ++s) {
        A[s][s] = t.shafts[s].inertia;
        A[s][n] = torque[s];
    }
    for (std::size_t g = 0; g < t.gears.size(); ++g) {  // the unknown is T_2, T_1 = T_2/(i eta)
        const Gear& gear = t.gears[g];
        const Quad i = gear.law.ratio, T_1 = 1 / (i * Quad(gear.law.efficiency));
        auto& tie = A[shafts + g];
        A[gear.input][shafts + g] += T_1;
        A[gear.output][shafts + g] -= 1;
        tie[gear.input] += 1 / i;
        tie[gear.output] -= 1;
        if (gear.housing == nowhere) continue;
        A[gear.housing][shafts + g] += 1 - T_1;
        tie[gear.housing] += 1 - 1 / i;
    }
    std::vector<std::size_t> column(n);
    std::iota(column.begin(), column.end(), std::size_t{0});
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t row = k, at = k;
        for (std::size_t r = k; r < n; ++r)
            for (std::size_t c = k; c < n; ++c)
                if (test::referee::magnitude(A[r][column[c]]) > test::referee::magnitude(A[row][column[at]]))
                    row = r, at = c;
        std::swap(A[k], A[row]);
        std::swap(column[k], column[at]);
        for (std::size_t r = 0; r < n; ++r) {
            const Quad factor = A[r][column[k]] / A[k][column[k]];
            if (r == k || factor == 0) continue;
            for (std::size_t c = 0; c <= n; ++c) A[r][c] -= factor * A[k][c];
        }
    }
    std::vector<double> a(shafts);
    for (std::size_t k = 0; k < n; ++k)
        if (column[k] < shafts) a[column[k]] = static_cast<double>(A[k][n] / A[k][column[k]]);
    return a;
}

}  // namespace

TEST_CASE("light shafts that rigid gears tie to heavy ones lose no digits, down to no inertia at all") {
    RandomTrains random(26);
    int compared = 0;
    for (int n = 0; n < cases(2000); ++n) {
        const int shafts = random.pick(2, 6);
        Train t = row_of_shafts(std::vector<double>(static_cast<std::size_t>(shafts)),
                                std::vector<double>(static_cast<std::size_t>(shafts)));
        std::vector<double> torque;
        for (Shaft& s : t.shafts) {
            s.inertia = random.coin() ? random.spread(0.1, 10.0) : random.coin() ? random.spread(1e-14, 0.1) : 0.0;
            torque.push_back(random.uniform(-1.0, 1.0));
        }
        for (int s = 1; s < shafts; ++s) {
            Gear g = rigid_gear(s - 1, s, random.spread(0.2, 20.0));
            if (random.coin(0.3)) g.law.efficiency = random.uniform(0.7, 1.0);
            if (s + 1 < shafts && random.coin(0.3)) {
                g.output = ++s;
                g.housing = s - 1;
                g.law.ratio = -g.law.ratio;
            }
            t.gears.push_back(g);
        }
        for (ShaftMotor m = torque_motor(0); t.motors.empty();) t.motors.push_back(m);
        if (!check(t).empty()) continue;
        // A light shaft that is free alone would be accelerated by torques that cancel.
        CAPTURE(n);
        TrainRun run(t);
        for (int s = 0; s < shafts; ++s) run.inputs[run.load(s)] = constant(-torque[static_cast<std::size_t>(s)]);
        if (!run.begin()) continue;
        const std::vector<double> expected = tied_accelerations(t, torque);
        double size = 0.0;
        for (const double a : expected) size = std::max(size, std::fabs(a));
        for (int s = 0; s < shafts; ++s)
            CHECK(run.acceleration(s) ==
                  doctest::Approx(expected[static_cast<std::size_t>(s)]).scale(size).epsilon(1e-11));
        ++compared;
    }
    CHECK(compared > share(1000));
}

TEST_CASE("accelerations of random trains are those of the principle of least constraint") {
    RandomTrains random(21);
    int compared = 0, at_rest = 0;
    for (int n = 0; n < cases(1500); ++n) {
        Train t = random.train(random.pick(2, 6), false);
        for (Shaft& s : t.shafts) s.friction.breakaway_torque = 0.0;  // the principle needs one capacity
        const Assembly a(t);
        SwitchedTrain search(a);
        Instant now = random.instant(a, n % 3 == 0 ? 0.0 : 0.3);
        const Instant before = now;
        Key key;
        CAPTURE(n);
        REQUIRE(search.start(now, key) == Found::yes);
        const SparseRegime& r = search.regimes()[key];
        const std::vector<double> expected = least_constraint(a, before, 4000);
        for (std::size_t s = 0; s < expected.size(); ++s) {
            const double mine = evaluate(r.rate[a.places().shafts[s].speed], now);
            CHECK(mine == doctest::Approx(expected[s]).scale(1.0).epsilon(1e-6));
            at_rest += mine == 0.0;
        }
        for (const SparseRegime::Guard& g : r.guards)
            CHECK(evaluate(g.form, now) >= -rounding * magnitude(g.form, now));
        ++compared;
    }
    CHECK(compared == cases(1500));
    CHECK(at_rest > share(500));
}

TEST_CASE("pivoting and trying all combinations find the same accelerations, with losses") {
    RandomTrains random(23);
    int compared = 0;
    long worst = 0;
    for (int n = 0; n < cases(500); ++n) {
        const Assembly a(random.train(random.pick(2, 5), true));
        SwitchedTrain all(a), pivoting(a);
        all.few = 1e9;
        pivoting.few = 0.0;
        const Instant start = random.instant(a, n % 3 == 0 ? 0.0 : 0.3);
        Instant now = start, other = start;
        Key key, other_key;
        CAPTURE(n);
        const Found found = all.start(now, key);
        pivoting.searches = {};
        const Found other_found = pivoting.start(other, other_key);
        worst = std::max(worst, pivoting.searches.trials);
        CHECK(static_cast<int>(found) == static_cast<int>(other_found));
        if (found != Found::yes || other_found != Found::yes) continue;
        // A self-locking gear may hold or lower its load, and a torque between break-away and sliding friction may hold
        // a shaft or move it, both in accord with the friction.
        const auto& gears = a.train().gears;
        if (std::any_of(gears.begin(), gears.end(),
                        [](const Gear& g) { return g.efficiencies && g.efficiencies->overrunning() <= 0.0; }))
            continue;
        const auto& shafts = a.train().shafts;
        if (std::any_of(shafts.begin(), shafts.end(), [](const Shaft& s) { return s.friction.breakaway_torque > 0.0; }))
            continue;
        ++compared;
        for (const ShaftPlace& s : a.places().shafts)
            CHECK(evaluate(all.regimes()[key].rate[s.speed], now) ==
                  doctest::Approx(evaluate(pivoting.regimes()[other_key].rate[s.speed], other)).epsilon(1e-9));
    }
    CHECK(compared > share(200));
    CHECK(worst < 1000);  // of a self-locking train, all ways of searching together
}

TEST_CASE("a jump that starts a chain with all its contacts at rest is found in few trials") {
    RandomTrains random(22);
    long worst = 0, contacts = 0;
    for (int n = 0; n < cases(1000); ++n) {
        Train t;
        t.shafts.resize(7);
        for (Shaft& s : t.shafts) {
            s.inertia = random.spread(0.3, 3.0);
            s.friction.torque = random.spread(0.1, 1.0);
            s.loaded = true;
        }
        for (int g = 0; g < 6; ++g) {
            Gear gear = random.gear(g, g + 1, false);
            gear.law.compliance = Gearbox::torsion_curve;
            gear.law.curve = TorsionCurve({}, {50.0});
            gear.law.hysteresis_efficiency = 0.8;
            t.gears.push_back(gear);
        }
        const Assembly a(t);
        SwitchedTrain search(a);
        Instant now;
        for (int g = 0; g < 6; ++g) now.memory[a.places().gears[g].hysteresis] = random.spread(0.05, 1.0);
        Key key;
        REQUIRE(search.start(now, key) == Found::yes);
        for (int i = 0; i < a.layout().inputs; ++i) now.input[0][i] = random.uniform(-3.0, 3.0);
        search.searches = {};
        CAPTURE(n);
        REQUIRE(search.next(now, nowhere, key, {}) == Found::yes);
        worst = std::max(worst, search.searches.trials);
        contacts = a.layout().contacts;
        const std::vector<double> expected = least_constraint(a, now, 20000);
        for (std::size_t s = 0; s < expected.size(); ++s)
            CHECK(evaluate(search.regimes()[key].rate[a.places().shafts[s].speed], now) ==
                  doctest::Approx(expected[s]).scale(1.0).epsilon(1e-6));
    }
    CHECK(contacts == 13);
    CHECK(worst <= 60);  // at both ends of the way of the torques, of 3^13 combinations
}

TEST_CASE("a kernel hands over to the search all that it needs, and takes back what it changes") {
    RandomTrains random(24);
    for (int n = 0; n < cases(200); ++n) {
        const Assembly a(random.train(random.pick(2, 4), true));
        SwitchedTrain search(a);
        const TrainSystem<WidestTest> system(a);
        RegimeCache<TrainSystem<WidestTest>> cache(system);
        Instant now = random.instant(a, 0.2);
        now.reach(a.layout());
        InstantOf<WidestTest> packed;
        const auto copy = [](const auto& from, auto& to) {
            for (std::size_t k = 0; k < to.size(); ++k) to[k] = std::as_const(from)[k];
        };
        for (int k = 0; k < a.layout().states; ++k) packed.x[state_place<WidestTest>(a.layout(), k)] = now.x[k];
        copy(now.memory, packed.memory);
        copy(now.input_magnitudes, packed.input_magnitudes);
        const auto inputs = [&] {
            for (int k = 0; k < n_derivatives; ++k) copy(now.input[k], packed.input[k]);
        };
        inputs();
        Key key, packed_key;
        CAPTURE(n);
        CHECK(search.start(now, key) == system.start(packed, packed_key));
        CHECK(key == packed_key);
        for (int jump = 0; jump < 3; ++jump) {
            const auto before = now.input[0];
            const auto packed_before = packed.input[0];
            for (int i = 0; i < a.layout().inputs; ++i) now.input[0][i] = random.uniform(-2.0, 2.0);
            inputs();
            CHECK(search.next(now, nowhere, key, before) ==
                  system.next(cache, packed, nullptr, packed_key, packed_before));
            CHECK(key == packed_key);
            for (std::size_t k = 0; k < packed.memory.size(); ++k)
                CHECK(packed.memory[k] == std::as_const(now.memory)[k]);
        }
    }
}

}  // namespace lostmotion::model

TEST_SUITE_END();
