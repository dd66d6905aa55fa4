// Exact solver: propagation by matrix exponentials; only switching instants are searched, and none is missed.
#pragma once

#include "exact_course.hpp"
#include "exact_event_check.hpp"
#include "exact_roots.hpp"
