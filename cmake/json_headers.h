// JSON for the precompiled headers of sanitized builds, in which two hundred sources spend a second each on it: its
// functions are compiled once (json_headers.cpp). Sources still include what they use.
#pragma once

#include <nlohmann/json.hpp>

#ifndef TELESPLAT_JSON_HERE
extern template class nlohmann::basic_json<>;
extern template class nlohmann::basic_json<nlohmann::ordered_map>;
#endif
