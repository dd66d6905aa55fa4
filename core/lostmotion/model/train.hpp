// A drive train: shafts, and what joins, turns, loads and holds them. Parameters only.
#pragma once

#include <memory>
#include <vector>

#include "../elements/angle_torque.hpp"
#include "../elements/brake.hpp"
#include "../elements/clutch.hpp"
#include "../elements/damper.hpp"
#include "../elements/drag.hpp"
#include "../elements/end_stops.hpp"
#include "../elements/freewheel.hpp"
#include "../elements/ratchet.hpp"
#include "../elements/spring.hpp"
#include "../elements/torque_limiter.hpp"
#include "../parts/gear.hpp"
#include "../parts/linear_controller.hpp"
#include "../parts/mass_matrix.hpp"
#include "../parts/shaft.hpp"
#include "../parts/shaft_motor.hpp"

namespace lostmotion::model {

// What an entry of results that has this name is shown as; empty: it is not shown.
struct Alias {
    std::string name, shown;
};

struct Train {
    // In the order of tables. Entries are shown, too, that have an alias and that the train has nothing of.
    std::vector<Alias> aliases;
    std::vector<Shaft> shafts;
    std::vector<MassMatrix> mass_matrices;
    std::vector<ShaftMotor> motors;
    std::vector<Gear> gears;
    std::vector<LinearController> controllers;
    // What joins two shafts and is no gear.
    std::vector<Clutch> clutches;
    std::vector<Freewheel> freewheels;
    std::vector<Damper> dampers;
    std::vector<TorqueLimiter> torque_limiters;
    std::vector<Ratchet> ratchets;
    // What acts on one shaft.
    std::vector<Brake> brakes;
    std::vector<AngleTorque> angle_torques;
    std::vector<Spring> springs;
    std::vector<EndStops> end_stops;

    // Calls use(table, one of them, elements) for each kind of what acts on one shaft, in the order of the equations.
    template <class Self, class Use>
    static void each_kind(Self& train, Use&& use) {
        use("brakes", "brake", train.brakes);
        use("angle_torques", "angle torque", train.angle_torques);
        use("springs", "spring", train.springs);
        use("end_stops", "end stops", train.end_stops);
    }
    // The same for each kind of what joins two shafts.
    template <class Self, class Use>
    static void each_coupling_kind(Self& train, Use&& use) {
        use("clutches", "clutch", train.clutches);
        use("freewheels", "freewheel", train.freewheels);
        use("dampers", "damper", train.dampers);
        use("torque_limiters", "torque limiter", train.torque_limiters);
        use("ratchets", "ratchet", train.ratchets);
    }
};

using ShaftElements = std::vector<std::unique_ptr<ShaftElement>>;
using CouplingElements = std::vector<std::unique_ptr<CouplingElement>>;

ShaftElements shaft_elements(const Train& train);

CouplingElements coupling_elements(const Train& train);

}  // namespace lostmotion::model
