#include "services/data/mesh/store.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <thread>
#include <utility>

#include "common/core/clock.h"
#include "common/core/descriptor.h"
#include "common/core/log.h"
#include "services/data/base/cut_off.h"
#include "services/data/mesh/cache.h"
#include "services/data/mesh/out_of_core/build.h"
#include "services/data/mesh/placing/placement.h"
#include "services/data/mesh/store_file.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

// True: the open file still has this name.
bool is_named(const Descriptor& file, const std::string& name) {
  struct stat held {
  }, there{};
  return fstat(file.get(), &held) == 0 && stat(name.c_str(), &there) == 0 && held.st_ino == there.st_ino;
}

class Store : public MeshStore {
 public:
  /// use: the lock that marks a cached store as used.
  explicit Store(StoreContent content, Descriptor use)
      : content_(std::move(content)), use_(std::move(use)), checked_(content_.checked ? 0 : content_.chunks.size()) {}
  const MeshStoreInfo& info() const override { return content_.info; }
  const std::vector<geometry::ChunkInfo>& chunks() const override { return content_.chunks; }
  geometry::ChunkBytes chunk(ChunkId id) const override {
    CHECK(id.value < content_.chunks.size());
    if (touched_.fetch_add(content_.chunks[id.value].bytes) > kMostResident) touched_ = 0, content_.file->drop_pages();
    if (!content_.checked && !checked_[id.value]) {
      if (!is_whole(content_, id.value)) end_at(id);
      checked_[id.value] = true;
    }
    return {content_.chunk(id.value), content_.file};
  }

 private:
  [[noreturn]] void end_at(ChunkId damaged) const {
    const std::string& file = content_.info.kept_in;
    if (is_named(use_, file)) std::remove(file.c_str());
    end_at_damaged_file(fmt::format("{}: chunk {} of the store is damaged; the next start makes the store anew",
                                    file.empty() ? content_.info.source : file, damaged.value));
  }

  StoreContent content_;
  Descriptor use_;
  mutable std::atomic<size_t> touched_ = 0;         // bytes since pages were dropped
  mutable std::vector<std::atomic<bool>> checked_;  // empty: all chunks are
};

// news: remarks on this opening only, for the user.
std::shared_ptr<MeshStore> make_store(StoreContent content, const std::string& path, bool from_cache,
                                      const std::vector<std::string>& news, Descriptor use = Descriptor()) {
  content.info.source = path;
  for (std::string& note : content.info.notes) note = path + ": " + note;
  content.info.notes.insert(content.info.notes.end(), news.begin(), news.end());
  content.info.from_cache = from_cache;
  return std::make_shared<Store>(std::move(content), std::move(use));
}

// Reads the whole mesh and writes its store.
Status read_and_write(StorePlace& place, const std::string& path, const StoreOptions& options, const MeshSource& source,
                      MeshStoreInfo& info, const Progress& progress) {
  auto mesh = source.read([&](double fraction) { progress(kReading, fraction); });
  if (!mesh) return mesh.error();
  progress(kReading, 1.0);
  for (const std::string& note : mesh->notes) info.notes.push_back(without_name(note, path));
  info.format = mesh->format;
  info.vertices = mesh->positions.size();
  info.had_normals = !mesh->normals.empty();
  info.had_colours = !mesh->colours.empty();
  info.arrays = mesh->arrays;
  info.coordinates = mesh->coordinates;
  progress(kPlacing, 0.0);
  const auto placed = place_mesh(std::move(*mesh), options, path);
  if (!placed) return placed.error();
  progress(kPlacing, 1.0);
  info.triangles = placed->indices.size() / 3;
  info.degenerate_dropped = placed->degenerate_dropped;
  info.box_data = placed->box_data;
  info.box_room = placed->box_room;
  info.up = placed->placing.up;
  info.up_reason = placed->placing.up_reason;
  Status written = write_store(place.descriptor, path, *placed, info, progress);
  place.unwritten = !written;
  return written;
}

// Writes the store of a mesh; a large one is never held whole if its file allows that.
Status build_store(StorePlace& place, const std::string& path, const StoreOptions& options, const MeshSource& source,
                   const Progress& progress) {
  MeshStoreInfo info;
  info.content_hash = source.hash;
  info.array = source.array;
  if (source.random) {
    const auto mesh = source.random([&](double fraction) { progress(kReading, fraction); });
    if (!mesh) return mesh.error();
    const auto written = *mesh ? write_out_of_core(place, path, **mesh, {.store = options}, info, progress) : false;
    if (!written) return written.error();
    if (*written) return ok_status();
    info = MeshStoreInfo{};
    info.content_hash = source.hash, info.array = source.array;
  }
  return read_and_write(place, path, options, source, info, progress);
}

// Makes a store in a file without a name, which goes away with its last mapping.
Result<std::shared_ptr<MeshStore>> make_unnamed(const std::string& path,
                                                const std::function<Status(StorePlace& place)>& build) {
  std::error_code ignored;
  const fs::path folder = fs::temp_directory_path(ignored);
  std::string name = (folder / "telesplat-XXXXXX").string();
  const Descriptor file(mkostemp(name.data(), O_CLOEXEC));
  if (!file.valid())
    return Error{fmt::format("{}: no temporary file {} for its chunks: {}", path, name, std::strerror(errno))};
  unlink(name.c_str());
  StorePlace place{file.get(), folder.string()};
  if (auto status = build(place); !status) return status.error();
  auto content = read_store(file.get(), name, StoreOptions().checked_at_opening);
  if (!content) return content.error();
  return make_store(std::move(*content), path, false, {});
}

// Path of the store in the cache, without the ending.
std::string stem_of(const MeshSource& source, const StoreOptions& options) {
  const fs::path folder = options.cache_dir.empty() ? default_cache_folder() : options.cache_dir;
  return (folder / fmt::format("{:016x}-{}-{}-{}{}", source.hash, options.up, options.room_size_m, options.crease_deg,
                               source.variant))
      .string();
}

// Without a cache.
Result<std::shared_ptr<MeshStore>> open_unnamed(const std::string& path, const StoreOptions& options,
                                                const MeshSource& source, const Progress& progress) {
  return make_unnamed(path, [&](StorePlace& place) { return build_store(place, path, options, source, progress); });
}

// Goes on without a cache, for this reason.
Result<std::shared_ptr<MeshStore>> open_without_cache(const std::string& reason, const std::string& path,
                                                      const StoreOptions& options, const MeshSource& source,
                                                      const Progress& progress) {
  if (options.must_keep) return Error{reason};
  log::warn("{}; going on without a cache", reason);
  return open_unnamed(path, options, source, progress);
}

// Opens the store of a stem and locks it as used; null: it does not exist. news: remarks for the user.
Result<std::shared_ptr<MeshStore>> open_existing(const std::string& stem, const std::string& path,
                                                 const StoreOptions& options, bool from_cache,
                                                 const std::vector<std::string>& news = {}) {
  const std::string name = stem + ".mesh";
  auto file = Descriptor::open_file(name, O_RDONLY);
  if (!file.valid() && errno == ENOENT) return std::shared_ptr<MeshStore>();
  if (!file.valid()) return Error{fmt::format("{}: {}", name, std::strerror(errno))};
  file.lock(LOCK_SH);
  auto content = read_store(file.get(), name, options.checked_at_opening);
  if (!content) return content.error();
  content->info.kept_in = name;
  note_use(stem, path, fmt::format("{}, {} triangles", content->info.format, content->info.triangles));
  return make_store(std::move(*content), path, from_cache, news, std::move(file));
}

// Makes a store in the cache. It gets its name once it is whole. If the cache has a limit, other stores are removed for
// it; this one is locked.
Result<std::shared_ptr<MeshStore>> make_cached(const std::string& stem, const std::string& path,
                                               const StoreOptions& options, const MeshSource& source,
                                               const Progress& progress) {
  const std::string name = stem + ".mesh", part = stem + ".part";
  bool unwritten = false;
  std::string reason;
  try {
    const auto out = Descriptor::open_file(part, O_RDWR | O_CREAT | O_TRUNC);
    if (!out.valid())
      return open_without_cache(fmt::format("{} cannot be written ({})", part, std::strerror(errno)), path, options,
                                source, progress);
    StorePlace place{out.get(), fs::path(stem).parent_path().string()};
    const Status built = build_store(place, path, options, source, progress);
    unwritten = place.unwritten;
    if (!built.ok() || std::rename(part.c_str(), name.c_str()) != 0) {
      reason = built.ok() ? fmt::format("{}: cannot be renamed: {}", part, std::strerror(errno)) : built.error().text;
      std::error_code error;
      fs::remove(part, error);
      if (!unwritten) return Error{reason};
    }
  } catch (...) {  // it was given up
    unlink(part.c_str());
    throw;
  }
  if (unwritten) return open_without_cache(reason, path, options, source, progress);  // there may be room elsewhere
  std::vector<std::string> news;
  if (std::string told = after_growth(fs::path(stem).parent_path().string()); !told.empty())
    news.push_back(std::move(told));
  auto store = open_existing(stem, path, options, false, news);
  if (!store.ok() || *store) return store;
  return Error{fmt::format("{}: was removed as soon as it was made", name)};
}

constexpr const char* kWaitingForAnother = "waiting for another process that reads it";
constexpr double kLongestWait_s = 600;

// Waits until no other process makes this store: one makes it, the others then find it. The lock ends with its holder.
// Clearing the cache removes unheld locks, so the file may be gone once it is locked: then try again.
Descriptor lock_making(const std::string& stem, const Progress& progress) {
  const std::string name = stem + ".lock";
  const double begin_s = monotonic_s();
  bool told = false;
  while (true) {
    auto lock = Descriptor::open_file(name, O_RDWR | O_CREAT);
    if (!lock.lock(LOCK_EX | LOCK_NB)) {
      if (!lock.valid() || errno != EWOULDBLOCK || monotonic_s() - begin_s > kLongestWait_s) return Descriptor();
      if (!std::exchange(told, true)) log::info("{}: another process makes this chunk store; waiting for it", name);
      if (progress) progress(kWaitingForAnother, 0);
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      continue;
    }
    if (is_named(lock, name)) return lock;
  }
}

}  // namespace

Result<std::shared_ptr<MeshStore>> MeshStore::keep(const std::string& path, const PlacedMesh& mesh,
                                                   const MeshStoreInfo& info) {
  return make_unnamed(path, [&](StorePlace& place) {
    return write_store(place.descriptor, path, mesh, info, [](const char*, double) {});
  });
}

bool MeshStore::is_made(const std::string& path, const MeshSource& source, const StoreOptions& options) {
  if (!options.use_cache) return false;
  const auto store = open_existing(stem_of(source, options), path, options, true);
  return store && *store;
}

Result<std::shared_ptr<MeshStore>> MeshStore::make(const std::string& path, const MeshSource& source,
                                                   const StoreOptions& options, const Progress& progress) {
  if (!options.use_cache) return open_unnamed(path, options, source, progress);
  const std::string stem = stem_of(source, options);
  const fs::path folder = fs::path(stem).parent_path();
  std::error_code error;
  fs::create_directories(folder, error);
  if (const std::string problem = problem_of_shared_place(folder.string()); !problem.empty())
    return open_without_cache(fmt::format("cache folder {}: {}", folder.string(), problem), path, options, source,
                              progress);
  if (auto store = open_existing(stem, path, options, true); store && *store) return store;
  const Descriptor lock = lock_making(stem, progress);
  if (!lock.valid())
    return open_without_cache(
        fmt::format("cache folder {} cannot be written ({})", folder.string(), std::strerror(errno)), path, options,
        source, progress);
  auto store = open_existing(stem, path, options, true);
  if (store && *store) return store;
  if (!store) {
    log::warn("{}; making it anew", store.error().text);
    fs::remove(stem + ".mesh", error);
  }
  return make_cached(stem, path, options, source, progress);
}

}  // namespace telesplat::data
