// Shared by all fuzz targets of mesh readers: a mesh that passes validation must pass placement, chunking and coding.
#pragma once

#include <cstdlib>

#include "common/geometry/chunk_code.h"
#include "services/data/mesh/reader.h"
#include "services/data/mesh/store_file.h"

namespace telesplat::data {

inline int use(Result<Mesh> mesh) {
  if (mesh.ok()) drop_not_finite(*mesh, "fuzz");
  if (!mesh.ok() || !validate_mesh(*mesh, "fuzz").ok()) return 0;
  const auto placed = place_mesh(std::move(*mesh), {}, "fuzz");
  if (!placed.ok()) return 0;
  const ChunkPlan plan = plan_chunks(*placed, 64);
  for (size_t c = 0; c < plan.chunks(); ++c) {
    const auto bytes =
        make_chunk(*placed, std::span(plan.order).subspan(plan.begin[c], plan.begin[c + 1] - plan.begin[c]));
    const auto view = geometry::MeshChunkView::validate(bytes);
    if (!view.ok() || !geometry::decode_chunk(geometry::encode_chunk(*view)).ok()) std::abort();
  }
  return 0;
}

}  // namespace telesplat::data
