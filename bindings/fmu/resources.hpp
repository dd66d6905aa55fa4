// The resources of an FMU: where they are and what is in them.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>

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

inline std::string text_of_file(const std::string& path) {
    std::string text;
    if (std::FILE* file = std::fopen(path.c_str(), "rb"); file != nullptr) {
        char buffer[256];
        while (const std::size_t n = std::fread(buffer, 1, sizeof buffer, file)) text.append(buffer, n);
        std::fclose(file);
    }
    return text;
}

}  // namespace lostmotion::fmu
