#include "result_names.hpp"

namespace lostmotion {

std::string status_text(Status status, double time, const std::string& subject) {
    const std::string at = "at t = " + std::to_string(time) + " s";
    switch (status) {
        case Status::done: return "";
        case Status::interrupted: return "interrupted";
        case Status::jammed:
            return "no combination of sticking and slipping contacts is consistent " + at +
                   (subject.empty() ? "" : ", at an event of " + subject) +
                   ": the friction jams. Give the gearbox a compliance, or lower its losses.";
        case Status::outside:
            return "the state left the range that can be computed " + at +
                   ": 1000 times the data of a loss map, or what numbers resolve. "
                   "The drive is unstable, or its data or inputs, such as a stiffness, have a wrong unit.";
        case Status::zeno:
            return "switching instants " + (subject.empty() ? "" : "of " + subject + " ") + "accumulate " + at +
                   ": infinitely many in finite time. Damping there, such as viscous_friction or mesh_damping, ends "
                   "it.";
        case Status::controller: return "the controller failed " + at + ", or its command is no finite number";
        case Status::unseen:
            return "the drive has dry contacts, which do not feel a nonlinear torque. Take them out, or make the "
                   "torque piecewise linear.";
    }
    return "";
}

}  // namespace lostmotion
