// A classic drive and the same as a train, compared term by term.
#pragma once

#include <doctest/doctest.h>

#include "train_support.hpp"

namespace lostmotion::model {

struct Twins {
    Drive drive;
    Assembly assembly;
    const Places& p = assembly.places();
    std::array<int, lostmotion::n_terms> term{};  // where each of the classic terms is in the train; -1: nowhere

    explicit Twins(const Drive& d) : drive(d), assembly(train_of(d)) {
        const Layout& n = assembly.layout();
        const int locked = p.gears[0].contact == nowhere ? nowhere : p.contacts[p.gears[0].contact].locked;
        term = {p.motors[0].torque,
                p.shafts[0].speed,
                p.shafts[1].speed,
                p.gears[0].twist,
                n.coupled,
                n.one,
                p.gears[0].hysteresis == nowhere ? nowhere : n.first_memory + p.gears[0].hysteresis,
                locked == nowhere ? nowhere : n.first_memory + locked,
                n.first_input + p.motors[0].command,
                n.first_input + p.shafts[1].load};
    }

    Key key(const RegimeKey& k) const {
        Key out;
        const int contact[3] = {p.shafts[0].contact, p.gears[0].contact, p.shafts[1].contact};
        for (int c = 0; c < 3; ++c)
            if (contact[c] != nowhere) out.modes[contact[c]] = k.modes[c];
        const auto set = [&out](int branch, int value) {
            if (branch != nowhere) out.branch[branch] = static_cast<std::int16_t>(value);
        };
        set(p.motors[0].branch, k.amplifier);
        set(p.gears[0].piece, k.piece);
        set(p.gears[0].cell, k.cell);
        set(p.gears[0].cell_back, k.cell_back);
        return out;
    }

    // Every coefficient the same to the last bit (zeros of either sign are).
    bool same(const LinearForm& a, const Row& b) const {
        std::size_t used = 0;
        for (int k = 0; k < lostmotion::n_terms; ++k) {
            if ((term[k] == nowhere ? 0.0 : b.c[term[k]]) != a.c[k]) return false;
            used += a.c[k] != 0.0;
        }
        for (int k = 0; k < max_columns; ++k) used -= b.c[k] != 0.0;
        return used == 0;
    }

    int compare(const RegimeKey& k) const {
        const lostmotion::Regime a = drive.build(k);
        const Regime b = assembly.build(key(k));
        CHECK(a.solvable == b.solvable);
        if (!a.solvable) return 0;
        CHECK(a.in_data == b.in_data);
        for (int s = 0; s < lostmotion::n_states; ++s) CHECK(same(a.rate[s], b.rate[term[s]]));
        CHECK(same(a.output_torque, b.output_torque[0]));
        CHECK(same(a.input_torque, b.input_torque[0]));
        CHECK(same(a.source_torque, b.motor_torque[0]));
        CHECK(same(a.hysteresis_torque, b.gear_hysteresis[0]));
        if (p.shafts[0].contact != nowhere) CHECK(same(a.input_friction, b.contact_torque[p.shafts[0].contact]));
        if (p.shafts[1].contact != nowhere) CHECK(same(a.load_friction, b.contact_torque[p.shafts[1].contact]));
        REQUIRE(a.n_guards == static_cast<int>(b.guards.size()));
        for (int g = 0; g < a.n_guards; ++g) {
            CHECK(same(a.guards[g].form, b.guards[g].form));
            CHECK(a.guards[g].neighbour == b.guards[g].neighbour);
            CHECK(a.guards[g].by_grazing == b.guards[g].by_grazing);
        }
        const int contact[3] = {p.shafts[0].contact, p.gears[0].contact, p.shafts[1].contact};
        for (int c = 0; c < 3; ++c)
            if (contact[c] != nowhere) CHECK(a.at_rest[c] == b.at_rest[contact[c]]);
        return 1;
    }
};

}  // namespace lostmotion::model
