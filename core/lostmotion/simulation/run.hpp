// A whole run of a drive, recorded: samples, switchings and energy ledger.
#pragma once

#include <vector>

#include "channels.hpp"
#include "drive_control.hpp"
#include "energy.hpp"
#include "workspace.hpp"

namespace lostmotion {

using Start = StartOf<DriveDims>;

struct RunOptions : RunRequest {
    std::span<const int> channels = all_channels;
};

struct RunReport {
    Status status = Status::done;
    double time = 0.0;                // [s] reached
    Contact contact = input_contact;  // at the last switching
    State x{};
    Memory memory;
    std::vector<Switching> switchings;
    std::size_t switching_count = 0;
    EnergyLedger energy;
    double left_data_at = 0.0;  // [s], infinity if never
    long steps = 0;             // event checks of the exact solver, steps of the adaptive one
};

// These are compiled once, by core/kernels/drive.cpp.

// By the exact solver. out: channels x samples, channel by channel.
RunReport run_exact(Workspace& workspace, const Signals& signals, const Start& start, const RunOptions& options,
                    double* out);
RunReport run_exact(const Drive& drive, const Signals& signals, const Start& start, const RunOptions& options,
                    double* out);
// By the adaptive solver.
RunReport run_adaptive(const Drive& drive, const Signals& signals, const Start& start, const RunOptions& options,
                       double relative_tolerance, double* out);

// A drive at one instant.
struct DrivePoint {
    Status status = Status::done;  // of the run there
    double time = 0.0;             // [s] reached
    Contact contact = input_contact;
    Regime regime;
    State x{};
    Memory memory;
    InputsOf<DriveDims> input{};
};
// By the exact solver to the end of a run, without a record.
DrivePoint reach(const Drive& drive, const Signals& signals, const Start& start, const RunRequest& request);

}  // namespace lostmotion
