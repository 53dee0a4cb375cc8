// The folder in which chunk stores are kept: what lies there, when it was last used, how large it may grow.
//
//   STEM.mesh   a store (store_file.h); whoever has it open holds a shared lock (flock) on it
//   STEM.used   text: the file it was last opened for, then what it holds; its time is when that was
//   STEM.lock   locked by the process that makes the store
//   STEM.part   a store that is being made, or was when its process died
//   limit       text: bytes that all stores may have together
//
// STEM begins with 16 hexadecimal digits and a dash. Nothing else in the folder is ours, and nothing else is removed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::data {

/// Where stores are kept unless --cache says otherwise: $XDG_CACHE_HOME/telesplat, else ~/.cache/telesplat.
std::string default_cache_folder();
/// What is wrong with a folder among those of all users (in /tmp): it is another's, or others may write into it. Empty:
/// nothing, or it is elsewhere.
std::string problem_of_shared_place(const std::string& folder);

struct CachedStore {
  std::string stem;     ///< path without ".mesh"
  std::string source;   ///< the file it was last opened for; empty: not known
  std::string content;  ///< "ply, 586 k triangles"; empty: not known
  uint64_t bytes = 0;
  double used_s = 0;      ///< when it was last opened, seconds since 1970
  bool in_use = false;    ///< by a process that lives
  bool finished = false;  ///< false: its process died while it made it, or makes it now (in_use)
};

/// Those that were unused for longest first. A folder that is not there holds none. Error: it cannot be read.
Result<std::vector<CachedStore>> cached_stores(const std::string& folder);

/// Notes that a store is used now. Where nothing can be written nothing is noted.
void note_use(const std::string& stem, const std::string& source, const std::string& content);

struct Removal {
  size_t stores = 0, in_use = 0;  ///< gone; left because somebody uses them
  uint64_t bytes = 0;             ///< that are free now
};
/// Removes every store that nobody uses. The limit stays.
Result<Removal> clear_cache(const std::string& folder);
/// Removes stores that nobody uses, those unused for longest first, until the rest has at most `limit` bytes; without a
/// limit all.
Result<Removal> bound_cache(const std::string& folder, std::optional<uint64_t> limit);

/// Bytes; empty: there is none.
std::optional<uint64_t> cache_limit(const std::string& folder);
/// Remembers it in the folder, which is made if it is not there. nullopt: there is none from now on.
Status set_cache_limit(const std::string& folder, std::optional<uint64_t> limit);

/// Once a store was made: keeps to the limit. Tells in one line what the folder holds, where stores were removed for
/// the limit, or where it has none and holds a gigabyte or more.
std::string after_growth(const std::string& folder);

/// "1.7 GB", and the other way round: "20GB", "1.5 TB", "500M", "1000".
std::string size_text(uint64_t bytes);
Result<uint64_t> parse_size(const std::string& text);
/// ~/ for the home folder.
std::string short_path(const std::string& path);

}  // namespace telesplat::data
