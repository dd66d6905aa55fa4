// What runs of a drive leave for the next ones: the regimes that they have visited, with their propagators.
#pragma once

#include <memory>

#include "../drive/contact.hpp"
#include "../solver/exact_solver.hpp"

namespace lostmotion {

// A drive with the regimes that runs have visited so far, for the next run. One run at a time.
struct Workspace {
    explicit Workspace(const Drive& d) : drive(d) {}
    Workspace(const Workspace&) = delete;
    Workspace& operator=(const Workspace&) = delete;

    // Another drive; the memory stays.
    void set(const Drive& d) {
        drive = d;
        system.drive_changed();
        cache.forget();
    }

    State balanced_scale() const { return drive.balanced_scale(); }

    Drive drive;
    SwitchedDrive system{drive};
    RegimeCache<SwitchedDrive> cache{system};
};

// Idle workspaces; each thread takes one.
struct WorkspacePool {
    virtual ~WorkspacePool() = default;
    virtual std::unique_ptr<Workspace> take() = 0;
    virtual void give_back(std::unique_ptr<Workspace>) = 0;
};

}  // namespace lostmotion
