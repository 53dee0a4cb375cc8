#include "services/data/mesh/store_file.h"

#include <fmt/format.h>
#include <unistd.h>
#include <xxhash.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <sstream>

#include "common/parallel/in_parallel.h"
#include "services/data/mesh/surfels.h"

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
  uint64_t surfels_offset = 0, surfels_bytes = 0, surfels_checksum = 0;
  uint64_t arrays_offset = 0, arrays_bytes = 0;
  uint64_t lines_bytes = 0;  ///< after the arrays
  uint64_t checksum = 0;     ///< over all fields above and the table of contents
};
static_assert(sizeof(StoreHeader) <= kPage);

struct StoreEntry {
  uint64_t offset = 0, bytes = 0, triangles = 0, checksum = 0;
  geometry::Box box_room;
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

// False: the bytes cannot be read.
bool read_at(int descriptor, std::span<std::byte> to, size_t offset) {
  while (!to.empty()) {
    const ssize_t n = pread(descriptor, to.data(), to.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    to = to.subspan(static_cast<size_t>(n)), offset += static_cast<size_t>(n);
  }
  return true;
}

// Makes the surfels of the chunks that the file holds.
std::vector<std::byte> surfels_of(int descriptor, const MeshFigures& figures, std::span<const StoreEntry> entries) {
  const auto chunk = [&](size_t i, std::vector<uint64_t>& buffer) {
    buffer.resize((entries[i].bytes + 7) / 8);
    const auto bytes = std::as_writable_bytes(std::span(buffer)).first(entries[i].bytes);
    if (!read_at(descriptor, bytes, entries[i].offset)) std::memset(bytes.data(), 0, bytes.size());
    const auto view = geometry::MeshChunkView::validate(bytes);
    return view ? *view : geometry::MeshChunkView{};
  };
  const std::atomic<bool> never{false};
  return make_surfels({figures.box_room, figures.triangles, entries.size(), chunk}, stored_surfels(figures.triangles),
                      never);
}

}  // namespace

Status write_store(int descriptor, const std::string& name, const PlacedMesh& mesh, const MeshStoreInfo& info,
                   const Progress& progress) {
  progress(kSortingIntoChunks, 0.0);
  const ChunkPlan plan = plan_chunks(mesh);
  if (plan.chunks() > geometry::kMaxChunks)
    return Error{
        fmt::format("{}: would be split into {} chunks, the limit is {}", name, plan.chunks(), geometry::kMaxChunks)};
  progress(kSortingIntoChunks, 1.0);
  std::vector<StoreEntry> entries(plan.chunks());
  std::atomic<size_t> end = kPage + round_up(entries.size() * sizeof(StoreEntry));
  std::atomic<int> failure = 0;

  // Batches, so that this thread reports progress; a chunk gets its place in the file when its size is known.
  constexpr size_t kBatch = 16;
  for (size_t first = 0; first < plan.chunks() && failure == 0; first += kBatch) {
    progress(kWritingTheStore, static_cast<double>(first) / static_cast<double>(plan.chunks()));
    in_parallel(first, std::min(first + kBatch, plan.chunks()), [&](size_t i) {
      const auto triangles = std::span(plan.order).subspan(plan.begin[i], plan.begin[i + 1] - plan.begin[i]);
      const std::vector<std::byte> bytes = make_chunk(mesh, triangles);
      StoreEntry& entry = entries[i];
      std::memcpy(&entry.box_room, bytes.data() + offsetof(geometry::ChunkHeader, lo), sizeof entry.box_room);
      entry.bytes = bytes.size();
      entry.triangles = triangles.size();
      entry.checksum = XXH3_64bits(bytes.data(), bytes.size());
      entry.offset = end.fetch_add(round_up(bytes.size()));
      if (const int error = write_at(descriptor, bytes.data(), bytes.size(), entry.offset)) failure = error;
    });
  }

  StoreHeader header{.chunks = static_cast<uint32_t>(entries.size()), .figures = info};
  progress(kMakingSurfels, 0.0);
  const auto surfels = failure == 0 ? surfels_of(descriptor, info, entries) : std::vector<std::byte>();
  header.surfels_offset = end.fetch_add(round_up(surfels.size())), header.surfels_bytes = surfels.size();
  header.surfels_checksum = XXH3_64bits(surfels.data(), surfels.size());
  if (failure == 0) failure = write_at(descriptor, surfels.data(), surfels.size(), header.surfels_offset);
  std::string texts = scene::to_text(info.arrays);
  header.arrays_offset = end, header.arrays_bytes = texts.size();
  for (const std::string& line : {info.format, info.up, info.up_reason, info.array, scene::to_text(info.coordinates)})
    texts += line + "\n";
  for (const std::string& note : info.notes) texts += note + "\n";
  header.lines_bytes = texts.size() - header.arrays_bytes;
  header.file_bytes = end + round_up(texts.size());
  header.checksum = checksum_of(header, entries, texts);
  if (failure == 0 && ftruncate(descriptor, static_cast<off_t>(header.file_bytes)) != 0) failure = errno;
  if (failure == 0) failure = write_at(descriptor, entries.data(), entries.size() * sizeof(StoreEntry), kPage);
  if (failure == 0) failure = write_at(descriptor, texts.data(), texts.size(), header.arrays_offset);
  if (failure == 0) failure = write_at(descriptor, &header, sizeof header, 0);
  if (failure != 0)
    return Error{fmt::format("{}: chunk store of {} bytes cannot be written: {}", name, header.file_bytes,
                             std::strerror(failure))};
  progress(kWritingTheStore, 1.0);
  return ok_status();
}

Result<StoreContent> read_store(int descriptor, const std::string& name) {
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

  const uint64_t surfels = header.surfels_offset <= bytes.size() ? bytes.size() - header.surfels_offset : 0;
  if (header.surfels_bytes > surfels || header.surfels_offset % kPage != 0)
    return Error{fmt::format("{}: the surfels lie outside their store", name)};
  StoreContent out{*mapped, {header.figures}, {}, {}, bytes.subspan(header.surfels_offset, header.surfels_bytes)};
  if (XXH3_64bits(out.surfels.data(), out.surfels.size()) != header.surfels_checksum)
    return Error{fmt::format("{}: the surfels of the store are damaged", name)};
  out.info.arrays = *std::move(arrays);
  std::istringstream lines{std::string(texts.substr(header.arrays_bytes))};
  std::string coordinates_text;
  for (std::string* line : {&out.info.format, &out.info.up, &out.info.up_reason, &out.info.array, &coordinates_text})
    std::getline(lines, *line);
  for (std::string note; std::getline(lines, note);) out.info.notes.push_back(note);
  auto coordinates = scene::coordinates_from_text(coordinates_text);
  if (!coordinates) return Error{fmt::format("{}: {}", name, coordinates.error().text)};
  out.info.coordinates = *std::move(coordinates);
  for (size_t i = 0; i < entries.size(); ++i) {
    const StoreEntry& e = entries[i];
    if (e.offset % kPage != 0 || e.offset > bytes.size() || e.bytes > bytes.size() - e.offset)
      return Error{fmt::format("{}: chunk {} lies outside its store", name, i)};
    out.chunks.push_back({ChunkId{i}, e.box_room, e.triangles, e.bytes});
    out.offsets.push_back(e.offset);
  }
  std::atomic<size_t> damaged = entries.size();
  in_parallel(size_t{0}, entries.size(), [&](size_t i) {
    if (XXH3_64bits(bytes.data() + entries[i].offset, entries[i].bytes) != entries[i].checksum) damaged = i;
  });
  if (damaged != entries.size())
    return Error{fmt::format("{}: chunk {} of the store is damaged", name, damaged.load())};
  return out;
}

}  // namespace telesplat::data
