#include "services/data/mesh/cache.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>

#include "common/core/descriptor.h"
#include "services/data/mesh/known_files.h"
#include "services/data/mesh/store_file.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLimitFile = "limit";
constexpr uint64_t kWorthAWord = 1'000'000'000;  // a cache without a limit is reported from this size on, bytes
constexpr size_t kMostLine = 8192;               // bytes of a .used file that are read

// Returns the stem of a store's file; empty: the file is foreign.
std::string stem_of(const fs::directory_entry& entry) {
  std::error_code error;
  if (!fs::is_regular_file(entry.symlink_status(error))) return {};
  const std::string name = entry.path().filename().string();
  constexpr size_t kDigits = 16;
  if (name.find_first_not_of("0123456789abcdef") != kDigits || name[kDigits] != '-') return {};
  const std::string kind = entry.path().extension().string();
  if (kind != ".mesh" && kind != ".part" && kind != ".lock" && kind != ".used") return {};
  if (kind == ".mesh") {
    uint64_t magic = 0;
    std::ifstream(entry.path(), std::ios::binary).read(reinterpret_cast<char*>(&magic), sizeof magic);
    if (magic != kStoreMagic) return {};
  }
  return (entry.path().parent_path() / entry.path().stem()).string();
}

std::string line_of(std::istream& in) {
  std::string out;
  std::getline(in, out);
  return out.size() > kMostLine ? std::string() : out;
}

// Reads size and time of a file; false: it does not exist.
bool look_at(const std::string& path, uint64_t& bytes, double& time_s) {
  struct stat s {};
  if (stat(path.c_str(), &s) != 0) return false;
  bytes = uint64_t(s.st_size);
  time_s = double(s.st_mtim.tv_sec) + double(s.st_mtim.tv_nsec) * 1e-9;
  return true;
}

/// Locks a store that no other process uses or makes, as long as this object lives.
class Reserved {
 public:
  explicit Reserved(const std::string& stem)
      : made_(Descriptor::open_file(stem + ".lock", O_RDWR | O_CREAT)),
        store_(Descriptor::open_file(stem + ".mesh", O_RDONLY)) {
    holds_ = made_.lock(LOCK_EX | LOCK_NB) && (!store_.valid() || store_.lock(LOCK_EX | LOCK_NB));
  }
  bool holds() const { return holds_; }

 private:
  Descriptor made_, store_;
  bool holds_;
};

// Checks the locks without making files.
bool is_in_use(const std::string& stem) {
  const auto held = [](const std::string& path) {
    const auto file = Descriptor::open_file(path, O_RDONLY);
    return file.valid() && !file.lock(LOCK_EX | LOCK_NB);
  };
  return held(stem + ".mesh") || held(stem + ".lock");
}

CachedStore look_at_store(const std::string& stem) {
  CachedStore out{.stem = stem};
  uint64_t part_bytes = 0, ignored_bytes = 0;
  double part_s = 0;
  out.finished = look_at(stem + ".mesh", out.bytes, out.used_s);
  if (look_at(stem + ".part", part_bytes, part_s)) out.bytes += part_bytes;
  if (!out.finished) out.used_s = part_s;
  look_at(stem + ".used", ignored_bytes, out.used_s);
  std::ifstream used(stem + ".used");
  out.source = line_of(used);
  out.content = line_of(used);
  out.in_use = is_in_use(stem);
  return out;
}

// False: a process uses the store.
bool remove_store(const std::string& stem) {
  const Reserved reserved(stem);
  if (!reserved.holds()) return false;
  std::error_code error;
  for (const char* kind : {".mesh", ".part", ".used", ".lock"}) fs::remove(stem + kind, error);
  return true;
}

}  // namespace

std::string default_cache_folder() {
  if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg && *xdg) return fs::path(xdg) / "telesplat";
  if (const char* home = std::getenv("HOME"); home && *home) return fs::path(home) / ".cache" / "telesplat";
  return fs::temp_directory_path() / fmt::format("telesplat-{}", getuid());
}

std::string problem_of_shared_place(const std::string& folder) {
  std::error_code error;
  if (fs::path(folder).parent_path() != fs::temp_directory_path(error)) return {};
  struct stat about {};
  if (lstat(folder.c_str(), &about) != 0) return std::strerror(errno);
  if (!S_ISDIR(about.st_mode)) return "is no folder";
  if (about.st_uid != geteuid()) return fmt::format("belongs to user {}", about.st_uid);
  if ((about.st_mode & (S_IWGRP | S_IWOTH)) != 0) return "others may write into it";
  return {};
}

Result<std::vector<CachedStore>> cached_stores(const std::string& folder) {
  std::vector<CachedStore> out;
  std::error_code error;
  if (!fs::exists(folder, error)) return out;
  std::set<std::string> stems;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (const std::string stem = stem_of(*it); !stem.empty()) stems.insert(stem);
  if (error) return Error{fmt::format("{}: {}", folder, error.message())};
  for (const auto& stem : stems)
    if (CachedStore store = look_at_store(stem); store.finished || store.bytes > 0 || store.in_use)
      out.push_back(std::move(store));
  std::stable_sort(out.begin(), out.end(),
                   [](const CachedStore& a, const CachedStore& b) { return a.used_s < b.used_s; });
  return out;
}

void note_use(const std::string& stem, const std::string& source, const std::string& content) {
  std::error_code error;
  std::string path = fs::absolute(source, error).lexically_normal().string();
  std::replace(path.begin(), path.end(), '\n', ' ');
  const std::string part = fmt::format("{}.used-{}", stem, getpid());
  const Descriptor out = Descriptor::open_file(part, O_WRONLY | O_CREAT | O_TRUNC);
  const std::string text = path + '\n' + content + '\n';
  const bool written = out.valid() && ::write(out.get(), text.data(), text.size()) == ssize_t(text.size());
  if (written) fs::rename(part, stem + ".used", error);
  if (out.valid() && (!written || error)) fs::remove(part, error);
}

Result<Removal> clear_cache(const std::string& folder) {
  auto out = bound_cache(folder, std::nullopt);
  if (!out) return out;
  forget_files(folder);
  // Remove locks and notes whose store is gone already.
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (const std::string stem = stem_of(*it); !stem.empty() && !is_in_use(stem)) remove_store(stem);
  return out;
}

Result<Removal> bound_cache(const std::string& folder, std::optional<uint64_t> limit) {
  const auto stores = cached_stores(folder);
  if (!stores) return stores.error();
  uint64_t bytes = 0;
  for (const CachedStore& store : *stores) bytes += store.bytes;
  Removal out;
  for (const CachedStore& store : *stores) {
    if (limit && bytes <= *limit) break;
    if (!remove_store(store.stem)) {
      ++out.in_use;
      continue;
    }
    bytes -= store.bytes;
    out.bytes += store.bytes;
    ++out.stores;
  }
  return out;
}

std::optional<uint64_t> cache_limit(const std::string& folder) {
  std::ifstream in(fs::path(folder) / kLimitFile);
  const auto limit = parse_size(line_of(in));
  return limit ? std::optional(*limit) : std::nullopt;
}

Status set_cache_limit(const std::string& folder, std::optional<uint64_t> limit) {
  const fs::path path = fs::path(folder) / kLimitFile;
  std::error_code error;
  if (!limit) {
    fs::remove(path, error);
  } else {
    fs::create_directories(folder, error);
    if (!error && !(std::ofstream(path) << *limit << '\n').flush())
      error = std::make_error_code(std::errc::permission_denied);
  }
  return error ? Status(Error{fmt::format("{}: {}", path.string(), error.message())}) : ok_status();
}

std::string after_growth(const std::string& folder) {
  const auto limit = cache_limit(folder);
  const auto removed = limit ? bound_cache(folder, *limit) : Removal{};
  const auto stores = cached_stores(folder);
  if (!stores) return {};
  uint64_t bytes = 0;
  for (const CachedStore& store : *stores) bytes += store.bytes;
  if (!limit && bytes < kWorthAWord) return {};
  if (limit && !(removed && removed->stores > 0)) return {};
  std::string out =
      fmt::format("the cache holds {} store{}, {}{}, in {}", stores->size(), stores->size() == 1 ? "" : "s",
                  size_text(bytes), limit ? " of at most " + size_text(*limit) : "", short_path(folder));
  if (!limit) return out + "; telesplat cache limit 20GB bounds it";
  return out + fmt::format("; {} unused for longest removed, {}", removed->stores, size_text(removed->bytes));
}

std::string size_text(uint64_t bytes) {
  if (bytes < 1000) return fmt::format("{} bytes", bytes);
  constexpr std::array<const char*, 4> kUnits{"kB", "MB", "GB", "TB"};
  double value = double(bytes) / 1000;
  size_t unit = 0;
  for (; value >= 999.5 && unit + 1 < kUnits.size(); ++unit) value /= 1000;
  const std::string number = value < 9.95 ? fmt::format("{:.1f}", value) : fmt::format("{:.0f}", value);
  return fmt::format("{} {}", number.ends_with(".0") ? number.substr(0, number.size() - 2) : number, kUnits[unit]);
}

Result<uint64_t> parse_size(const std::string& text) {
  const Error wrong{"is not a size such as 20GB, 500MB or 1.5TB"};
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || !std::isfinite(value) || value < 0) return wrong;
  std::string unit;
  for (const char* p = stop; p != end; ++p)
    if (*p != ' ') unit += char(std::tolower(static_cast<unsigned char>(*p)));
  if (unit.ends_with('b')) unit.pop_back();
  constexpr std::array<std::string_view, 5> kUnits{"", "k", "m", "g", "t"};
  const auto found = std::find(kUnits.begin(), kUnits.end(), unit);
  if (found == kUnits.end()) return wrong;
  value *= std::pow(1000.0, double(found - kUnits.begin()));
  if (value > 1e18) return wrong;
  return uint64_t(std::llround(value));
}

std::string short_path(const std::string& path) {
  const char* home = std::getenv("HOME");
  const std::string in_home = home && *home ? std::string(home) + "/" : "";
  return !in_home.empty() && path.starts_with(in_home) ? "~/" + path.substr(in_home.size()) : path;
}

}  // namespace telesplat::data
