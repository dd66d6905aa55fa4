// What the other handles of the C interface are.
#pragma once

#include <string>
#include <utility>

#include "lostmotion/scenario/simulation.hpp"
#include "train.hpp"

// What the caller asks to end a run; it goes to the core as a function that returns bool.
struct Asked {
    int (*function)(void*) = nullptr;
    void* context = nullptr;

    static bool ask(void* asked) {
        const auto* a = static_cast<const Asked*>(asked);
        return a->function != nullptr && a->function(a->context) != 0;
    }
};

struct lm_scenario {
    int changed(std::string wrong) {
        error = std::move(wrong);
        return error.empty() ? LM_OK : LM_INVALID;
    }

    lostmotion::ScenarioDescription description;
    std::string error;
    Asked asked;
};

struct lm_simulation {
    template <class Of>
    lm_simulation(const Of& of, double step) : simulation(of, step) {}

    int failed(std::string sentence, int status = LM_INVALID) {
        error = std::move(sentence);
        return status;
    }
    int ended(lostmotion::Status status) {
        if (status == lostmotion::Status::done) return LM_OK;
        return failed(simulation.text(status), static_cast<int>(status));
    }

    lostmotion::ScenarioSimulation simulation;
    std::string error;
    Asked asked;
};

struct lm_snapshot {
    lostmotion::MotionState of;
};

// A signal, or what is wrong with it.
std::string read_signal(const lm_signal& from, lostmotion::Signal& to);
