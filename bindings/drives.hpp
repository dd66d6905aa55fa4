// Drives and what acts on them.
#pragma once

#include <map>
#include <mutex>

#include "arrays.hpp"
#include "lostmotion/analysis/explain.hpp"
#include "lostmotion/drive/parameters.hpp"
#include "lostmotion/simulation/workspace.hpp"

namespace lostmotion::binding {

// Workspaces of drives that are gone, for the sake of their memory.
class SpareWorkspaces {
 public:
    std::unique_ptr<Workspace> take(const Drive& drive) {
        std::unique_ptr<Workspace> w;
        {
            const std::lock_guard<std::mutex> hold(mutex_);
            if (!idle_.empty()) {
                w = std::move(idle_.back());
                idle_.pop_back();
            }
        }
        if (w == nullptr) return std::make_unique<Workspace>(drive);
        w->set(drive);
        return w;
    }
    void give_back(std::unique_ptr<Workspace> w) {
        w->cache.forget(max_regimes);
        const std::lock_guard<std::mutex> hold(mutex_);
        if (idle_.size() < max_idle) idle_.push_back(std::move(w));
    }

 private:
    static constexpr std::size_t max_idle = 8, max_regimes = 1000;  // about 100 megabytes in all

    std::mutex mutex_;
    std::vector<std::unique_ptr<Workspace>> idle_;
};

// The one store that the drives of this module share.
inline const std::shared_ptr<SpareWorkspaces>& spare_workspaces() {
    static const auto spare = std::make_shared<SpareWorkspaces>();
    return spare;
}

// A drive and what runs of it have left for the next ones. Each run takes a workspace for itself.
class SharedDrive : public WorkspacePool {
 public:
    const Drive drive;
    explicit SharedDrive(const Drive& d) : drive(d) {}
    ~SharedDrive() override {
        for (std::unique_ptr<Workspace>& w : idle_) spare_->give_back(std::move(w));
    }
    SharedDrive(const SharedDrive&) = delete;
    SharedDrive& operator=(const SharedDrive&) = delete;

    std::unique_ptr<Workspace> take() override {
        {
            const std::lock_guard<std::mutex> hold(mutex_);
            if (!idle_.empty()) {
                std::unique_ptr<Workspace> w = std::move(idle_.back());
                idle_.pop_back();
                return w;
            }
        }
        return spare_->take(drive);
    }
    void give_back(std::unique_ptr<Workspace> w) override {
        const std::lock_guard<std::mutex> hold(mutex_);
        idle_.push_back(std::move(w));
    }

 private:
    std::shared_ptr<SpareWorkspaces> spare_ = spare_workspaces();
    std::mutex mutex_;
    std::vector<std::unique_ptr<Workspace>> idle_;
};

inline Drive make_drive(const std::map<std::string, double>& values, bool torque_source, const TorsionCurve* curve,
                        const LossMap* map) {
    for (const auto& [key, value] : values)
        if (find_parameter(key) == nullptr) throw nb::value_error(("a drive has no parameter " + key).c_str());
    return drive_of(values, torque_source, curve, map);
}

inline void bind_drives(nb::module_& m) {
    using Vector = std::vector<double>;
    nb::class_<TorsionCurve>(m, "TorsionCurve")
        .def(nb::init<Vector, Vector>(), "breaks"_a, "slopes"_a)
        .def("torque", &TorsionCurve::torque, "twist"_a)
        .def("energy", nb::overload_cast<double>(&TorsionCurve::energy, nb::const_), "twist"_a);
    nb::class_<LossMap>(m, "LossMap")
        .def(nb::init<Vector, Vector, Vector>(), "speeds"_a, "loads"_a, "values"_a)
        .def("__call__", &LossMap::operator(), "load"_a, "speed"_a);
    nb::class_<SharedDrive>(m, "Drive")
        .def(
            "__init__",
            [](SharedDrive* self, const std::map<std::string, double>& parameters, bool torque_source,
               const TorsionCurve* curve,
               const LossMap* map) { new (self) SharedDrive(make_drive(parameters, torque_source, curve, map)); },
            "parameters"_a, "torque_source"_a, "torsion_curve"_a.none(), "loss_map"_a.none())
        .def("contact_names",
             [](const SharedDrive& d) {
                 std::vector<std::string> names;
                 for (const ContactName& c : contact_names)
                     if (d.drive.has(c.value)) names.push_back(c.name);
                 return names;
             })
        .def("min_rigid_inertia", [](const SharedDrive& d) { return d.drive.min_rigid_inertia(); })
        .def(
            "smallest_command",
            [](const SharedDrive& d, double T_2, double M_Z, int s) { return smallest_command(d.drive, T_2, M_Z, s); },
            "output_torque"_a, "load_torque"_a, "direction"_a);
    nb::class_<Signal>(m, "Signal")
        .def(
            "__init__",
            [](Signal* self, const std::vector<std::array<double, 3>>& breakpoints,
               const std::vector<std::array<double, 3>>& sines) { new (self) Signal(signal_of(breakpoints, sines)); },
            "breakpoints"_a, "sines"_a);
}

}  // namespace lostmotion::binding
