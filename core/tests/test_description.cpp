// Descriptions of scenarios: written and read back the same, and refused by a sentence where they are wrong.
#include <doctest/doctest.h>

#include <bit>
#include <cstring>
#include <random>

#include "drive_runs.hpp"
#include "lostmotion/scenario/simulation.hpp"
#include "random_trains.hpp"

namespace lostmotion::test {

namespace {

Scenario paper_scenario() {
    Scenario s;
    s.title = "paper";
    s.train = train_of(paper_drive(plane_map(0.02, 0.04, 0.06)));
    s.inputs = {sine(0.3, 1.0), constant(0.0)};
    s.start.assign(n_states, 0.0);
    s.hysteresis_capacities = {0.0};
    ControlledAxis axis;
    axis.law.speed_loop.gain = 0.01;
    axis.law.speed_loop.integral_gain = 0.1;
    axis.law.reference.pieces = {{0.0, {0.0, 50.0}}, {0.1, {5.0}}};
    control::DiscreteSystem filter;
    filter.A = {0.5};
    filter.B = {0.5};
    filter.C = {1.0};
    filter.D = 0.0;
    axis.law.speed_filters = {filter};
    axis.law.current_loop.emplace();
    axis.speed_shaft = axis.position_shaft = 0;
    s.control.axes = {axis};
    return s;
}

Scenario train_scenario(const model::Train& train) {
    const model::Assembly a(train);
    Scenario s;
    s.train = train;
    for (int i = 0; i < a.layout().inputs; ++i) s.inputs.push_back(constant(0.01 * (i + 1)));
    s.start.assign(static_cast<std::size_t>(a.layout().states), 0.0);
    s.hysteresis_capacities.assign(train.gears.size(), 0.0);
    return s;
}

model::Train random_train(model::RandomTrains& random) {
    model::Train train = random.train(random.pick(2, 5), true);
    // What takes part in names of states.
    for (std::size_t k = 0; k < train.shafts.size(); ++k) train.shafts[k].name = "s" + std::to_string(k);
    for (std::size_t k = 0; k < train.motors.size(); ++k) train.motors[k].name = "m" + std::to_string(k);
    for (std::size_t k = 0; k < train.gears.size(); ++k) train.gears[k].name = "g" + std::to_string(k);
    return train;
}

bool same(const std::vector<double>& a, const std::vector<double>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

const ScenarioParameter load_inertia{"load.inertia", "kg*m^2", 2.125};

// The first number of a description that is a value follows from a parameter.
Derivation follows(const std::vector<double>& numbers, double value) {
    const auto place = std::find(numbers.begin() + ScenarioDescription::head, numbers.end(), value) - numbers.begin();
    using Formula = Derivation::Formula;
    return {{{Formula::parameter}}, {}, {{static_cast<int>(place) - static_cast<int>(ScenarioDescription::head), 0}}};
}

// Numbers that are likely to be taken for something.
double odd_number(std::mt19937_64& bits) {
    constexpr double odd[] = {0.0, -0.0, 1.0, -1.0, 2.0, 3.0, 0.5, 1e-300, 1e300, -1e300, 1e9, 1e18, 65536.0, 1e-3};
    const auto k = bits() % (std::size(odd) + 3);
    if (k == std::size(odd)) return std::numeric_limits<double>::infinity();
    if (k == std::size(odd) + 1) return std::nan("");
    if (k == std::size(odd) + 2) return std::bit_cast<double>(bits());
    return odd[k];
}

}  // namespace

TEST_SUITE("description") {
    TEST_CASE("what is read and written again is the same") {
        std::vector<Scenario> all{paper_scenario()};
        model::RandomTrains random(5);
        for (int n = 0; n < 40; ++n) {
            const model::Train train = random_train(random);
            if (TrainRun(train).error().empty()) all.push_back(train_scenario(train));
        }
        CHECK(all.size() > 20);
        for (const Scenario& s : all) {
            const std::vector<double> numbers = ScenarioDescription::write(s);
            const ScenarioDescription read(numbers);
            REQUIRE(read.error() == "");
            CHECK(same(ScenarioDescription::write(read.scenario()), numbers));
        }
    }
    TEST_CASE("a parameter changes what it says, and nothing else") {
        Scenario s = paper_scenario();
        s.train.shafts[1].inertia = 2.125;  // no other number is the same
        const std::vector<double> plain = ScenarioDescription::write(s);
        ScenarioDescription d(ScenarioDescription::write(s, {load_inertia}, follows(plain, 2.125)));
        REQUIRE(d.error() == "");
        CHECK(d.set(0, 3.5) == "");
        Scenario changed = s;
        changed.train.shafts[1].inertia = 3.5;
        CHECK(same(ScenarioDescription::write(d.scenario()), ScenarioDescription::write(changed)));
        CHECK(d.set(0, -1.0) == "parameter load.inertia: train.shafts[1].inertia is -1; it must be finite and >= 0");
        CHECK(d.scenario().train.shafts[1].inertia == 3.5);
        CHECK(d.set(0, 2.125) == "");
        CHECK(same(ScenarioDescription::write(d.scenario()), plain));
    }
    TEST_CASE("a parameter keeps to its range") {
        Scenario s = paper_scenario();
        s.train.shafts[1].inertia = 2.125;  // no other number is the same
        ScenarioParameter p = load_inertia;
        p.range = {1e-3, 0.5, 8.0};
        ScenarioDescription d(ScenarioDescription::write(s, {p}, follows(ScenarioDescription::write(s), 2.125)));
        REQUIRE(d.error() == "");
        CHECK(d.set(0, 1e-3) == "parameter load.inertia: 0.001 must be greater than 0.001");
        CHECK(d.set(0, 0.4) == "parameter load.inertia: 0.4 must be at least 0.5");
        CHECK(d.set(0, 8.5) == "parameter load.inertia: 8.5 must be at most 8");
        CHECK(d.set(0, std::nan("")) == "parameter load.inertia: it must be finite");
        CHECK(d.scenario().train.shafts[1].inertia == 2.125);
        CHECK(d.set(0, 8.0) == "");
        CHECK(d.set(0, 0.5) == "");
        CHECK(d.scenario().train.shafts[1].inertia == 0.5);
    }
    TEST_CASE("the checksum is that of ISO 3309") {
        Checksum sum;
        sum.add("123456789");
        CHECK(sum.value() == 0xcbf43926u);
    }
    TEST_CASE("damaged numbers are refused or make a scenario that can be run, never a crash") {
        std::mt19937_64 bits(3);
        model::RandomTrains random(7);
        std::vector<std::vector<double>> originals{ScenarioDescription::write(paper_scenario())};
        while (originals.size() < 12) {
            const model::Train train = random_train(random);
            if (TrainRun(train).error().empty()) originals.push_back(ScenarioDescription::write(train_scenario(train)));
        }
        int unnoticed = 0, refused = 0, accepted = 0, run = 0;
        for (int n = 0; n < 6000; ++n) {
            std::vector<double> numbers = originals[n % originals.size()];
            for (auto left = 1 + bits() % 3; left > 0 && !numbers.empty(); --left) {
                const std::size_t at = bits() % numbers.size();
                switch (bits() % 6) {
                    case 0: numbers.erase(numbers.begin() + static_cast<std::ptrdiff_t>(at)); break;
                    case 1: numbers.insert(numbers.begin() + static_cast<std::ptrdiff_t>(at), odd_number(bits)); break;
                    case 2: numbers.resize(at + 1); break;
                    case 3: numbers[at] *= 1.5; break;
                    default: numbers[at] = odd_number(bits);
                }
            }
            const bool changed = !same(numbers, originals[n % originals.size()]);
            if (changed && ScenarioDescription(numbers).error().empty()) ++unnoticed;
            // As a program that writes wrong numbers would leave it.
            if (numbers.size() >= ScenarioDescription::head) numbers[2] = ScenarioDescription::checksum(numbers);
            const ScenarioDescription d(numbers);
            if (!d.error().empty()) {
                ++refused;
                continue;
            }
            ++accepted;
            if (accepted % 20 != 0) continue;
            // A step, however it ends.
            ScenarioSimulation sim(d.scenario(), 1e-6);
            const std::vector<double> u(sim.names().inputs.size());
            (void)sim.advance(1e-6, u, u);
            ++run;
        }
        CHECK(unnoticed == 0);
        CHECK(refused > 2000);
        CHECK(accepted > 200);
        CHECK(run > 10);
    }
    TEST_CASE("a state that is not whole is refused") {
        ScenarioSimulation sim(paper_scenario(), 1e-3);
        const std::vector<double> none{0.0};
        REQUIRE(sim.advance(1e-3, none, none) == Status::done);
        std::vector<double> state(sim.state_size());
        sim.get_state(state.data());
        CHECK(sim.set_state(state.data()));
        for (std::size_t k = 0; k < state.size(); ++k) {
            std::vector<double> damaged = state;
            damaged[k] += 1.0;
            CHECK(!sim.set_state(damaged.data()));
        }
    }
    TEST_CASE("with the parameters that it has, a simulation goes on as it was") {
        Scenario s = paper_scenario();
        s.control.axes.clear();
        ScenarioSimulation one(s, 1e-3), other(s, 1e-3);
        const std::vector<double> u{0.2, 0.0};
        for (int k = 0; k < 50; ++k) {
            REQUIRE(one.advance(1e-3, u, u) == Status::done);
            REQUIRE(other.advance(1e-3, u, u) == Status::done);
        }
        ScenarioSimulation next(s, 1e-3);
        next.go_on_from(one);
        std::vector<double> a(one.variables().size()), b(a.size());
        for (int k = 0; k < 50; ++k) {
            REQUIRE(next.advance(1e-3, u, u) == Status::done);
            REQUIRE(other.advance(1e-3, u, u) == Status::done);
        }
        REQUIRE(next.read(a.data()) == Status::done);
        REQUIRE(other.read(b.data()) == Status::done);
        for (std::size_t k = 0; k < a.size(); ++k)
            if (std::isfinite(b[k])) CHECK(a[k] == doctest::Approx(b[k]).epsilon(1e-9).scale(1e-3));
    }
}

}  // namespace lostmotion::test
