// `telesplat cache list|clear|limit`: stores of chunks that data sets leave on disk.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "common/core/utf8.h"
#include "common/options/complain.h"
#include "services/data/mesh/cache.h"
#include "tools/telesplat/command.h"

namespace telesplat::launcher {
namespace {

struct CacheOptions {
  std::string folder;  ///< empty: the user's cache folder
  std::string limit;
};

options::Row folder_row(CacheOptions& o) {
  return {.flag = "--cache",
          .value = &o.folder,
          .help = "folder of the chunk stores; default: telesplat in the user's cache folder"};
}

options::Table table(CacheOptions& o) { return {folder_row(o)}; }

options::Table limit_table(CacheOptions& o) {
  return {{.flag = "size",
           .value = &o.limit,
           .help = "bytes that all stores may have together, such as 20GB or 500MB; none: as many as there are; "
                   "without it the limit is told"},
          folder_row(o)};
}

std::string folder_of(const CacheOptions& o) { return o.folder.empty() ? data::default_cache_folder() : o.folder; }

double now_s() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }

// Writes an age as text: "3 hours ago".
std::string ago(double seconds) {
  if (seconds < 60) return "just now";
  for (const auto& [unit_s, name] : {std::pair{86400.0, "day"}, {3600.0, "hour"}, {60.0, "minute"}}) {
    if (seconds < unit_s) continue;
    const auto count = int64_t(seconds / unit_s);
    return fmt::format("{} {}{} ago", count, name, count == 1 ? "" : "s");
  }
  return "just now";
}

std::string limit_text(const std::string& folder) {
  const auto limit = data::cache_limit(folder);
  return limit ? fmt::format("limit {}", data::size_text(*limit)) : std::string("no limit");
}

std::string count_text(size_t stores) { return fmt::format("{} store{}", stores, stores == 1 ? "" : "s"); }

void say(const std::string& text) { std::fputs((text + "\n").c_str(), stdout); }

int list(CacheOptions o, const options::Given&) {
  const std::string folder = folder_of(o);
  auto stores = data::cached_stores(folder);
  if (!stores) return complain(stores.error());
  std::reverse(stores->begin(), stores->end());
  uint64_t bytes = 0;
  for (const auto& s : *stores) {
    if (bytes == 0) say(fmt::format("{:>9}  {:<15}  {}", "size", "last used", "made of"));
    bytes += s.bytes;
    std::string what = s.source.empty() ? "a file that is not known" : to_utf8(data::short_path(s.source));
    if (!s.content.empty()) what += fmt::format(" ({})", to_utf8(s.content));
    if (!s.finished) what += s.in_use ? " (is being made)" : " (unfinished)";
    say(fmt::format("{:>9}  {:<15}  {}", data::size_text(s.bytes),
                    s.in_use ? "in use" : ago(std::max(0.0, now_s() - s.used_s)), what));
  }
  say(fmt::format("{}, {}, in {}; {}", count_text(stores->size()), data::size_text(bytes), data::short_path(folder),
                  limit_text(folder)));
  return 0;
}

int tell(const Result<data::Removal>& removed, const std::string& folder) {
  if (!removed) return complain(removed.error());
  std::string text = fmt::format("{} removed from {}, {} free", count_text(removed->stores), data::short_path(folder),
                                 data::size_text(removed->bytes));
  if (removed->in_use > 0) text += fmt::format("; {} in use left", count_text(removed->in_use));
  say(text);
  return 0;
}

int clear(CacheOptions o, const options::Given&) { return tell(data::clear_cache(folder_of(o)), folder_of(o)); }

int limit(CacheOptions o, const options::Given&) {
  const std::string folder = folder_of(o);
  if (o.limit.empty()) {
    say(limit_text(folder));
    return 0;
  }
  std::optional<uint64_t> bytes;
  if (o.limit != "none") {
    const auto size = data::parse_size(o.limit);
    if (!size) return complain({fmt::format("size {}: {}", o.limit.substr(0, 80), size.error().text)});
    bytes = *size;
  }
  if (const Status s = data::set_cache_limit(folder, bytes); !s) return complain(s.error());
  say(limit_text(folder));
  return bytes ? tell(data::bound_cache(folder, *bytes), folder) : 0;
}

}  // namespace

Command cache_command() {
  Command out{.name = "cache", .help = "the chunk stores that meshes leave on disk", .table = {}, .run = {}};
  out.commands = {
      make_command("list", "what lies there, of which file, how large, when it was last used", table, list),
      make_command("clear", "remove all stores that no process uses", table, clear),
      make_command("limit", "bound what lies there: those unused for longest go first, now and whenever one is made",
                   limit_table, limit)};
  return out;
}

}  // namespace telesplat::launcher
