// Parameters of scenario files, as the core describes them, for what Python makes of them.
#pragma once

#include <nanobind/nanobind.h>

namespace lostmotion::binding {

void bind_described(nanobind::module_& m);

}  // namespace lostmotion::binding
