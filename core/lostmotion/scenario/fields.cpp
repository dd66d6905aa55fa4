#include "fields.hpp"

namespace lostmotion {

bool within(Range range, double v) {
    const bool finite = std::isfinite(v);
    switch (range) {
        case Range::any: return finite;
        case Range::positive: return finite && v > 0.0;
        case Range::not_negative: return finite && v >= 0.0;
        case Range::up_to_one: return v > 0.0 && v <= 1.0;
        case Range::share: return v >= 0.0 && v <= 1.0;
        case Range::above_one: return finite && v >= 1.0;  // 1, which no file has, is that of a motor in a current loop
        case Range::limit: return v > 0.0;
        case Range::limit_or_zero: return v >= 0.0;
        case Range::bound: return !std::isnan(v);
    }
    return false;
}

const char* range_text(Range range) {
    switch (range) {
        case Range::any: return "finite";
        case Range::positive: return "finite and > 0";
        case Range::not_negative: return "finite and >= 0";
        case Range::up_to_one: return "> 0 and <= 1";
        case Range::share: return ">= 0 and <= 1";
        case Range::above_one: return "finite and >= 1";
        case Range::limit: return "> 0";
        case Range::limit_or_zero: return ">= 0";
        case Range::bound: return "a number";
    }
    return "";
}

std::string FieldPath::to(const std::string& name) const {
    std::string all;
    for (const std::string& n : names_) all += (all.empty() || n[0] == '[' ? "" : ".") + n;
    return all + (all.empty() || name.empty() || name[0] == '[' ? "" : ".") + name;
}

void FieldWriter::text(const char*, const std::string& v) {
    numbers.push_back(static_cast<double>(v.size()));
    for (const char c : v) numbers.push_back(static_cast<double>(static_cast<unsigned char>(c)));
}

void FieldWriter::list(const char*, const std::vector<double>& v, Range) {
    numbers.push_back(static_cast<double>(v.size()));
    numbers.insert(numbers.end(), v.begin(), v.end());
}

void FieldReader::number(const char* name, double& v, Range range) {
    const double given = take(name);
    if (!well()) return;
    if (!within(range, given))
        return wrong(name, "is " + general_text(given, 10) + "; it must be " + range_text(range));
    v = given;
}

void FieldReader::number(const Field& field, double& v) {
    if (field.given == Given::may_be_left_out && left() > 0 && numbers_[next_] == v)
        ++next_;
    else
        number(field.key, v, field.range);
}

void FieldReader::pair(const Field& field, std::array<double, 2>& v) {
    for (double& end : v) number(field.key, end, field.range);
    if (well() && v[1] < v[0])
        wrong(field.key, "falls from " + general_text(v[0], 10) + " to " + general_text(v[1], 10) + "; it must not");
}

void FieldReader::flag(const char* name, bool& v) {
    int given = 0;
    integer(name, given, 0, 1);
    if (well()) v = given != 0;
}

void FieldReader::text(const char* name, std::string& v) {
    const std::size_t n = length(name);
    v.clear();
    for (std::size_t k = 0; k < n && well(); ++k) {
        int c = 0;
        integer(name, c, 1, 255);
        v += static_cast<char>(c);
    }
}

void FieldReader::list(const char* name, std::vector<double>& v, Range range) {
    const std::size_t n = length(name);
    v.assign(n, 0.0);
    for (std::size_t k = 0; k < n && well(); ++k) number(name, v[k], range);
}

double FieldReader::take(const char* name) {
    if (well() && left() == 0) wrong(name, "is missing: the description ends before it");
    return well() ? numbers_[next_++] : 0.0;
}

std::size_t FieldReader::length(const char* name) {
    long n = 0;
    integer(name, n, 0, static_cast<long>(left()));
    return well() ? static_cast<std::size_t>(n) : 0;
}

}  // namespace lostmotion
