// The core's elementary functions over arrays, for what Python derives from a scenario before the core sees it.
#pragma once

#include <nanobind/nanobind.h>

namespace lostmotion::binding {

void bind_elementary(nanobind::module_& m);

}  // namespace lostmotion::binding
