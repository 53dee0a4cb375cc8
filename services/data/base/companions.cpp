#include "services/data/base/companions.h"

namespace telesplat::data {

Result<std::string_view> FolderCompanions::read(const std::string& named) {
  auto& file = files_[named];
  if (!file) {
    auto opened = MappedFile::open((folder_ / named).string());
    if (!opened) return opened.error();
    file = std::move(*opened);
  }
  return file->text();
}

}  // namespace telesplat::data
