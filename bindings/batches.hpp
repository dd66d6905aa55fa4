// Many drives at once.
#pragma once

#include <nanobind/nanobind.h>

namespace lostmotion::binding {

void bind_batches(nanobind::module_& m);

}  // namespace lostmotion::binding
