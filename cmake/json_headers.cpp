#define TELESPLAT_JSON_HERE
#include "cmake/json_headers.h"

template class nlohmann::basic_json<>;
template class nlohmann::basic_json<nlohmann::ordered_map>;
