// The resources of an FMU: where they are and what is in them.
#pragma once

#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

namespace lostmotion::fmu {

// The path of a URI such as file:///C:/a%20b/resources, or a path as it is.
inline std::string path_of_uri(std::string_view uri) {
    for (const std::string_view scheme : {"file://localhost", "file://", "file:"})
        if (uri.starts_with(scheme)) {
            uri.remove_prefix(scheme.size());
            break;
        }
    const auto digit = [](char c) {
        return c >= '0' && c <= '9'   ? c - '0'
               : c >= 'a' && c <= 'f' ? c - 'a' + 10
               : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                      : -1;
    };
    std::string path;
    for (std::size_t k = 0; k < uri.size(); ++k) {
        const bool coded = uri[k] == '%' && k + 2 < uri.size() && digit(uri[k + 1]) >= 0 && digit(uri[k + 2]) >= 0;
        path += coded ? static_cast<char>(16 * digit(uri[k + 1]) + digit(uri[k + 2])) : uri[k];
        if (coded) k += 2;
    }
#if defined _WIN32
    if (path.size() > 2 && path[0] == '/' && path[2] == ':') path.erase(0, 1);
#endif
    while (path.size() > 1 && (path.back() == '/' || path.back() == '\\')) path.pop_back();
    return path;
}

#ifdef LOSTMOTION_EMBEDDED
// In the sources of an FMU, resources.cpp has them: a target of a real-time system has no files.
extern const std::vector<double> embedded_scenario;
extern const std::string embedded_names;

inline std::string text_of_file(const std::string&) { return embedded_names; }
inline std::vector<double> numbers_of_file(const std::string&) { return embedded_scenario; }
#else
// The numbers or characters of a file; nothing if it cannot be read.
template <class Content>
Content content_of_file(const std::string& path) {
    Content content;
    if (std::FILE* file = std::fopen(path.c_str(), "rb"); file != nullptr) {
        typename Content::value_type buffer[512];
        while (const std::size_t n = std::fread(buffer, sizeof buffer[0], 512, file))
            content.insert(content.end(), buffer, buffer + n);
        std::fclose(file);
    }
    return content;
}
inline std::string text_of_file(const std::string& path) { return content_of_file<std::string>(path); }
inline std::vector<double> numbers_of_file(const std::string& path) {
    return content_of_file<std::vector<double> >(path);
}
#endif

}  // namespace lostmotion::fmu
