// The variables that an FMU declares, by their value references. src/lostmotion/portable/fmu_variables.py has the same.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <vector>

#include "../c/lostmotion.h"
#include "lostmotion/scenario/checksum.hpp"
#include "resources.hpp"

namespace lostmotion::fmu {

// The first of each kind, counted on in the order of the resource names.txt, or of the description's parameters.
enum Reference : unsigned {
    time_reference = 0,
    first_input = 1000,
    first_input_rate = 2000,
    first_output = 3000,
    first_state = 5000,
    first_derivative = 6000,
    first_guard = 7000,
    first_parameter = 1000000
};

struct Variables {
    static constexpr std::size_t max_indicators = first_parameter - first_guard;

    std::string identifier;                    // by which modelDescription.xml and resources know each other
    std::size_t indicators = 0;                // how many are declared
    bool references_given = false;             // are those of sampled controllers inputs?
    std::vector<std::size_t> inputs, outputs;  // by their numbers in the simulation
    std::vector<std::size_t> states;           // the same
    std::vector<double> nominals;              // of the states
    std::vector<std::string> input_names, output_names, state_names;
    // A shaft whose position is an input as well, behind all others: numbers of its three inputs, and of its position
    // among the variables.
    struct Motion {
        std::string shaft;
        std::size_t position, speed, acceleration, variable;
    };
    std::vector<Motion> motions;

    // Lines: the identifier, "references" if these are given, then "indicators N", "input NAME", "motion SHAFT
    // POSITION" with the variable of that name, "output NAME" or "state NAME N", where 10^N is its nominal value (an
    // integer, since the decimal point depends on the locale), at last "checksum N" of all lines before. Returns what
    // is wrong, or nothing.
    std::string read(const std::string& path) {
        std::string text = text_of_file(path);
        if (text.empty()) return path + " cannot be read";
        const std::size_t last = text.rfind("checksum ");
        const std::string told = last == std::string::npos ? "" : text.substr(last);
        if (last != std::string::npos) text.resize(last);
        Checksum sum;
        sum.add(text);
        if (told != "checksum " + std::to_string(sum.value()) + "\n") return path + " is damaged; export the FMU anew";
        std::size_t at = 0;
        const auto word = [&](char end) {
            const std::size_t to = std::min(text.find(end, at), text.size());
            const std::string found = text.substr(at, to - at);
            at = std::min(to + 1, text.size());
            return found;
        };
        identifier = word('\n');
        while (at < text.size()) {
            if (text.compare(at, 11, "references\n") == 0) {
                references_given = true;
                at += 11;
                continue;
            }
            const std::string kind = word(' ');
            if (kind == "input") {
                input_names.push_back(word('\n'));
            } else if (kind == "motion") {
                motions.push_back({word(' '), 0, 0, 0, 0});
                position_names.push_back(word('\n'));
            } else if (kind == "indicators") {
                const std::string count = word('\n');
                indicators = static_cast<std::size_t>(std::strtoul(count.c_str(), nullptr, 10));
                if (indicators > max_indicators) return path + ": there cannot be " + count + " indicators";
            } else if (kind == "output") {
                output_names.push_back(word('\n'));
            } else if (kind == "state") {
                state_names.push_back(word(' '));
                const long power = std::strtol(word('\n').c_str(), nullptr, 10);
                double nominal = 1.0;
                for (long k = 0; k < std::min(std::labs(power), 300L); ++k) nominal *= power < 0 ? 0.1 : 10.0;
                nominals.push_back(nominal);
            } else {
                return path + ": '" + kind + "' is no kind of variable";
            }
        }
        return {};
    }
    // Finds them in a simulation.
    std::string find(const lm_simulation* s, const std::string& path) {
        const auto places = [&](const std::vector<std::string>& names, lm_kind kind, std::vector<std::size_t>& to) {
            to.clear();
            const std::size_t n = lm_count(s, kind);
            for (const std::string& name : names) {
                std::size_t k = 0;
                while (k < n && name != lm_name(s, kind, k)) ++k;
                if (k == n) return path + ": there is no '" + name + "'";
                to.push_back(k);
            }
            return std::string();
        };
        std::string wrong = places(input_names, LM_INPUTS, inputs);
        if (wrong.empty()) wrong = places(output_names, LM_VARIABLES, outputs);
        std::vector<std::size_t> positions;
        if (wrong.empty()) wrong = places(position_names, LM_VARIABLES, positions);
        for (std::size_t k = 0; wrong.empty() && k < motions.size(); ++k) {
            std::vector<std::size_t> two;
            wrong =
                places({motions[k].shaft + "_given_speed", motions[k].shaft + "_given_acceleration"}, LM_INPUTS, two);
            if (!wrong.empty()) break;
            const std::size_t position = lm_count(s, LM_INPUTS) + k;
            motions[k] = {motions[k].shaft, position, two[0], two[1], positions[k]};
            inputs.push_back(position);
        }
        return wrong.empty() ? places(state_names, LM_STATES, states) : wrong;
    }

    // The motion that an input belongs to, or nullptr.
    const Motion* motion_of(std::size_t input) const {
        for (const Motion& m : motions)
            if (input == m.position || input == m.speed || input == m.acceleration) return &m;
        return nullptr;
    }

    // The place of a reference in a list that begins with `first`, or nullptr.
    static const std::size_t* in(const std::vector<std::size_t>& list, unsigned first, unsigned reference) {
        return reference >= first && reference - first < list.size() ? &list[reference - first] : nullptr;
    }
    const std::size_t* input(unsigned r) const { return in(inputs, first_input, r); }
    const std::size_t* input_rate(unsigned r) const { return in(inputs, first_input_rate, r); }
    const std::size_t* output(unsigned r) const { return in(outputs, first_output, r); }
    const std::size_t* state(unsigned r) const { return in(states, first_state, r); }
    const std::size_t* derivative(unsigned r) const { return in(states, first_derivative, r); }

 private:
    std::vector<std::string> position_names;
};

}  // namespace lostmotion::fmu
