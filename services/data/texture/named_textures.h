// Pictures that a mesh file names, as textures.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "services/data/base/companions.h"
#include "services/data/texture/bake.h"

namespace telesplat::data {

class NamedTextures {
 public:
  /// file: for notes and error texts.
  NamedTextures(const std::string& file, Companions& companions) : file_(file), companions_(companions) {}

  /// The number of a picture, as it is wrapped, among all(). A picture is read once for each way to wrap it.
  /// kNoTexture: it cannot be opened; notes() tells that once. Error: it is damaged, or exceeds kMaxTexels with others.
  Result<uint32_t> number_of(const std::string& picture, Wrap wrap);

  const std::vector<std::shared_ptr<const Texture>>& all() const { return all_; }
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  const std::string& file_;
  Companions& companions_;
  std::map<std::pair<std::string, Wrap>, uint32_t> numbers_;
  std::vector<std::shared_ptr<const Texture>> all_;
  std::vector<std::string> notes_;
  uint64_t room_ = kMaxTexels;
};

}  // namespace telesplat::data
