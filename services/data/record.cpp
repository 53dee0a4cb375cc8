#include "services/data/record.h"

#include <fmt/format.h>

#include <filesystem>

#include "common/core/guarded.h"
#include "services/data/base/numbered.h"
#include "services/data/volume/volume.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

constexpr int kPolite = 15;  // levels of nice

}  // namespace

std::string scene_lines(const DataOptions& o, scene::Kind kind) {
  DataOptions given = o, usual;
  std::error_code error;
  const std::string file = fs::absolute(given.scene, error).string();
  // Size and up axis are recorded even at their defaults: defaults may change.
  const auto defaults = options::without(scene_table(usual), {"--room-size", "--up"});
  return fmt::format("\n[scene]\nkind = {}\nfile = {}\n{}", options::quoted(std::string(scene::name_of(kind))),
                     options::quoted(file), options::recorded(scene_table(given), defaults));
}

std::string record_of(const DataOptions& o, const Served& served) {
  std::string own = served.record();
  return own.empty() ? scene_lines(o, served.kind()) : own;
}

std::vector<std::string> files_of(const DataOptions& o, scene::Kind kind) {
  if (kind == scene::Kind::kJulia) return {};
  std::vector<std::string> paths{o.scene};
  if (kind == scene::Kind::kVolume)
    if (const auto volume = find_volume(o.scene, o.volume)) paths = volume->files();
  std::vector<std::string> out;
  std::error_code error;
  for (const std::string& path : paths) {
    if (!fs::is_directory(path, error)) {
      out.push_back(path);
      continue;
    }
    if (const auto inside = files_of_folder(path)) out.insert(out.end(), inside->begin(), inside->end());
  }
  return out;
}

BackgroundHash::BackgroundHash(std::vector<std::string> files)
    : thread_([this, files = std::move(files)] {
        net::lower_thread_priority(kPolite);
        if (files.empty()) return;
        // Without a hash the record says that it was not measured.
        const Status done = guarded("hashing the data", [&] {
          if (const auto hash = hash_of_files(files, [this] { return !stop_; })) hash_ = *hash;
        });
        if (!done) hash_.reset();
        done_ = true;
      }) {}

BackgroundHash::~BackgroundHash() {
  stop_ = true;
  thread_.join();
}

std::optional<FileHash> BackgroundHash::take() {
  return done_.exchange(false) ? std::exchange(hash_, std::nullopt) : std::nullopt;
}

}  // namespace telesplat::data
