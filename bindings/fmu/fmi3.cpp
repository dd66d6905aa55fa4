// Functions of FMI 3.0 for Co-Simulation and Model Exchange. Types and statuses as in the standard, fmi-standard.org,
// version 3.0.1, chapter 2.2 and after.
#include <cstdint>
#include <string>

#include "component.hpp"

namespace lostmotion::fmi3 {
namespace {

using Reference = unsigned int;
using Log = void (*)(void* environment, int status, const char* category, const char* message);

struct Logger {
    Log log;
    void* environment;

    void operator()(int status, const char* category, const std::string& sentence) const {
        if (log != nullptr) log(environment, status, category, sentence.c_str());
    }
};
using Component = fmu::Component<Logger>;
using fmu::Instance;
Component& of(void* component) { return *static_cast<Component*>(component); }

void* instantiate(const char* token, const char* resources, void* environment, Log log, fmu::Kind kind) {
    return Component::made({log, environment}, token, "token", resources, kind);
}

}  // namespace

FMU_API const char* fmi3GetVersion() { return "3.0"; }
FMU_API int fmi3SetDebugLogging(void*, bool, std::size_t, const char* const*) { return fmu::ok; }

FMU_API void* fmi3InstantiateModelExchange(const char*, const char* token, const char* resources, bool, bool,
                                           void* environment, Log log) {
    return instantiate(token, resources, environment, log, fmu::Kind::model_exchange);
}
FMU_API void* fmi3InstantiateCoSimulation(const char*, const char* token, const char* resources, bool, bool, bool, bool,
                                          const Reference*, std::size_t, void* environment, Log log, void*) {
    return instantiate(token, resources, environment, log, fmu::Kind::co_simulation);
}
FMU_API void* fmi3InstantiateScheduledExecution(const char*, const char*, const char*, bool, bool, void* environment,
                                                Log log, void*, void*, void*) {
    if (log != nullptr)
        log(environment, fmu::error, "logStatusError", "this FMU is for Co-Simulation and Model Exchange");
    return nullptr;
}
FMU_API void fmi3FreeInstance(void* c) { delete static_cast<Component*>(c); }

FMU_API int fmi3EnterInitializationMode(void* c, bool, double, double start, bool, double) {
    return of(c).call(__func__, fmu::instantiated, [=](Instance& i) {
        const fmu::Ended e = i.set_start_time(start);
        return e == fmu::ok ? i.enter(fmu::initialization) : e;
    });
}
FMU_API int fmi3ExitInitializationMode(void* c) {
    return of(c).call(__func__, fmu::initialization, [](Instance& i) { return i.exit_initialization(); });
}
FMU_API int fmi3EnterEventMode(void* c) { return of(c).enter(__func__, fmu::event | fmu::continuous, fmu::event); }
FMU_API int fmi3EnterStepMode(void* c) { return of(c).failed("this FMU has no event mode in Co-Simulation"); }
FMU_API int fmi3EnterConfigurationMode(void* c) { return of(c).failed("this FMU has no structural parameters"); }
FMU_API int fmi3ExitConfigurationMode(void* c) { return of(c).failed("this FMU has no structural parameters"); }
FMU_API int fmi3Terminate(void* c) { return of(c).enter(__func__, fmu::started, fmu::terminated); }
FMU_API int fmi3Reset(void* c) { return of(c).ended(of(c).instance.reset()); }

FMU_API int fmi3GetFloat64(void* c, const Reference* r, std::size_t n, double* value, std::size_t n_values) {
    return n == n_values ? of(c).get_values(__func__, fmu::instantiated | fmu::readable, r, n, value)
                         : of(c).failed("each variable has one value");
}
FMU_API int fmi3SetFloat64(void* c, const Reference* r, std::size_t n, const double* value, std::size_t n_values) {
    return n == n_values ? of(c).set_values(__func__, r, n, value) : of(c).failed("each variable has one value");
}
static int none(void* c, std::size_t n) { return of(c).none(n, "this FMU has variables of type Float64 alone"); }
#define NONE(NAME, ...) \
    FMU_API int fmi3##NAME(void* c, const Reference*, std::size_t n, __VA_ARGS__) { return none(c, n); }
#define OTHER_TYPE(NAME, TYPE)          \
    NONE(Get##NAME, TYPE*, std::size_t) \
    NONE(Set##NAME, const TYPE*, std::size_t)
OTHER_TYPE(Float32, float)
OTHER_TYPE(Int8, std::int8_t)
OTHER_TYPE(UInt8, std::uint8_t)
OTHER_TYPE(Int16, std::int16_t)
OTHER_TYPE(UInt16, std::uint16_t)
OTHER_TYPE(Int32, std::int32_t)
OTHER_TYPE(UInt32, std::uint32_t)
OTHER_TYPE(Int64, std::int64_t)
OTHER_TYPE(UInt64, std::uint64_t)
OTHER_TYPE(Boolean, bool)
NONE(GetString, const char**, std::size_t)
NONE(SetString, const char* const*, std::size_t)
NONE(GetBinary, std::size_t*, const std::uint8_t**, std::size_t)
NONE(SetBinary, const std::size_t*, const std::uint8_t* const*, std::size_t)
NONE(GetClock, bool*)
NONE(SetClock, const bool*)
NONE(GetIntervalDecimal, double*, int*)
NONE(GetIntervalFraction, std::uint64_t*, std::uint64_t*, int*)
NONE(GetShiftDecimal, double*)
NONE(GetShiftFraction, std::uint64_t*, std::uint64_t*)
NONE(SetIntervalDecimal, const double*)
NONE(SetIntervalFraction, const std::uint64_t*, const std::uint64_t*)
NONE(SetShiftDecimal, const double*)
NONE(SetShiftFraction, const std::uint64_t*, const std::uint64_t*)
#undef OTHER_TYPE
#undef NONE
FMU_API int fmi3ActivateModelPartition(void* c, Reference, double) { return of(c).failed("this FMU has no clocks"); }
FMU_API int fmi3GetNumberOfVariableDependencies(void* c, Reference, std::size_t*) {
    return of(c).failed("dependencies are those of modelDescription.xml");
}
FMU_API int fmi3GetVariableDependencies(void* c, Reference, std::size_t*, Reference*, std::size_t*, int*, std::size_t) {
    return of(c).failed("dependencies are those of modelDescription.xml");
}

FMU_API int fmi3GetFMUState(void* c, void** state) { return of(c).get_state(state); }
FMU_API int fmi3SetFMUState(void* c, void* state) { return of(c).set_state(state); }
FMU_API int fmi3FreeFMUState(void*, void** state) { return Component::free_state(state); }
FMU_API int fmi3SerializedFMUStateSize(void*, void* state, std::size_t* size) {
    *size = Component::size_of(state);
    return fmu::ok;
}
FMU_API int fmi3SerializeFMUState(void* c, void* state, std::uint8_t* bytes, std::size_t size) {
    return of(c).serialize(state, bytes, size);
}
FMU_API int fmi3DeserializeFMUState(void* c, const std::uint8_t* bytes, std::size_t size, void** state) {
    return of(c).deserialize(bytes, size, state);
}

FMU_API int fmi3GetDirectionalDerivative(void* c, const Reference* unknown, std::size_t n_unknown,
                                         const Reference* known, std::size_t n_known, const double* seed, std::size_t,
                                         double* out, std::size_t) {
    return of(c).call(__func__, fmu::readable, [=](Instance& i) {
        return i.directional_derivative(unknown, n_unknown, known, seed, n_known, out);
    });
}
FMU_API int fmi3GetAdjointDerivative(void* c, const Reference*, std::size_t, const Reference*, std::size_t,
                                     const double*, std::size_t, double*, std::size_t) {
    return of(c).failed("adjoint derivatives are not given");
}
FMU_API int fmi3GetOutputDerivatives(void* c, const Reference*, std::size_t n, const std::int32_t*, double*,
                                     std::size_t) {
    return of(c).none(n, "derivatives of outputs are not given");
}

// --- Co-Simulation ---

FMU_API int fmi3DoStep(void* c, double from, double interval, bool, bool* event, bool* terminate, bool* early,
                       double* last) {
    const int e = of(c).call(__func__, fmu::between_steps, [=](Instance& i) { return i.step(from, interval); });
    *event = *terminate = *early = false;
    *last = of(c).instance.time();
    return e;
}

// --- Model Exchange ---

FMU_API int fmi3EvaluateDiscreteStates(void* c) {
    return of(c).call(__func__, fmu::initialization | fmu::event, [](Instance&) { return fmu::ok; });
}
FMU_API int fmi3UpdateDiscreteStates(void* c, bool* needed, bool* terminate, bool* nominals_changed,
                                     bool* states_changed, bool* next_defined, double* next) {
    fmu::Instance::Settled settled;
    const int e = of(c).call(__func__, fmu::event, [&](Instance& i) { return i.settle(settled); });
    *needed = *terminate = *nominals_changed = false;
    *states_changed = settled.states_changed;
    *next_defined = settled.has_next;
    *next = settled.next;
    return e;
}
FMU_API int fmi3EnterContinuousTimeMode(void* c) { return of(c).enter(__func__, fmu::event, fmu::continuous); }
FMU_API int fmi3CompletedIntegratorStep(void* c, bool, bool* enter_event_mode, bool* terminate) {
    *enter_event_mode = *terminate = false;
    return of(c).call(__func__, fmu::continuous, [=](Instance& i) { return i.accept(*enter_event_mode); });
}
FMU_API int fmi3SetTime(void* c, double time) {
    return of(c).call(__func__, fmu::event | fmu::continuous, [=](Instance& i) { return i.set_time(time); });
}
FMU_API int fmi3SetContinuousStates(void* c, const double* x, std::size_t n) {
    return of(c).call(__func__, fmu::continuous, [=](Instance& i) { return i.set_states(x, n); });
}
FMU_API int fmi3GetContinuousStates(void* c, double* x, std::size_t n) {
    return of(c).call(__func__, fmu::exchanged, [=](Instance& i) { return i.get_states(x, n); });
}
FMU_API int fmi3GetContinuousStateDerivatives(void* c, double* out, std::size_t n) {
    return of(c).call(__func__, fmu::exchanged, [=](Instance& i) { return i.get_derivatives(out, n); });
}
FMU_API int fmi3GetEventIndicators(void* c, double* out, std::size_t n) {
    return of(c).call(__func__, fmu::exchanged, [=](Instance& i) { return i.get_guards(out, n); });
}
FMU_API int fmi3GetNominalsOfContinuousStates(void* c, double* out, std::size_t n) {
    return of(c).get_nominals(__func__, out, n);
}
FMU_API int fmi3GetNumberOfEventIndicators(void* c, std::size_t* n) {
    *n = of(c).instance.indicator_count();
    return fmu::ok;
}
FMU_API int fmi3GetNumberOfContinuousStates(void* c, std::size_t* n) {
    *n = of(c).instance.state_count();
    return fmu::ok;
}

}  // namespace lostmotion::fmi3
