// Names, checks and packed regimes of trains.
#include <doctest/doctest.h>

#include "drive_runs.hpp"
#include "kernels/pack.hpp"
#include "lostmotion/model/check.hpp"
#include "lostmotion/model/names.hpp"
#include "lostmotion/model/scales.hpp"
#include "lostmotion/simulation/train_status.hpp"
#include "random_trains.hpp"

TEST_SUITE_BEGIN("train");

namespace lostmotion::model {

TEST_CASE("states, inputs and contacts of a train have names") {
    test::Drive d = test::plain_drive(2.0, 1.0, 1.0);
    d.motor.friction_torque = 0.1;
    const Assembly a(train_of(d));
    CHECK(state_names(a) ==
          std::vector<std::string>{"motor_torque", "motor_speed", "load_speed", "gearbox_twist", "load_angle"});
    CHECK(input_names(a) == std::vector<std::string>{"motor_command", "load_load_torque"});
    CHECK(contact_name(a, 0) == "motor_contact");
    CHECK(contact_name(a, 1) == "gearbox_twist_contact");
}

TEST_CASE("all quantities and energies of a drive have the names that the tests use, its states in their order") {
    test::Drive d = test::paper_drive(plane_map(0.02, 0.04, 0.06));
    d.load.friction_torque = 0.1;
    const lostmotion::TrainRun run(train_of(d));
    const auto& names = test::quantity_names;
    for (int q = 0; q < test::n_quantities; ++q)
        CHECK(run.channels()[test::channel_number(run.channels(), static_cast<test::Quantity>(q))].name == names[q]);
    CHECK(state_names(run.assembly()) == std::vector<std::string>(names.begin(), names.begin() + test::n_states));
    const std::vector<PowerFlow> flows = all_flows(run.assembly());
    REQUIRE(flows.size() == test::flows.size());
    for (std::size_t k = 0; k < flows.size(); ++k) CHECK(flows[k].name == test::flows[k]);
}

TEST_CASE("the rated sizes of the states of a drive are those of its data") {
    test::RandomDrives drives(4);
    for (int n = 0; n < cases(200); ++n) {
        const test::Drive d = drives.drive();
        test::State rated{};
        rated_scale(Assembly(train_of(d)), rated);
        for (int k = 0; k < test::n_coupled; ++k) CHECK(rated[k] == d.rated_scale()[k]);
    }
}

TEST_CASE("an accumulation of switchings is reported with its contact or law, if either is known") {
    const Assembly a(test::train_of(test::paper_drive(plane_map(0.02, 0.04, 0.06))));
    const auto names = branch_names(a);
    REQUIRE(!names.empty());
    const auto text = [&a](int subject) { return train_status_text(a, Status::zeno, 0.5, subject, false); };
    const std::string rest =
        "accumulate at t = 0.500000 s: infinitely many in finite time. Damping there, such as viscous_friction or "
        "mesh_damping, ends it.";
    const std::string motor = a.train().shafts[0].name, load = a.train().shafts[1].name;
    CHECK(text(0) == "switching instants of the contact '" + contact_name(a, 0) + "' of shaft '" + motor + "' " + rest);
    const int twist = a.places().gears[0].contact;
    CHECK(text(twist) == "switching instants of the contact '" + contact_name(a, twist) + "' of the shafts '" + motor +
                             "' and '" + load + "' " + rest);
    CHECK(text(-2) == "switching instants of the law '" + names[0] + "' " + rest);
    CHECK(text(-1) == "switching instants " + rest);
    SparseRegime::Guard guard;
    CHECK(guard.subject() == -1);
    guard.branch = 3;
    CHECK(guard.subject() == -2 - 3);
    guard.contact = 1;
    CHECK(guard.subject() == 1);
}

TEST_CASE("what is wrong with a train is said in one line with the names of its elements") {
    Train good;
    good.shafts.resize(3);
    const char* names[] = {"motor", "worm", "table"};
    for (int s = 0; s < 3; ++s) {
        good.shafts[s].name = names[s];
        good.shafts[s].inertia = 1.0;
    }
    good.motors.push_back({"m1", 0, Motor{}});
    good.gears.resize(2);
    good.gears[0].name = "belt";
    good.gears[0].output = 1;
    good.gears[0].law.ratio = 2.0;
    good.gears[1].name = "mesh";
    good.gears[1].input = 1;
    good.gears[1].output = 2;
    good.gears[1].law.ratio = 3.0;
    CHECK(check(good).empty());
    const auto with = [&good](auto change) {
        Train t = good;
        change(t);
        return check(t).sentence();
    };
    const auto loop = [](double ratio) {
        return [ratio](Train& t) {
            Gear g;
            g.name = "bypass";
            g.input = 0;
            g.output = 2;
            g.law.ratio = ratio;
            t.gears.push_back(g);
        };
    };
    CHECK(with([](Train& t) { t.gears[1].output = 7; }) ==
          "gear 'mesh' names shaft number 7, which the train does not have");
    CHECK(with([](Train& t) { t.motors[0].shaft = -1; }) ==
          "motor 'm1' names shaft number -1, which the train does not have");
    CHECK(with([](Train& t) { t.gears[1].output = 1; }) ==
          "gear 'mesh' joins shaft 'worm' with itself; give it another output");
    CHECK(with([](Train& t) { t.gears.pop_back(); }) ==
          "shaft 'table' is turned by nothing: no motor, gear or load torque acts on it; join it to the train");
    CHECK(with([](Train& t) {
              t.shafts[2].inertia = 0.0;
              t.gears[1].law.compliance = Gearbox::torsion_curve;
          }) ==
          "shaft 'table' has no inertia, and no damping acts on it in all states of its gears; give it an inertia "
          "(0.0009 kg*m^2 is harmless beside its neighbours), or mesh damping to a gear without backlash");
    CHECK(with([](Train& t) { t.shafts[2].inertia = 0.0; }) == "");
    CHECK(with(loop(5.0)) ==
          "gear 'bypass' closes a loop of rigid gears with another ratio: nothing could turn; give it "
          "a stiffness or leave it out");
    CHECK(with(loop(6.0)) ==
          "gear 'bypass' closes a loop of rigid gears with the same ratio: its torque would not be "
          "determined; give it a stiffness or leave it out");
    CHECK(with([&](Train& t) {
              loop(6.0)(t);
              t.gears[2].law.compliance = Gearbox::torsion_curve;
          }) == "");
    CHECK(with([](Train& t) { t.gears[0].law.ratio = 0.0; }).starts_with("gear 'belt' has the ratio 0"));
    CHECK(check(Train{}).sentence() == "the train has no shaft");
}

TEST_CASE("a regime in a kernel's places has the coefficients of the layout, and zeros elsewhere") {
    RandomTrains random(31);
    for (int n = 0; n < cases(100); ++n) {
        const Assembly a(random.train(random.pick(2, 6), true));
        const Layout& at = a.layout();
        REQUIRE(sizes_of<WidestTest>.hold(a.train(), at));
        Key key;
        for (int c = 0; c < at.contacts; ++c)
            key.modes[c] = static_cast<std::int8_t>(a.places().contacts[c].bilateral ? 0 : random.pick(-1, 1));
        for (const ContactPlace& c : a.places().contacts)
            if (c.one_way) key.modes[&c - a.places().contacts.data()] = -1;
        const Regime r = a.build(key);
        const auto sparse = SparseRegimes(a).share(key);
        REQUIRE(sparse->guards.size() == r.guards.size());
        Instant x;
        x.reach(at);
        InstantOf<WidestTest> wide{};
        for (int k = 0; k < at.states; ++k)
            x.x[k] = wide.x[static_cast<std::size_t>(state_place<WidestTest>(at, k))] = random.uniform(-1.0, 1.0);
        for (int k = 0; k < at.memory; ++k)
            x.memory[k] = wide.memory[static_cast<std::size_t>(k)] = random.uniform(-1.0, 1.0);
        for (int i = 0; i < at.inputs; ++i)
            x.input[0][i] = wide.input[0][static_cast<std::size_t>(i)] = random.uniform(-1.0, 1.0);
        const auto value = [&](const LinearForm& f) {
            return lostmotion::evaluate<WidestTest>(f, wide.x, wide.memory, wide.input[0]);
        };
        for (int k = 0; k < at.coupled; ++k)
            CHECK(value(sparse->rate[static_cast<std::size_t>(k)]) == doctest::Approx(evaluate(at, r.rate[k], x)));
        for (std::size_t g = 0; g < r.guards.size(); ++g)
            CHECK(value(sparse->guards[g].form) == doctest::Approx(evaluate(at, r.guards[g].form, x)));
    }
}

}  // namespace lostmotion::model

TEST_SUITE_END();
