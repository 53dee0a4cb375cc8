#include "services/data/mesh/store_file.h"

#include <fmt/format.h>
#include <sys/statvfs.h>
#include <unistd.h>
#include <xxhash.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <deque>
#include <filesystem>
#include <mutex>
#include <sstream>

#include "common/geometry/chunk_code.h"
#include "common/parallel/in_parallel.h"
#include "services/data/mesh/cache.h"
#include "services/data/mesh/levels.h"

namespace telesplat::data {
namespace {

constexpr size_t kPage = 4096;
constexpr size_t round_up(size_t bytes) { return (bytes + kPage - 1) / kPage * kPage; }

struct StoreHeader {
  uint64_t magic = kStoreMagic;
  uint32_t version = kStoreVersion;
  uint32_t chunks = 0;
  uint64_t file_bytes = 0;
  MeshFigures figures;
  uint64_t arrays_offset = 0, arrays_bytes = 0;
  uint64_t lines_bytes = 0;  ///< after the arrays
  uint64_t checksum = 0;     ///< over all fields above and the table of contents
};
static_assert(sizeof(StoreHeader) <= kPage);

struct StoreEntry {
  uint64_t offset = 0, bytes = 0, triangles = 0, checksum = 0;
  geometry::Box box_room;
  float spacing_m = 0;
  uint32_t first_child = 0, children = 0, reserved = 0;
};

uint64_t checksum_of(const StoreHeader& header, std::span<const StoreEntry> entries, std::string_view texts) {
  const uint64_t seed = XXH3_64bits(&header, offsetof(StoreHeader, checksum));
  return XXH3_64bits_withSeed(texts.data(), texts.size(),
                              XXH3_64bits_withSeed(entries.data(), entries.size_bytes(), seed));
}

// Writes all bytes; returns 0 or an errno.
int write_at(int descriptor, const void* data, size_t bytes, size_t offset) {
  const char* p = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t n = pwrite(descriptor, p, bytes, static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return n == 0 ? EIO : errno;
    p += n, offset += static_cast<size_t>(n), bytes -= static_cast<size_t>(n);
  }
  return 0;
}

// Writes chunks behind each other. Threads may write at once; the first failure is kept.
class ChunkWriter {
 public:
  ChunkWriter(int descriptor, size_t begin) : descriptor_(descriptor), end_(begin) {}
  /// Codes a chunk. Returns its entry: a chunk gets its place in the file when its size is known.
  StoreEntry write(std::span<const std::byte> chunk) {
    const auto view = geometry::MeshChunkView::validate(chunk);
    CHECK(view.ok());  // this program made it
    const std::vector<std::byte> coded = geometry::encode_chunk(*view);
    StoreEntry out{.bytes = coded.size(), .triangles = view->triangles(), .box_room = view->box_room};
    out.checksum = XXH3_64bits(coded.data(), coded.size());
    out.offset = put(coded);
    return out;
  }
  /// Returns where the bytes are.
  size_t put(std::span<const std::byte> bytes) {
    const size_t offset = end_.fetch_add(round_up(bytes.size()));
    if (const int error = failure_ ? 0 : write_at(descriptor_, bytes.data(), bytes.size(), offset)) failure_ = error;
    return offset;
  }
  /// Gives the file its length, and writes its begin.
  void finish(const StoreHeader& header, std::span<const StoreEntry> entries, const std::string& texts) {
    if (!failure_ && ftruncate(descriptor_, static_cast<off_t>(header.file_bytes)) != 0) failure_ = errno;
    if (!failure_) failure_ = write_at(descriptor_, entries.data(), entries.size_bytes(), kPage);
    if (!failure_) failure_ = write_at(descriptor_, texts.data(), texts.size(), header.arrays_offset);
    if (!failure_) failure_ = write_at(descriptor_, &header, sizeof header, 0);
  }
  /// Maps what is written so far. Null: there is a failure.
  std::shared_ptr<const MappedFile> written(const std::string& name) {
    if (!failure_ && ftruncate(descriptor_, static_cast<off_t>(end_.load())) != 0) failure_ = errno;
    if (failure_) return nullptr;
    auto out = MappedFile::map(descriptor_, name);
    if (!out) failure_ = ENOMEM;
    return out ? *std::move(out) : nullptr;
  }
  size_t end() const { return end_; }
  int failure() const { return failure_; }

 private:
  int descriptor_;
  std::atomic<size_t> end_;
  std::atomic<int> failure_ = 0;  // errno
};

geometry::HeldChunk chunk_at(const MappedFile& file, const StoreEntry& entry) {
  auto chunk = geometry::decode_chunk(file.bytes().subspan(entry.offset, entry.bytes));
  CHECK(chunk.ok());  // this program wrote it a moment ago
  return *std::move(chunk);
}

// Decodes the chunks of a level. Keeps the last ones, 50 MB: nodes beside each other need the same neighbours.
class DecodedLevel {
 public:
  DecodedLevel(const MappedFile& file, std::span<const StoreEntry> level) : file_(file), level_(level) {}
  /// Threads may call it at once.
  geometry::HeldChunk at(size_t i) {
    {
      const std::lock_guard lock(mutex_);
      for (const auto& [number, chunk] : kept_)
        if (number == i) return chunk;
    }
    geometry::HeldChunk chunk = chunk_at(file_, level_[i]);
    const std::lock_guard lock(mutex_);
    kept_.emplace_back(i, chunk);
    if (kept_.size() > kKept) kept_.pop_front();
    return chunk;
  }

 private:
  static constexpr size_t kKept = 32;
  const MappedFile& file_;
  const std::span<const StoreEntry> level_;
  std::mutex mutex_;
  std::deque<std::pair<size_t, geometry::HeldChunk>> kept_;
};

// Entries of one level.
struct Level {
  size_t begin = 0, end = 0;
  size_t size() const { return end - begin; }
};

// Returns the number of entries of a tree over this many leaves, at most.
size_t entries_above(size_t leaves) {
  size_t all = leaves;
  for (size_t level = leaves; level > 1; all += level) level = (level + kChildren - 1) / kChildren;
  return all;
}

// Adds the levels above the leaves to the entries.
void write_levels(ChunkWriter& out, const std::string& name, std::vector<StoreEntry>& entries,
                  const Progress& progress) {
  Level below{0, entries.size()};
  while (below.size() > 1) {
    const auto file = out.written(name);
    if (!file) break;
    const std::span level(entries.data() + below.begin, below.size());
    std::vector<geometry::Box> boxes;
    std::vector<float> spacings;
    for (const StoreEntry& e : level) boxes.push_back(e.box_room), spacings.push_back(e.spacing_m);
    DecodedLevel decoded(*file, level);
    const LevelBelow chunks{boxes, spacings, [&](size_t i) { return decoded.at(i); }};
    std::vector<StoreEntry> nodes((level.size() + kChildren - 1) / kChildren);
    constexpr size_t kBatch = 8;  // so that this thread reports progress
    for (size_t first = 0; first < nodes.size(); first += kBatch) {
      progress(kMakingLevels, static_cast<double>(kChildren * first) / static_cast<double>(level.size()));
      in_parallel(first, std::min(first + kBatch, nodes.size()), [&](size_t i) {
        const size_t children = std::min(kChildren, level.size() - kChildren * i);
        const CoarseNode made = make_coarse_node(chunks, kChildren * i, kChildren * i + children, kTrianglesPerChunk);
        if (made.chunk.empty()) return;
        nodes[i] = out.write(made.chunk);
        nodes[i].spacing_m = made.spacing_m;
        nodes[i].first_child = static_cast<uint32_t>(below.begin + kChildren * i);
        nodes[i].children = static_cast<uint32_t>(children);
      });
      file->drop_pages();
    }
    std::erase_if(nodes, [](const StoreEntry& e) { return e.children == 0; });
    below = {entries.size(), entries.size() + nodes.size()};
    entries.insert(entries.end(), nodes.begin(), nodes.end());
  }
  progress(kMakingLevels, 1.0);
}

}  // namespace

Status check_room(int descriptor, const std::string& name, uint64_t triangles) {
  struct statvfs system {};
  if (fstatvfs(descriptor, &system) != 0) return ok_status();
  const uint64_t needed = kBytesATriangle * triangles, there = uint64_t{system.f_bavail} * system.f_frsize;
  if (needed <= there) return ok_status();
  std::error_code error;
  const auto file = std::filesystem::read_symlink(fmt::format("/proc/self/fd/{}", descriptor), error);
  return Error{fmt::format("{}: its chunk store takes about {}, {} has {}", name, size_text(needed),
                           error ? "its folder" : file.parent_path().string(), size_text(there))};
}

struct StoreWriter::Parts {
  Parts(int descriptor, std::string store_name, size_t leaves)
      : name(std::move(store_name)),
        entries(leaves),
        out(descriptor, kPage + round_up(entries_above(leaves) * sizeof(StoreEntry))) {}
  std::string name;
  std::vector<StoreEntry> entries;
  ChunkWriter out;
};

StoreWriter::StoreWriter(int descriptor, std::string name, size_t leaves)
    : parts_(std::make_unique<Parts>(descriptor, std::move(name), leaves)) {}
StoreWriter::StoreWriter(StoreWriter&&) noexcept = default;
StoreWriter::~StoreWriter() = default;

Result<StoreWriter> StoreWriter::begin(int descriptor, const std::string& name, size_t leaves) {
  if (entries_above(leaves) > geometry::kMaxChunks)
    return Error{fmt::format("{}: would be split into {} chunks, the limit is {}", name, entries_above(leaves),
                             geometry::kMaxChunks)};
  return StoreWriter(descriptor, name, leaves);
}

void StoreWriter::write_leaves(size_t first, const PlacedMesh& mesh, const ChunkPlan& plan,
                               const ReadProgress& progress) {
  constexpr size_t kBatch = 16;  // so that this thread reports progress
  for (size_t begin = 0; begin < plan.chunks() && parts_->out.failure() == 0; begin += kBatch) {
    progress(static_cast<double>(begin) / static_cast<double>(plan.chunks()));
    in_parallel(begin, std::min(begin + kBatch, plan.chunks()), [&](size_t i) {
      const auto triangles = std::span(plan.order).subspan(plan.begin[i], plan.begin[i + 1] - plan.begin[i]);
      parts_->entries[first + i] = parts_->out.write(make_chunk(mesh, triangles));
    });
  }
}

geometry::Box StoreWriter::box_room() const {
  geometry::Box out;
  for (const StoreEntry& e : parts_->entries)
    if (e.triangles > 0) out.extend(e.box_room);
  return out;
}

Status StoreWriter::finish(const MeshStoreInfo& info, const Progress& progress) {
  auto& [name, entries, out] = *parts_;
  std::erase_if(entries, [](const StoreEntry& e) { return e.triangles == 0; });
  write_levels(out, name, entries, progress);

  StoreHeader header{.chunks = static_cast<uint32_t>(entries.size()), .figures = info};
  std::string texts = scene::to_text(info.arrays);
  header.arrays_offset = out.end(), header.arrays_bytes = texts.size();
  for (const std::string& line : {info.format, info.up, info.up_reason, info.array, scene::to_text(info.coordinates)})
    texts += line + "\n";
  for (const std::string& note : info.notes) texts += note + "\n";
  header.lines_bytes = texts.size() - header.arrays_bytes;
  header.file_bytes = out.end() + round_up(texts.size());
  header.checksum = checksum_of(header, entries, texts);
  out.finish(header, entries, texts);
  if (out.failure() != 0)
    return Error{fmt::format("{}: chunk store of {} bytes cannot be written: {}", name, header.file_bytes,
                             std::strerror(out.failure()))};
  progress(kWritingTheStore, 1.0);
  return ok_status();
}

Status write_store(int descriptor, const std::string& name, const PlacedMesh& mesh, const MeshStoreInfo& info,
                   const Progress& progress) {
  if (const Status s = check_room(descriptor, name, mesh.indices.size() / 3); !s) return s;
  progress(kSortingIntoChunks, 0.0);
  const ChunkPlan plan = plan_chunks(mesh);
  auto writer = StoreWriter::begin(descriptor, name, plan.chunks());
  if (!writer) return writer.error();
  progress(kSortingIntoChunks, 1.0);
  writer->write_leaves(0, mesh, plan, [&](double fraction) { progress(kWritingTheStore, fraction); });
  return writer->finish(info, progress);
}

bool is_whole(const StoreContent& store, size_t chunk) {
  const auto bytes = store.chunk(chunk);
  return XXH3_64bits(bytes.data(), bytes.size()) == store.checksums[chunk];
}

namespace {

Status check_chunks(const StoreContent& store, const std::string& name) {
  std::atomic<size_t> damaged = store.chunks.size();
  in_parallel(size_t{0}, store.chunks.size(), [&](size_t i) {
    if (!is_whole(store, i)) damaged = i;
    store.file->drop_pages(store.chunk(i));
  });
  if (damaged == store.chunks.size()) return ok_status();
  return Error{fmt::format("{}: chunk {} of the store is damaged", name, damaged.load())};
}

}  // namespace

Result<StoreContent> read_store(int descriptor, const std::string& name, uint64_t most_checked) {
  auto mapped = MappedFile::map(descriptor, name);
  if (!mapped) return mapped.error();
  const auto bytes = (*mapped)->bytes();
  StoreHeader header;
  if (bytes.size() < kPage) return Error{fmt::format("{}: chunk store of {} bytes is truncated", name, bytes.size())};
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.magic != kStoreMagic || header.version != kStoreVersion)
    return Error{fmt::format("{}: is no chunk store of version {}", name, kStoreVersion)};
  if (header.file_bytes != bytes.size())
    return Error{
        fmt::format("{}: chunk store has {} bytes, its header says {}", name, bytes.size(), header.file_bytes)};
  if (header.chunks == 0 || header.chunks > geometry::kMaxChunks ||
      kPage + header.chunks * sizeof(StoreEntry) > bytes.size())
    return Error{fmt::format("{}: chunk store claims {} chunks in {} bytes", name, header.chunks, bytes.size())};
  const std::span entries(reinterpret_cast<const StoreEntry*>(bytes.data() + kPage), header.chunks);
  const uint64_t behind = header.arrays_offset <= bytes.size() ? bytes.size() - header.arrays_offset : 0;
  const bool inside = header.arrays_bytes <= behind && header.lines_bytes <= behind - header.arrays_bytes;
  const std::string_view texts =
      inside ? (*mapped)->text().substr(header.arrays_offset, header.arrays_bytes + header.lines_bytes) : "";
  if (!inside || checksum_of(header, entries, texts) != header.checksum)
    return Error{fmt::format("{}: chunk store's table of contents is damaged", name)};
  auto arrays = scene::arrays_from_text(texts.substr(0, header.arrays_bytes));
  if (!arrays) return Error{fmt::format("{}: {}", name, arrays.error().text)};

  StoreContent out{*mapped, {header.figures}, {}, {}, {}};
  out.info.arrays = *std::move(arrays);
  std::istringstream lines{std::string(texts.substr(header.arrays_bytes))};
  std::string coordinates_text;
  for (std::string* line : {&out.info.format, &out.info.up, &out.info.up_reason, &out.info.array, &coordinates_text})
    std::getline(lines, *line);
  for (std::string note; std::getline(lines, note);) out.info.notes.push_back(note);
  auto coordinates = scene::coordinates_from_text(coordinates_text);
  if (!coordinates) return Error{fmt::format("{}: {}", name, coordinates.error().text)};
  out.info.coordinates = *std::move(coordinates);
  uint64_t chunk_bytes = 0;
  for (size_t i = 0; i < entries.size(); ++i) {
    const StoreEntry& e = entries[i];
    if (e.offset % kPage != 0 || e.offset > bytes.size() || e.bytes > bytes.size() - e.offset)
      return Error{fmt::format("{}: chunk {} lies outside its store", name, i)};
    if (uint64_t{e.first_child} + e.children > i)
      return Error{fmt::format("{}: chunk {} of the store has children that are not before it", name, i)};
    out.chunks.push_back({ChunkId{i}, e.box_room, e.triangles, e.bytes, e.spacing_m, e.first_child, e.children});
    out.offsets.push_back(e.offset), out.checksums.push_back(e.checksum);
    chunk_bytes += e.bytes;
  }
  out.checked = chunk_bytes <= most_checked;
  if (const Status s = out.checked ? check_chunks(out, name) : ok_status(); !s) return s.error();
  return out;
}

}  // namespace telesplat::data
