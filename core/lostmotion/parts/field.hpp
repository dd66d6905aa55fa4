// What is said of a parameter, in one place: what reads, writes, checks and documents it is made from this.
//
// A structure states its parameters by a function describe(fields), which calls fields.number({...}, value) for each.
// The value that a new structure has is its default, or, where a key may be left out, what stands for that.
#pragma once

#include <initializer_list>

namespace lostmotion {

// What a number may be; all but `limit`, `limit_or_zero` and `bound` are finite.
enum class Range {
    any,
    positive,
    not_negative,
    up_to_one,  // > 0 and <= 1
    share,      // >= 0 and <= 1
    above_one,
    limit,  // > 0, or infinite
    limit_or_zero,
    bound,  // any, or infinite
};

// Of a key in a scenario file.
enum class Given { has_default, needed, may_be_left_out, none };  // none: it follows from other parts of the drive

struct Field {
    const char* key;
    const char* symbol = "";
    const char* unit = "";
    Range range = Range::any;
    Given given = Given::has_default;
    const char* meaning = "";
};

// How many numbers a list may have.
struct Entries {
    static constexpr int any = 1 << 30;
    int fewest = 0, most = 100;
};

// A visitor of fields that takes none. Others derive from it and take some.
class FieldVisitor {
 public:
    static constexpr bool reads = false;

    bool well() const { return true; }
    template <class Value>
    void number(const Field&, Value&) {}
    template <class Value>
    void pair(const Field&, Value&) {}
    template <class Value>
    void integer(const Field&, Value&, long long, long long) {}
    template <class Value>
    void flag(const Field&, Value&) {}
    template <class Value>
    void list(const Field&, Value&) {}

    // What is a part of its own in scenario files, or follows from others.
    template <class... Other>
    void number(const char*, Other&&...) {}
    template <class... Other>
    void flag(const char*, Other&&...) {}
    template <class Enum>
    void choice(const char*, Enum, std::initializer_list<const char*>) {}
    template <class... Other>
    void optional(Other&&...) {}
    template <class... Other>
    void curve(Other&&...) {}
    template <class... Other>
    void curve_if(Other&&...) {}
};

}  // namespace lostmotion
