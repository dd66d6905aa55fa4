// What the other handles of the C interface are.
#pragma once

#include <string>
#include <utility>

#include "lostmotion/scenario/simulation.hpp"
#include "train.hpp"

struct lm_scenario {
    int changed(std::string wrong) {
        error = std::move(wrong);
        return error.empty() ? LM_OK : LM_INVALID;
    }

    lostmotion::ScenarioDescription description;
    std::string error;
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
};

// A signal, or what is wrong with it.
std::string read_signal(const lm_signal& from, lostmotion::Signal& to);
