// What is said of a run that has no continuation.
#pragma once

#include <string>

#include "../base/status.hpp"

namespace lostmotion {

inline constexpr int input_changed = -1;
inline constexpr const char* input_changed_name = "input changed";

// Why a run has no continuation; empty if it has come to its end.
// subject: the contact or law of the last switching, if it is known.
std::string status_text(Status status, double time, const std::string& subject);
}  // namespace lostmotion
