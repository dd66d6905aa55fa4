#include "train_stepping.hpp"

#include <algorithm>

namespace lostmotion {

std::optional<LoadShaft> TrainSimulation::load_shaft(int shaft) const {
    const model::Assembly& a = assembly();
    const model::ShaftPlace& place = a.places().shafts[static_cast<std::size_t>(shaft)];
    if (place.load == model::nowhere) return {};
    for (const model::MassMatrix& m : a.train().mass_matrices)
        if (std::ranges::find(m.shafts, shaft) != m.shafts.end()) return {};
    return LoadShaft{place.speed, place.load, a.train().shafts[static_cast<std::size_t>(shaft)].inertia};
}

bool TrainSimulation::restore(const MotionState& from) {
    motion_->save(scratch_);
    const auto alike = [](const auto& a, const auto& b) { return a.size() == b.size(); };
    const MotionState& own = scratch_;
    if (!(alike(from.x, own.x) && alike(from.memory, own.memory) && alike(from.input, own.input) &&
          alike(from.rate, own.rate) && alike(from.rate_input, own.rate_input) && alike(from.twists, own.twists) &&
          (from.control.slots.empty() || from.control.slots.size() == motion_->control_slots())))
        return false;
    motion_->restore(from);
    return true;
}

std::string TrainSimulation::reset(const TrainStart& start) {
    auto [x, memory] = run_.in_layout(start);
    if (std::string error = check_start(assembly(), x); !error.empty()) return error;
    scratch_.clear();
    scratch_.x = std::move(x);
    scratch_.memory = std::move(memory);
    motion_->restore(scratch_);
    return "";
}

}  // namespace lostmotion
