// The search for the modes of a train, whole.
#pragma once

#include "modes_impact.hpp"
#include "modes_path.hpp"
#include "modes_search.hpp"
#include "modes_settle.hpp"
