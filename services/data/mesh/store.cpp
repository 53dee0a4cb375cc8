#include "services/data/mesh/store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

#include "common/core/log.h"
#include "services/data/mesh/isosurface.h"
#include "services/data/mesh/placement.h"
#include "services/data/mesh/reader.h"
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

// Text as hexadecimal digits of its hash: for file names.
std::string hex(const std::string& text) { return fmt::format("{:016x}", XXH3_64bits(text.data(), text.size())); }

// What a store is made from.
struct Source {
  uint64_t hash = 0;    // of all files' content
  std::string variant;  // what else decides what the mesh is, for the store's name
  std::function<Result<Mesh>(const ReadProgress&)> read;
};

// Of these files' content; those that cannot be read are left out: reading says why.
uint64_t hash_files(const std::vector<std::string>& paths, const Progress& progress) {
  constexpr size_t kStep = 64 << 20;
  XXH3_state_t* state = XXH3_createState();
  XXH3_64bits_reset(state);
  for (size_t n = 0; n < paths.size(); ++n) {
    const auto file = MappedFile::open(paths[n]);
    if (!file) continue;
    const auto bytes = (*file)->bytes();
    for (size_t at = 0; at < bytes.size(); at += kStep) {
      const double of_file = static_cast<double>(at) / static_cast<double>(bytes.size());
      progress("hash", (static_cast<double>(n) + of_file) / static_cast<double>(paths.size()));
      XXH3_64bits_update(state, bytes.data() + at, std::min(kStep, bytes.size() - at));
    }
  }
  const uint64_t hash = XXH3_64bits_digest(state);
  XXH3_freeState(state);
  progress("hash", 1.0);
  return hash;
}

Result<Source> mesh_source(const std::string& path, const MeshOptions& options, const Progress& progress) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  const DetectedFormat detected = detect_format((*file)->text(), path);
  if (detected.format.empty()) return Error{fmt::format("{}: {}", path, detected.complaint)};
  std::vector<std::string> files{path};
  for (auto& companion : companion_files((*file)->text(), detected.format, path)) files.push_back(std::move(companion));
  const ElevationOptions& elevation = options.elevation;
  const bool raster = detected.format == "raster";
  if (!raster && (elevation.z_scale != 0 || !elevation.texture.empty()))
    return Error{fmt::format("{}: is no elevation raster, but --z-scale or --texture is given", path)};
  if (!elevation.texture.empty()) {
    const auto texture = MappedFile::open(elevation.texture);
    if (!texture) return texture.error();
    files.push_back(elevation.texture);
  }
  return Source{hash_files(files, progress), raster ? fmt::format("-z{}", elevation.z_scale) : "",
                [=](const ReadProgress& p) { return read_mesh(path, p, elevation); }};
}

Result<Source> surface_source(const std::string& path, const MeshOptions& options, const Progress& progress) {
  auto found = find_volume(path, options.raw);
  if (!found) return found.error();
  std::vector<std::string> files{found->steps.front()};
  std::error_code error;
  if (fs::is_directory(files.front(), error)) {  // a folder of slices
    const std::string folder = std::exchange(files, {}).front();
    for (const auto& entry : fs::directory_iterator(folder, error))
      if (entry.is_regular_file(error)) files.push_back(entry.path().string());
    std::sort(files.begin(), files.end());
  }
  const double iso = *options.iso;
  return Source{hash_files(files, progress),
                fmt::format("-iso{}{}", iso, options.raw.empty() ? "" : "-" + hex(options.raw)),
                [source = std::move(*found), iso](const ReadProgress& p) -> Result<Mesh> {
                  const auto volume = read_volume(source, 0, p);
                  if (!volume) return volume.error();
                  return isosurface(*volume, iso, source.name);
                }};
}

Status validate_options(const MeshOptions& options) {
  if (!(options.room_size_m >= 1e-3 && options.room_size_m <= 1e4))
    return Error{fmt::format("room size {} m is outside [0.001, 10000]", options.room_size_m)};
  if (options.up != "auto")
    if (auto rotation = rotation_for_up(options.up); !rotation) return rotation.error();
  return ok_status();
}

// Reads the mesh file and writes its store into the descriptor.
Status build_store(int descriptor, const std::string& path, const MeshOptions& options, const Source& source,
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
  progress("normals", 0.0);
  const auto placed = place_mesh(std::move(*mesh), options.room_size_m, options.up, path);
  if (!placed) return placed.error();
  progress("normals", 1.0);
  info.triangles = placed->indices.size() / 3;
  info.degenerate_dropped = placed->degenerate_dropped;
  info.box_data = placed->box_data;
  info.box_room = placed->box_room;
  info.up = placed->up;
  return write_store(descriptor, path, *placed, info, progress);
}

// Without a cache: a file that has no name and goes away with its last mapping.
Result<std::shared_ptr<MeshStore>> open_unnamed(const std::string& path, const MeshOptions& options,
                                                const Source& source, const Progress& progress) {
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

}  // namespace

Result<std::shared_ptr<MeshStore>> MeshStore::open(const std::string& path, const MeshOptions& options,
                                                   const Progress& user_progress) {
  const Progress progress = user_progress ? user_progress : [](const char*, double) {};
  if (auto status = validate_options(options); !status) return status.error();
  const auto source = options.iso ? surface_source(path, options, progress) : mesh_source(path, options, progress);
  if (!source) return source.error();
  if (!options.use_cache) return open_unnamed(path, options, *source, progress);

  const fs::path folder = options.cache_dir.empty() ? default_cache_dir() : fs::path(options.cache_dir);
  const std::string stem =
      (folder / fmt::format("{:016x}-{}-{}{}", source->hash, options.up, options.room_size_m, source->variant))
          .string();
  const std::string name = stem + ".mesh", part = stem + ".part";
  if (auto content = open_existing(name)) return make_store(std::move(*content), path, true);

  std::error_code error;
  fs::create_directories(folder, error);
  // One process at a time makes this store; others wait for it here and then find it. The lock ends with its holder.
  const Descriptor lock(::open((stem + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (!lock.valid() || flock(lock.get(), LOCK_EX) != 0) {
    log::warn("cache folder {} cannot be written ({}); going on without", folder.string(), std::strerror(errno));
    return open_unnamed(path, options, *source, progress);
  }
  auto content = open_existing(name);
  if (content) return make_store(std::move(*content), path, true);
  if (fs::exists(name, error)) {
    log::warn("{}; making it anew", content.error().text);
    fs::remove(name, error);
  }
  {
    const Descriptor out(::open(part.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (!out.valid()) {
      log::warn("{} cannot be written ({}); going on without a cache", part, std::strerror(errno));
      return open_unnamed(path, options, *source, progress);
    }
    const Status built = build_store(out.get(), path, options, *source, progress);
    if (!built.ok() || std::rename(part.c_str(), name.c_str()) != 0) {
      const std::string reason =
          built.ok() ? fmt::format("{}: cannot be renamed: {}", part, std::strerror(errno)) : built.error().text;
      fs::remove(part, error);
      return Error{reason};
    }
  }
  content = open_existing(name);
  if (!content) return content.error();
  return make_store(std::move(*content), path, false);
}

}  // namespace telesplat::data
