// Names of what a train consists of, for results, messages and explanations.
#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "assembly.hpp"

namespace lostmotion::model {

// What is an angle of a shaft is a position of a slide, and so on: the names and units of both domains.
bool is_slide(const Train& t, int shaft);
const char* angle_unit(const Train& t, int shaft);
const char* speed_unit(const Train& t, int shaft);
const char* angle_meaning(const Train& t, int shaft);
const char* torque_unit(const Train& t, int shaft);
const char* torque_word(const Train& t, int shaft);                // "torque" or "force"
std::string law_text(const Train& t, int shaft, std::string law);  // "torque over angle" or "force over position"
// NAME_WHAT of an element. Of what is on a slide an angle is a position, a twist a deflection, a torque a force.
std::string result_name(const std::string& element, std::string what, bool slide);
std::string angle_of(const Train& t, std::size_t shaft);
std::string motor_torque_of(const Train& t, std::size_t motor);
std::string phase_current_of(const Train& t, std::size_t motor, int phase);  // of a stepper with a winding
std::string twist_of(const Train& t, std::size_t gear);
const char* twist_meaning(const Train& t, std::size_t gear);

// The name under which an entry of results is shown; empty: it is not.
std::string shown_name(const Train& t, const std::string& name);
bool has_alias(const Train& t, const std::string& name);
// Of an entry by the name under which it is shown; those without an alias are the last.
std::size_t place_in_tables(const Train& t, const std::string& shown);
template <class Entries, class Name>
void as_in_tables(const Train& t, Entries& entries, Name name) {
    if (!t.aliases.empty())
        std::ranges::stable_sort(entries, {}, [&](const auto& e) { return place_in_tables(t, std::invoke(name, e)); });
}

std::string gear_name(const Train& t, std::size_t gear, const char* what);
// The same as it is shown.
std::string gear_result(const Train& t, std::size_t gear, const char* what);
std::string command_of(const Train& t, std::size_t motor);
std::string load_torque_of(const Train& t, std::size_t shaft);

// Of the coupled states, then the angles.
std::vector<std::string> state_names(const Assembly& a);

// Which of the states the train moves: a torque source and a rigid gear may have a place in the kernel, but no state,
// and the angle of a shaft that something depends on is a coupled state.
std::vector<bool> moved_states(const Assembly& a);

std::vector<std::string> input_names(const Assembly& a);

std::string contact_name(const Assembly& a, int contact);
// The shaft in whose domain its torque is.
int contact_shaft(const Assembly& a, int contact);
// The contacts, and those that have an alias although the train does not have them, in the order of tables.
struct ShownContact {
    int contact;  // or nowhere
    ContactPlace::Kind kind;
    int element;
    std::string name;
};
std::vector<ShownContact> shown_contacts(const Assembly& a);

// The piecewise laws, by their place in a key.
std::vector<std::string> branch_names(const Assembly& a);

}  // namespace lostmotion::model
