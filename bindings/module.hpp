// The parts of the module that are compiled on their own.
#pragma once

#include <nanobind/nanobind.h>

namespace lostmotion::binding {

// Many drives at once.
void bind_batches(nanobind::module_& m);
// Parameters of scenario files, as the core describes them, for what Python makes of them.
void bind_described(nanobind::module_& m);
// The elementary functions of the core over arrays, for what Python derives from a scenario before the core sees it.
void bind_elementary(nanobind::module_& m);

}  // namespace lostmotion::binding
