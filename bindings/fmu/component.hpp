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
    int failed(const std::string& sentence) { return ended(instance.failed(sentence)); }
    // A function that may be called in some modes: what acts on the instance, or changes nothing in others.
    template <class Act>
    int call(const char* function, unsigned modes, Act&& act) {
        if ((instance.mode() & modes) != 0) return ended(act(instance));
        return failed(std::string(function) + " cannot be called " + words_of(instance.mode()) + ", only " +
                      words_of(modes));
    }
    int enter(const char* function, unsigned from, Mode to) {
        return call(function, from, [to](Instance& i) { return i.enter(to); });
    }

    int get_values(const char* function, unsigned modes, const unsigned* reference, std::size_t n, double* value) {
        return call(function, modes, [=](Instance& i) {
            Ended e = ok;
            for (std::size_t k = 0; k < n && e == ok; ++k) e = i.get(reference[k], value[k]);
            return e;
        });
    }
    int set_values(const char* function, const unsigned* reference, std::size_t n, const double* value) {
        return call(function, before_termination, [=](Instance& i) { return i.set(reference, n, value); });
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

    int get_nominals(const char* function, double* out, std::size_t n) {
        return call(function, instantiated | exchanged, [=](Instance& i) {
            const std::vector<double>& nominals = i.nominals();
            if (n != nominals.size()) return i.failed("the number of continuous states is another one");
            std::copy(nominals.begin(), nominals.end(), out);
            return ok;
        });
    }

    Instance instance;

 private:
    // Of an importer that has got none, the empty one, which no instance takes.
    static const State& of(const void* state) {
        static const State none;
        return state == nullptr ? none : *static_cast<const State*>(state);
    }
    // That of the importer, or a new one.
    static State& room(void** state) {
        if (*state == nullptr) *state = new State;
        return *static_cast<State*>(*state);
    }

    Logger log_;
};

}  // namespace lostmotion::fmu
