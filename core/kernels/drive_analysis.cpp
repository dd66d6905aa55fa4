// Periodic motions and responses of drives.
#include "lostmotion/analysis/drive_response.hpp"

namespace lostmotion {

ResponseTable respond_drive(WorkspacePool& drive, const std::vector<ResponseRequest>& points, const ResponseSpec& spec,
                            unsigned threads, const Waiting& waiting) {
    DrivePlant plant(drive);
    const auto start = [&](const Named& named) {
        Start s;
        for (const NamedComponent& c : plant.components()) {
            const auto given = named.find(c.name);
            if (given == named.end()) continue;
            if (c.place < n_states)
                s.x[c.place] = given->second;
            else if (c.place == hysteresis_component)
                s.memory.hysteresis_capacity = given->second;
            else
                s.memory.locked_torque = given->second;
        }
        return s;
    };
    return respond_by_name(plant, points, start, spec, threads, waiting);
}

}  // namespace lostmotion
