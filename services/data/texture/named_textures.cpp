#include "services/data/texture/named_textures.h"

#include <fmt/format.h>

#include <span>

namespace telesplat::data {

Result<uint32_t> NamedTextures::number_of(const std::string& picture, Wrap wrap) {
  const auto [entry, is_new] = numbers_.try_emplace({picture, wrap}, uint32_t(all_.size()));
  if (!is_new) return entry->second;
  const auto bytes = companions_.read(picture);
  if (!bytes) {
    notes_.push_back(fmt::format("{}: the texture {} is not there; the colours without it are shown", file_, picture));
    return entry->second = kNoTexture;
  }
  auto view = image::read_picture(std::as_bytes(std::span(*bytes)), picture, room_);
  if (!view) return Error{fmt::format("{}: {}", file_, view.error().text)};
  room_ -= view->colour.size();
  all_.push_back(std::make_shared<Texture>(std::move(*view), wrap, wrap));
  return entry->second;
}

}  // namespace telesplat::data
