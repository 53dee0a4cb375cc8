// JSON for precompiled headers: sources spend seconds each on it, so its functions are compiled once
// (json_headers.cpp). Sources still include all that they use.
#pragma once

#include <nlohmann/json.hpp>

#ifndef TELESPLAT_JSON_HERE
extern template class nlohmann::basic_json<>;
extern template class nlohmann::basic_json<nlohmann::ordered_map>;
#endif
