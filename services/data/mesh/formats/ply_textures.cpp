#include "services/data/mesh/formats/ply_textures.h"

#include "services/data/base/polygons/double_vertices.h"
#include "services/data/texture/named_textures.h"

namespace telesplat::data {

void PlyTextures::add_corner(double texture, glm::vec2 place) {
  const bool named = texture >= 0 && texture < kNoTexture && place == place;
  corners_.push_back(named ? Corner{uint32_t(texture), {place.x, 1 - place.y}} : Corner{kNoTexture, {0, 0}});
}

Status PlyTextures::bake(Mesh& mesh, const std::vector<std::string>& pictures, const std::string& name,
                         Companions& companions, uint64_t texture_detail) const {
  NamedTextures textures(name, companions);
  std::vector<uint32_t> numbers;
  for (const std::string& picture : pictures) {
    const auto number = textures.number_of(picture, Wrap::kRepeat);
    if (!number) return number.error();
    numbers.push_back(*number);
  }
  mesh.notes.insert(mesh.notes.end(), textures.notes().begin(), textures.notes().end());
  if (textures.all().empty()) return ok_status();

  std::vector<Corner> looks(mesh.positions.size(), Corner{kNoTexture, {0, 0}});
  double_vertices(
      mesh, [&](uint32_t vertex, size_t corner) { return looks[vertex] == corners_[corner]; },
      [&](uint32_t vertex, size_t corner) {
        if (vertex == looks.size()) looks.emplace_back();
        looks[vertex] = corners_[corner];
      });
  mesh.colours.resize(mesh.positions.size(), kNeutralAlbedo);
  TextureUse use{textures.all(), {}, {}};
  for (size_t v = 0; v < looks.size(); ++v) {
    use.texture.push_back(looks[v].picture < numbers.size() ? numbers[looks[v].picture] : kNoTexture);
    use.uv.push_back(looks[v].place);
    if (use.texture[v] != kNoTexture) mesh.colours[v] = 0xffffff;
  }
  if (!drop_not_finite(mesh, name)) return ok_status();
  if (const std::string note = bake_textures(mesh, std::move(use), texture_detail); !note.empty())
    mesh.notes.push_back(name + ": " + note);
  return ok_status();
}

}  // namespace telesplat::data
