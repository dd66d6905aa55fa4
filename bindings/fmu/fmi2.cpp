// Functions of FMI 2.0. Types and statuses as in the standard, fmi-standard.org, version 2.0.4, chapters 2.1, 3.2 and
// 4.2.
#include <string>

#include "component.hpp"

namespace lostmotion::fmi2 {
namespace {

using Boolean = int;
using Reference = unsigned int;
using Log = void (*)(void* environment, const char* instance, int status, const char* category, const char* message,
                     ...);
struct Callbacks {
    Log log;
    void* (*allocate)(std::size_t, std::size_t);
    void (*release)(void*);
    void (*step_finished)(void*, int);
    void* environment;
};

// A sentence as a format without arguments: not all importers insert these.
std::string as_format(const std::string& sentence) {
    std::string format;
    for (const char c : sentence) format += c == '%' ? "%%" : std::string(1, c);
    return format;
}

struct Logger {
    std::string name;
    Callbacks callbacks;

    void operator()(int status, const char* category, const std::string& sentence) const {
        if (callbacks.log == nullptr) return;
        callbacks.log(callbacks.environment, name.c_str(), status, category, as_format(sentence).c_str());
    }
};
using Component = fmu::Component<Logger>;
using fmu::Instance;
Component& of(void* component) { return *static_cast<Component*>(component); }

// Of fmi2NewDiscreteStates.
struct EventInfo {
    Boolean needed, terminate, nominals_changed, states_changed, next_defined;
    double next;
};

}  // namespace

FMU_API const char* fmi2GetTypesPlatform() { return "default"; }
FMU_API const char* fmi2GetVersion() { return "2.0"; }
FMU_API int fmi2SetDebugLogging(void*, Boolean, std::size_t, const char* const*) { return fmu::ok; }

FMU_API void* fmi2Instantiate(const char* name, int type, const char* guid, const char* resources,
                              const Callbacks* callbacks, Boolean, Boolean) {
    if (callbacks == nullptr || name == nullptr) return nullptr;
    return Component::made({name, *callbacks}, guid, "identifier", resources,
                           type == 0 ? fmu::Kind::model_exchange : fmu::Kind::co_simulation);
}
FMU_API void fmi2FreeInstance(void* c) { delete static_cast<Component*>(c); }

FMU_API int fmi2SetupExperiment(void* c, Boolean, double, double start, Boolean, double) {
    return of(c).call(__func__, fmu::instantiated, [=](Instance& i) { return i.set_start_time(start); });
}
FMU_API int fmi2EnterInitializationMode(void* c) {
    return of(c).enter(__func__, fmu::instantiated, fmu::initialization);
}
FMU_API int fmi2ExitInitializationMode(void* c) {
    return of(c).call(__func__, fmu::initialization, [](Instance& i) { return i.exit_initialization(); });
}
FMU_API int fmi2Terminate(void* c) { return of(c).enter(__func__, fmu::started, fmu::terminated); }
FMU_API int fmi2Reset(void* c) { return of(c).ended(of(c).instance.reset()); }

FMU_API int fmi2GetReal(void* c, const Reference* r, std::size_t n, double* value) {
    return of(c).get_values(__func__, fmu::readable, r, n, value);
}
FMU_API int fmi2SetReal(void* c, const Reference* r, std::size_t n, const double* value) {
    return of(c).set_values(__func__, r, n, value);
}
static int none(void* c, std::size_t n) { return of(c).none(n, "this FMU has variables of type Real alone"); }
FMU_API int fmi2GetInteger(void* c, const Reference*, std::size_t n, int*) { return none(c, n); }
FMU_API int fmi2GetBoolean(void* c, const Reference*, std::size_t n, Boolean*) { return none(c, n); }
FMU_API int fmi2GetString(void* c, const Reference*, std::size_t n, const char**) { return none(c, n); }
FMU_API int fmi2SetInteger(void* c, const Reference*, std::size_t n, const int*) { return none(c, n); }
FMU_API int fmi2SetBoolean(void* c, const Reference*, std::size_t n, const Boolean*) { return none(c, n); }
FMU_API int fmi2SetString(void* c, const Reference*, std::size_t n, const char* const*) { return none(c, n); }

FMU_API int fmi2GetFMUstate(void* c, void** state) { return of(c).get_state(state); }
FMU_API int fmi2SetFMUstate(void* c, void* state) { return of(c).set_state(state); }
FMU_API int fmi2FreeFMUstate(void*, void** state) { return Component::free_state(state); }
FMU_API int fmi2SerializedFMUstateSize(void*, void* state, std::size_t* size) {
    *size = Component::size_of(state);
    return fmu::ok;
}
FMU_API int fmi2SerializeFMUstate(void* c, void* state, char* bytes, std::size_t size) {
    return of(c).serialize(state, bytes, size);
}
FMU_API int fmi2DeSerializeFMUstate(void* c, const char* bytes, std::size_t size, void** state) {
    return of(c).deserialize(bytes, size, state);
}

FMU_API int fmi2GetDirectionalDerivative(void* c, const Reference* unknown, std::size_t n_unknown,
                                         const Reference* known, std::size_t n_known, const double* seed, double* out) {
    return of(c).call(__func__, fmu::readable, [=](Instance& i) {
        return i.directional_derivative(unknown, n_unknown, known, seed, n_known, out);
    });
}
FMU_API int fmi2SetRealInputDerivatives(void* c, const Reference* r, std::size_t n, const int* order,
                                        const double* value) {
    return of(c).call(__func__, fmu::instantiated | fmu::initialization | fmu::between_steps, [=](Instance& i) {
        fmu::Ended e = fmu::ok;
        for (std::size_t k = 0; k < n && e == fmu::ok; ++k) e = i.set_input_rate(r[k], order[k], value[k]);
        return e;
    });
}
FMU_API int fmi2GetRealOutputDerivatives(void* c, const Reference*, std::size_t n, const int*, double*) {
    return of(c).none(n, "derivatives of outputs are not given");
}

FMU_API int fmi2DoStep(void* c, double from, double interval, Boolean) {
    return of(c).call(__func__, fmu::between_steps, [=](Instance& i) { return i.step(from, interval); });
}
FMU_API int fmi2CancelStep(void* c) { return of(c).failed("no step is under way: steps are done when they return"); }
FMU_API int fmi2GetStatus(void*, int, int*) { return fmu::discard; }
FMU_API int fmi2GetRealStatus(void* c, int kind, double* value) {
    if (kind != 2) return fmu::discard;  // the last successful time
    return of(c).ended(of(c).instance.get(fmu::time_reference, *value));
}
FMU_API int fmi2GetIntegerStatus(void*, int, int*) { return fmu::discard; }
FMU_API int fmi2GetBooleanStatus(void*, int kind, Boolean* value) {
    if (kind != 3) return fmu::discard;  // terminated
    *value = 0;
    return fmu::ok;
}
FMU_API int fmi2GetStringStatus(void*, int, const char**) { return fmu::discard; }

// --- Model Exchange ---

FMU_API int fmi2EnterEventMode(void* c) { return of(c).enter(__func__, fmu::event | fmu::continuous, fmu::event); }
FMU_API int fmi2NewDiscreteStates(void* c, EventInfo* info) {
    fmu::Instance::Settled settled;
    const int e = of(c).call(__func__, fmu::event, [&](Instance& i) { return i.settle(settled); });
    *info = {0, 0, 0, settled.states_changed, settled.has_next, settled.next};
    return e;
}
FMU_API int fmi2EnterContinuousTimeMode(void* c) { return of(c).enter(__func__, fmu::event, fmu::continuous); }
FMU_API int fmi2CompletedIntegratorStep(void* c, Boolean, Boolean* enter_event_mode, Boolean* terminate) {
    bool event = false;
    const int e = of(c).call(__func__, fmu::continuous, [&](Instance& i) { return i.accept(event); });
    *enter_event_mode = event;
    *terminate = 0;
    return e;
}
FMU_API int fmi2SetTime(void* c, double time) {
    return of(c).call(__func__, fmu::event | fmu::continuous, [=](Instance& i) { return i.set_time(time); });
}
FMU_API int fmi2SetContinuousStates(void* c, const double* x, std::size_t n) {
    return of(c).call(__func__, fmu::continuous, [=](Instance& i) { return i.set_states(x, n); });
}
FMU_API int fmi2GetContinuousStates(void* c, double* x, std::size_t n) {
    return of(c).call(__func__, fmu::exchanged, [=](Instance& i) { return i.get_states(x, n); });
}
FMU_API int fmi2GetDerivatives(void* c, double* out, std::size_t n) {
    return of(c).call(__func__, fmu::exchanged, [=](Instance& i) { return i.get_derivatives(out, n); });
}
FMU_API int fmi2GetEventIndicators(void* c, double* out, std::size_t n) {
    return of(c).call(__func__, fmu::exchanged, [=](Instance& i) { return i.get_guards(out, n); });
}
FMU_API int fmi2GetNominalsOfContinuousStates(void* c, double* out, std::size_t n) {
    return of(c).get_nominals(__func__, out, n);
}

}  // namespace lostmotion::fmi2
