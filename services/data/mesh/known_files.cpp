#include "services/data/mesh/known_files.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <optional>
#include <string_view>

#include "common/core/descriptor.h"
#include "services/data/base/mesh.h"
#include "services/data/mesh/cache.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

constexpr ssize_t kMostText = 1 << 16;  // bytes of the record: about 1200 hashes
constexpr uint64_t kBlocks = 64, kBlock = 4096;

double seconds(const timespec& t) { return double(t.tv_sec) + double(t.tv_nsec) * 1e-9; }

// Files, as far as they are known without reading all of them.
struct Facts {
  uint64_t key = 0;  // a hash of devices, inodes, sizes, times and blocks
  uint64_t bytes = 0;
  double changed_s = 0;  // time of the last change, seconds since 1970
};

// Adds a file's facts to the key. The time of change is that of the inode, too, which no program can set back.
void add_file(const std::string& path, Facts& to) {
  const auto mix = [&](const void* data, size_t bytes) { to.key = XXH3_64bits_withSeed(data, bytes, to.key); };
  const auto file = Descriptor::open_file(path, O_RDONLY | O_NONBLOCK);
  struct stat s {};
  if (!file.valid() || fstat(file.get(), &s) != 0 || !S_ISREG(s.st_mode)) return mix("-", 1);
  const auto size = static_cast<uint64_t>(s.st_size);
  const std::array<uint64_t, 7> about{s.st_dev,
                                      s.st_ino,
                                      size,
                                      static_cast<uint64_t>(s.st_mtim.tv_sec),
                                      static_cast<uint64_t>(s.st_mtim.tv_nsec),
                                      static_cast<uint64_t>(s.st_ctim.tv_sec),
                                      static_cast<uint64_t>(s.st_ctim.tv_nsec)};
  mix(about.data(), sizeof about);
  to.bytes += size;
  to.changed_s = std::max({to.changed_s, seconds(s.st_mtim), seconds(s.st_ctim)});
  std::array<char, kBlock> block;
  const uint64_t last = size > kBlock ? size - kBlock : 0;
  for (uint64_t i = 0; i < kBlocks; ++i) {
    const uint64_t at = last * i / (kBlocks - 1);
    const ssize_t n = pread(file.get(), block.data(), block.size(), static_cast<off_t>(at));
    mix(block.data(), n > 0 ? static_cast<size_t>(n) : 0);
  }
}

Facts known_facts(const std::vector<std::string>& paths) {
  Facts out;
  for (const std::string& path : paths) add_file(path, out);
  return out;
}

std::string line_of(uint64_t key, uint64_t hash) {
  const std::array<uint64_t, 2> both{key, hash};
  return fmt::format("{:016x} {:016x} {:016x}\n", key, hash, XXH3_64bits(both.data(), sizeof both));
}

// Returns the record's text; empty: it does not exist, or the file is foreign.
std::string text_of(const std::string& path) {
  const auto file = Descriptor::open_file(path, O_RDONLY | O_NONBLOCK);
  std::string text(2 * kMostText, '\0');
  const ssize_t n = file.valid() ? pread(file.get(), text.data(), text.size(), 0) : 0;
  text.resize(static_cast<size_t>(std::max<ssize_t>(n, 0)));
  return text.starts_with(kKnownBegin) ? text : std::string();
}

std::optional<uint64_t> recorded_hash(const std::string& text, uint64_t key) {
  const std::string begin = fmt::format("{:016x} ", key);
  for (size_t at = text.find(begin); at != text.npos; at = text.find(begin, at + 1)) {
    uint64_t hash = 0;
    const char* digits = text.data() + at + begin.size();
    std::from_chars(digits, std::min(digits + 16, text.data() + text.size()), hash, 16);
    if (const std::string line = line_of(key, hash); text.compare(at, line.size(), line) == 0) return hash;
  }
  return std::nullopt;
}

void remember(const std::string& folder, const std::string& line) {
  std::error_code ignored;
  fs::create_directories(folder, ignored);
  const std::string path = fs::path(folder) / kKnownFile;
  const auto out = Descriptor::open_file(path, O_WRONLY | O_CREAT | O_APPEND | O_NONBLOCK);
  struct stat s {};
  if (!out.valid() || fstat(out.get(), &s) != 0) return;
  if (s.st_size > 0 && text_of(path).empty()) return;  // it is foreign
  const bool anew = s.st_size == 0 || (s.st_size > kMostText && ftruncate(out.get(), 0) == 0);
  const std::string text = anew ? std::string(kKnownBegin) + line : line;
  (void)!::write(out.get(), text.data(), text.size());  // a line that is cut off counts for nothing
}

}  // namespace

uint64_t hash_known_files(const std::vector<std::string>& paths, const HashMemory& memory, const Progress& progress) {
  const auto read = [&] { return memory.never_read ? 0 : hash_files(paths, progress); };
  if (memory.folder.empty()) return read();
  const Facts before = known_facts(paths);
  std::error_code error;
  const bool is_private = !fs::exists(memory.folder, error) || problem_of_shared_place(memory.folder).empty();
  if (before.bytes < memory.least_bytes || !is_private) return read();
  if (const auto known = recorded_hash(text_of(fs::path(memory.folder) / kKnownFile), before.key)) {
    progress(kIdentifying, 1.0);
    return *known;
  }
  const uint64_t hash = read();
  if (memory.never_read) return hash;
  const std::chrono::duration<double> now = std::chrono::system_clock::now().time_since_epoch();
  if (now.count() - before.changed_s >= memory.settled_s && known_facts(paths).key == before.key)
    remember(memory.folder, line_of(before.key, hash));
  return hash;
}

void forget_files(const std::string& folder) {
  const std::string path = fs::path(folder) / kKnownFile;
  std::error_code ignored;
  if (!text_of(path).empty()) fs::remove(path, ignored);
}

}  // namespace telesplat::data
