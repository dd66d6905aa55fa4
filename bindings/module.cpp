// Thin binding: the core as a Python module.
#include "module.hpp"

#include "descriptions.hpp"
#include "joint_trains.hpp"
#include "names.hpp"
#include "responses.hpp"
#include "sensitivities.hpp"
#include "stepping.hpp"

using namespace lostmotion::binding;

NB_MODULE(CORE_MODULE, m) {
    bind_interruption(m);
    bind_names(m);
    bind_elementary(m);
    bind_curves(m);
    bind_described(m);
    bind_control(m);
    bind_train(m);
    bind_sensitivities(m);
    bind_instants(m);
    bind_stepping(m);
    bind_joint_trains(m);
    bind_batches(m);
    bind_responses(m);
    bind_descriptions(m);
}
