// Periodic motions and responses of the drive.
#pragma once

#include "../drive/components.hpp"
#include "../simulation/result_names.hpp"
#include "../simulation/run.hpp"
#include "../simulation/sampler.hpp"
#include "../simulation/stepping.hpp"
#include "response.hpp"

namespace lostmotion {

using Shooting = ShootingOf<SwitchedDrive>;
using PeriodicMotion = PeriodicMotionOf<SwitchedDrive>;
using ResponsePoint = ResponsePointOf<SwitchedDrive>;
using ResponseResult = ResponseResultOf<SwitchedDrive>;

class DrivePlant {
 public:
    using System = SwitchedDrive;
    using Workspace = lostmotion::Workspace;

    explicit DrivePlant(WorkspacePool& pool) : pool_(pool) {}

    std::size_t channels() const { return n_channels; }
    const PowerChannels& powers() const { return powers_; }
    Sampler sampler(Workspace& workspace, double interval, std::size_t count, double* out) const {
        return {workspace.drive, 0.0, interval, count, out};
    }
    bool spoiled(const Workspace&) const { return false; }
    std::vector<NamedComponent> components() const {
        std::vector<NamedComponent> all;
        for (int k = 0; k < n_states; ++k)
            all.push_back({state_names[static_cast<std::size_t>(k)].name, k, k == load_angle});
        all.push_back({"hysteresis_capacity", hysteresis_component, false});
        all.push_back({"locked_torque", locked_component, false});
        return all;
    }
    std::string error(const ResponseResult& r) const {
        return status_text(r.motion.status, r.motion.time, r.motion.contact);
    }
    std::unique_ptr<Workspace> take() { return pool_.take(); }
    void give_back(std::unique_ptr<Workspace> w) { pool_.give_back(std::move(w)); }

 private:
    WorkspacePool& pool_;
    const PowerChannels powers_{{{ch_motor_torque, ch_motor_speed}},
                                {{{ch_input_torque, ch_motor_speed}, {ch_output_torque, ch_load_speed}, true}}};
};

}  // namespace lostmotion
