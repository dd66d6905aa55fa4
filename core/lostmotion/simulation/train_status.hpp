// What ended a run of a train, in words.
#pragma once

#include <string>

#include "../model/names.hpp"
#include "result_names.hpp"

namespace lostmotion {

// Why a run of a train has no continuation; empty if it has come to its end.
std::string train_status_text(const model::Assembly& a, Status status, double time, int contact, bool too_many_guards);

}  // namespace lostmotion
