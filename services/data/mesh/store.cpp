#include "services/data/mesh/store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "common/core/log.h"
#include "services/data/mesh/placement.h"
#include "services/data/mesh/store_file.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

// An open file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int value = -1) : value_(value) {}
  ~Descriptor() {
    if (value_ >= 0) close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return value_; }
  bool valid() const { return value_ >= 0; }

 private:
  int value_;
};

class Store : public MeshStore {
 public:
  explicit Store(StoreContent content) : content_(std::move(content)) {}
  const MeshStoreInfo& info() const override { return content_.info; }
  const std::vector<geometry::ChunkInfo>& chunks() const override { return content_.chunks; }
  geometry::ChunkBytes chunk(ChunkId id) const override {
    CHECK(id.value < content_.chunks.size());
    return {content_.file->bytes().subspan(content_.offsets[id.value], content_.chunks[id.value].bytes), content_.file};
  }

 private:
  StoreContent content_;
};

std::shared_ptr<MeshStore> make_store(StoreContent content, const std::string& path, bool from_cache) {
  content.info.source = path;
  content.info.from_cache = from_cache;
  return std::make_shared<Store>(std::move(content));
}

fs::path default_cache_dir() {
  if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg && *xdg) return fs::path(xdg) / "telesplat";
  if (const char* home = std::getenv("HOME"); home && *home) return fs::path(home) / ".cache" / "telesplat";
  return fs::temp_directory_path() / fmt::format("telesplat-{}", getuid());
}

// Reads the mesh file and writes its store into the descriptor.
Status build_store(int descriptor, const std::string& path, const StoreOptions& options, const MeshSource& source,
                   const Progress& progress) {
  auto mesh = source.read([&](double fraction) { progress("read", fraction); });
  if (!mesh) return mesh.error();
  progress("read", 1.0);
  MeshStoreInfo info;
  info.format = mesh->format;
  info.vertices = mesh->positions.size();
  info.had_normals = !mesh->normals.empty();
  info.had_colours = !mesh->colours.empty();
  info.content_hash = source.hash;
  info.arrays = mesh->arrays;
  info.array = source.array;
  progress("normals", 0.0);
  const auto placed = place_mesh(std::move(*mesh), options.room_size_m, options.up, path);
  if (!placed) return placed.error();
  progress("normals", 1.0);
  info.triangles = placed->indices.size() / 3;
  info.degenerate_dropped = placed->degenerate_dropped;
  info.box_data = placed->box_data;
  info.box_room = placed->box_room;
  info.up = placed->up;
  info.up_reason = placed->up_reason;
  return write_store(descriptor, path, *placed, info, progress);
}

// Without a cache: a file that has no name and goes away with its last mapping.
Result<std::shared_ptr<MeshStore>> open_unnamed(const std::string& path, const StoreOptions& options,
                                                const MeshSource& source, const Progress& progress) {
  std::error_code ignored;
  std::string name = (fs::temp_directory_path(ignored) / "telesplat-XXXXXX").string();
  const Descriptor file(mkostemp(name.data(), O_CLOEXEC));
  if (!file.valid())
    return Error{fmt::format("{}: no temporary file {} for its chunks: {}", path, name, std::strerror(errno))};
  unlink(name.c_str());
  if (auto status = build_store(file.get(), path, options, source, progress); !status) return status.error();
  auto content = read_store(file.get(), name);
  if (!content) return content.error();
  return make_store(std::move(*content), path, false);
}

Result<StoreContent> open_existing(const std::string& name) {
  const Descriptor file(open(name.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.valid()) return Error{fmt::format("{}: {}", name, std::strerror(errno))};
  return read_store(file.get(), name);
}

// Makes a store in the cache. It gets its name once it is whole.
Result<std::shared_ptr<MeshStore>> make_cached(const std::string& stem, const std::string& path,
                                               const StoreOptions& options, const MeshSource& source,
                                               const Progress& progress) {
  const std::string name = stem + ".mesh", part = stem + ".part";
  {
    const Descriptor out(::open(part.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (!out.valid()) {
      log::warn("{} cannot be written ({}); going on without a cache", part, std::strerror(errno));
      return open_unnamed(path, options, source, progress);
    }
    const Status built = build_store(out.get(), path, options, source, progress);
    if (!built.ok() || std::rename(part.c_str(), name.c_str()) != 0) {
      const std::string reason =
          built.ok() ? fmt::format("{}: cannot be renamed: {}", part, std::strerror(errno)) : built.error().text;
      std::error_code error;
      fs::remove(part, error);
      return Error{reason};
    }
  }
  auto content = open_existing(name);
  if (!content) return content.error();
  return make_store(std::move(*content), path, false);
}

}  // namespace

Status validate(const StoreOptions& options) {
  if (!(options.room_size_m >= 1e-3 && options.room_size_m <= 1e4))
    return Error{fmt::format("room size {} m is outside [0.001, 10000]", options.room_size_m)};
  if (options.up != "auto")
    if (const auto rotation = rotation_for_up(options.up); !rotation) return rotation.error();
  return ok_status();
}

Result<std::shared_ptr<MeshStore>> MeshStore::make(const std::string& path, const MeshSource& source,
                                                   const StoreOptions& options, const Progress& progress) {
  if (!options.use_cache) return open_unnamed(path, options, source, progress);
  const fs::path folder = options.cache_dir.empty() ? default_cache_dir() : fs::path(options.cache_dir);
  const std::string stem =
      (folder / fmt::format("{:016x}-{}-{}{}", source.hash, options.up, options.room_size_m, source.variant)).string();
  const std::string name = stem + ".mesh";
  if (auto content = open_existing(name)) return make_store(std::move(*content), path, true);

  std::error_code error;
  fs::create_directories(folder, error);
  // One process at a time makes this store; others wait for it here and then find it. The lock ends with its holder.
  const Descriptor lock(::open((stem + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (!lock.valid() || flock(lock.get(), LOCK_EX) != 0) {
    log::warn("cache folder {} cannot be written ({}); going on without", folder.string(), std::strerror(errno));
    return open_unnamed(path, options, source, progress);
  }
  auto content = open_existing(name);
  if (content) return make_store(std::move(*content), path, true);
  if (fs::exists(name, error)) {
    log::warn("{}; making it anew", content.error().text);
    fs::remove(name, error);
  }
  return make_cached(stem, path, options, source, progress);
}

}  // namespace telesplat::data
