#include "services/data/gltf/draco.h"

#include <draco/compression/decode.h>

namespace telesplat::data::gltf {

DracoMesh decode_draco(Bytes packed, const std::vector<uint32_t>& ids) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(packed.data()), packed.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) refuse("{}", decoded.status().error_msg());
  draco::Mesh& mesh = *decoded.value();
  DracoMesh out;
  out.indices.reserve(size_t{3} * mesh.num_faces());
  for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f)
    for (int k = 0; k < 3; ++k) out.indices.push_back(mesh.face(f)[size_t(k)].value());
  for (const uint32_t id : ids) {
    const int32_t number = mesh.GetAttributeIdByUniqueId(id);
    if (number < 0) refuse("there is no attribute {}", id);
    draco::PointAttribute* attribute = mesh.attribute(number);
    const int width = attribute->num_components();
    if (width < 1 || width > 4) refuse("attribute {} has {} components", id, width);
    attribute->set_normalized(false);
    Values& values = out.attributes[id];
    values.width = width;
    values.numbers = std::make_shared<std::vector<float>>(size_t(mesh.num_points()) * size_t(width));
    for (uint32_t p = 0; p < mesh.num_points(); ++p) {
      const auto at = attribute->mapped_index(draco::PointIndex(p));
      if (at.value() >= attribute->size() ||
          !attribute->ConvertValue<float>(at, int8_t(width), values.numbers->data() + size_t(p) * size_t(width)))
        refuse("attribute {} lacks a value for point {}", id, p);
    }
  }
  return out;
}

}  // namespace telesplat::data::gltf
