// What the states, the contacts and the causes of switchings are called, for everything outside the core.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "../drive/contact.hpp"
#include "enum_table.hpp"

namespace lostmotion {

struct StateName {
    Term value;
    const char* name;  // a channel has the same, with unit and meaning
};
inline constexpr std::array<StateName, n_states> state_names{{
    {motor_torque, "motor_torque"},
    {motor_speed, "motor_speed"},
    {load_speed, "load_speed"},
    {twist, "twist"},
    {load_angle, "load_angle"},
}};
static_assert(in_order(state_names));

struct ContactName {
    Contact value;
    const char *name, *text;
};
inline constexpr std::array<ContactName, n_contacts> contact_names{{
    {input_contact, "input_contact", "input shaft"},
    {twist_contact, "twist_contact", "twist of the gear"},
    {load_contact, "load_contact", "load bearing"},
}};
static_assert(in_order(contact_names));

// What ended a regime. The guard that ends the model ends no regime, and an input that jumps is none.
struct Cause {
    Guard::Kind value;
    const char* name;
};
inline constexpr std::array<Cause, Guard::outside> causes{{
    {Guard::speed, "came to rest"},
    {Guard::capacity, "broke away"},
    {Guard::torsion_piece, "torsion piece"},
    {Guard::loss_cell, "loss cell"},
    {Guard::loss_cell_back, "loss cell"},
    {Guard::amplifier, "voltage limit"},
    {Guard::turning, "motor torque turned"},
}};
static_assert(in_order(causes));
inline constexpr int input_changed = -1;
inline constexpr const char* input_changed_name = "input changed";

// A switching as numbers.
struct SwitchingColumn {
    std::string name;
    std::function<double(const Switching&)> value;
};
const std::vector<SwitchingColumn>& switching_columns();

// Why a run has no continuation; empty if it has come to its end.
// subject: the contact or law of the last switching, if it is known.
std::string status_text(Status status, double time, const std::string& subject);

inline std::string status_text(Status status, double time, Contact contact) {
    return status_text(status, time, "the contact '" + std::string(contact_names[contact].text) + "'");
}

}  // namespace lostmotion
