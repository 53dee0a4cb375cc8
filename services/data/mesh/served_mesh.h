// A mesh as a data server serves it: samplers ask which chunks there are, and for chunks.
#pragma once

#include <memory>
#include <string>

#include "services/data/mesh/store.h"
#include "services/data/served.h"

namespace telesplat::data {

/// path: where the mesh is from.
std::unique_ptr<Served> serve_mesh(std::shared_ptr<const MeshStore> store, const std::string& path);

}  // namespace telesplat::data
