// What the functions of FMI 2.0 and 3.0 have in common: an instance, the importer's logger, and states as bytes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "instance.hpp"

#if defined _WIN32
#define FMU_API extern "C" __declspec(dllexport)
#else
#define FMU_API extern "C" __attribute__((visibility("default")))
#endif

namespace lostmotion::fmu {

// Logger: called with status, category and sentence.
template <class Logger>
class Component {
 public:
    using State = std::vector<double>;

    Component(Logger log, const char* resources, Kind kind)
        : instance(path_of_uri(resources == nullptr ? "" : resources), kind), log_(std::move(log)) {}

    // nullptr, and a message, if the resources are wrong. name_of_identifier: in modelDescription.xml.
    static Component* made(Logger log, const char* identifier, const char* name_of_identifier, const char* resources,
                           Kind kind) {
        auto* component = new Component(std::move(log), resources, kind);
        std::string problem = component->instance.problem();
        if (problem.empty() && identifier != nullptr && component->instance.identifier() != identifier)
            problem =
                std::string("the ") + name_of_identifier + " of modelDescription.xml is not that of the resources";
        if (problem.empty()) return component;
        component->log_(error, "logStatusError", problem);
        delete component;
        return nullptr;
    }

    int ended(Ended status) {
        if (status != ok) log_(status, status == discard ? "logStatusDiscard" : "logStatusError", instance.sentence());
        return status;
    }
    int failed(const char* sentence) { return ended(instance.failed(sentence)); }

    int get_values(const unsigned* reference, std::size_t n, double* value) {
        for (std::size_t k = 0; k < n; ++k)
            if (const Ended e = instance.get(reference[k], value[k]); e != ok) return ended(e);
        return ok;
    }
    int set_values(const unsigned* reference, std::size_t n, const double* value) {
        return ended(instance.set(reference, n, value));
    }
    // Of a call for variables of a type that there is none of.
    int none(std::size_t n, const char* sentence) { return n == 0 ? int{ok} : failed(sentence); }

    int get_state(void** state) { return ended(instance.get_state(room(state))); }
    int set_state(const void* state) { return ended(instance.set_state(of(state).data(), of(state).size())); }
    int serialize(const void* state, void* bytes, std::size_t size) {
        if (size != size_of(state)) return failed("the size is another one");
        std::memcpy(bytes, of(state).data(), size);
        return ok;
    }
    int deserialize(const void* bytes, std::size_t size, void** state) {
        if (size == 0 || size != sizeof(double) * instance.state_size())
            return failed("these bytes are no state of this FMU");
        State& to = room(state);
        to.resize(size / sizeof(double));
        std::memcpy(to.data(), bytes, size);
        return ok;
    }
    static int free_state(void** state) {
        delete static_cast<State*>(*state);
        *state = nullptr;
        return ok;
    }
    static std::size_t size_of(const void* state) { return sizeof(double) * of(state).size(); }

    int get_nominals(double* out, std::size_t n) {
        const std::vector<double>& nominals = instance.nominals();
        if (n != nominals.size()) return failed("the number of continuous states is another one");
        std::copy(nominals.begin(), nominals.end(), out);
        return ok;
    }

    Instance instance;

 private:
    static const State& of(const void* state) { return *static_cast<const State*>(state); }
    // That of the importer, or a new one.
    static State& room(void** state) {
        if (*state == nullptr) *state = new State;
        return *static_cast<State*>(*state);
    }

    Logger log_;
};

}  // namespace lostmotion::fmu
