// The equations that the elements of a train compose, against the classic drive's and closed forms.
#include <doctest/doctest.h>

#include "round_drives.hpp"
#include "train_twins.hpp"

TEST_SUITE_BEGIN("train");

namespace lostmotion::model {
namespace {

// All combinations of modes, with pieces and cells drawn at random.
template <class Random>
int compare_all(const Drive& d, Random& random) {
    const Twins twins(d);
    const auto pick = [&random](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
    int compared = 0;
    std::array<std::vector<std::int8_t>, 3> modes;
    for (int c = 0; c < 3; ++c) {
        const auto contact = static_cast<Contact>(c);
        if (!d.has(contact))
            modes[c] = {absent};
        else if (contact == twist_contact && d.rigid())
            modes[c] = {0};
        else
            modes[c] = {0, 1, -1};
    }
    for (const auto a : modes[0])
        for (const auto b : modes[1])
            for (const auto c : modes[2]) {
                RegimeKey k;
                k.modes = {a, b, c};
                if (d.motor.limits_voltage()) k.amplifier = static_cast<std::int8_t>(pick(-1, 1));
                if (!d.rigid()) {
                    const int n = d.gearbox.curve.outermost_piece();
                    k.piece = static_cast<std::int16_t>(pick(-n, n));
                }
                if (d.gearbox.losses == Gearbox::loss_map) {
                    const LossMap& map = d.gearbox.map;
                    k.cell = a == 0 ? pick(0, map.load_intervals() - 1) : pick(0, map.triangles() - 1);
                    k.cell_back = a == 0 ? pick(0, map.load_intervals() - 1) : 0;
                }
                compared += twins.compare(k);
            }
    return compared;
}

}  // namespace

TEST_CASE("the classic drive as a train has the same equations and guards, to the last bit") {
    std::mt19937_64 random(1);
    RandomDrives drives(2);
    RoundDrives round(3);
    int compared = 0;
    for (int n = 0; n < 300; ++n) compared += compare_all(drives.drive(), random);
    for (int n = 0; n < 300; ++n) compared += compare_all(round.next(1.0).drive, random);
    CHECK(compared > 3000);
}

}  // namespace lostmotion::model

TEST_SUITE_END();
