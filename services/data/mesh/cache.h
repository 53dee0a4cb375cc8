// The folder of chunk stores: its content, each store's last use, and its limit.
//
//     STEM.mesh   a store (store_file.h); a process that has it open holds a shared lock (flock) on it
//     STEM.used   text: the file it was last opened for, then its content; the file's time is that of the last use
//     STEM.lock   locked by the process that makes the store
//     STEM.part   a store that is being made, or whose maker died
//     limit       text: bytes that all stores together may have
//     content-hashes   text: the content hashes of large files (known_files.h); not counted by the limit
//
// STEM begins with 16 hexadecimal digits and a dash. All other files in the folder are foreign and are never removed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::data {

/// Returns the folder of stores unless --cache sets it: $XDG_CACHE_HOME/telesplat, else ~/.cache/telesplat.
std::string default_cache_folder();
/// Returns the problem of a folder in a place of all users (/tmp): it is another user's, or others may write into it.
/// Empty: no problem, or it is elsewhere.
std::string problem_of_shared_place(const std::string& folder);

struct CachedStore {
  std::string stem;     ///< path without ".mesh"
  std::string source;   ///< the file it was last opened for; empty: not known
  std::string content;  ///< "ply, 586 k triangles"; empty: not known
  uint64_t bytes = 0;
  double used_s = 0;      ///< time of the last use, seconds since 1970
  bool in_use = false;    ///< a running process has it open or makes it
  bool finished = false;  ///< false: its maker died, or still makes it (in_use)
};

/// Returns the stores, least recently used first; none if the folder does not exist. Error: it cannot be read.
Result<std::vector<CachedStore>> cached_stores(const std::string& folder);

/// Notes a use of the store now; does nothing if the folder cannot be written to.
void note_use(const std::string& stem, const std::string& source, const std::string& content);

struct Removal {
  size_t stores = 0, in_use = 0;  ///< removed; left because a process uses them
  uint64_t bytes = 0;             ///< freed bytes
};
/// Removes every store that no process uses. The limit stays.
Result<Removal> clear_cache(const std::string& folder);
/// Removes unused stores, least recently used first, until the rest has at most `limit` bytes; without a limit, all
/// unused stores.
Result<Removal> bound_cache(const std::string& folder, std::optional<uint64_t> limit);

/// Returns the limit in bytes; nullopt: no limit.
std::optional<uint64_t> cache_limit(const std::string& folder);
/// Writes the limit into the folder, which is made if missing. nullopt: removes the limit.
Status set_cache_limit(const std::string& folder, std::optional<uint64_t> limit);

/// Call it after a store was made: removes stores beyond the limit. Returns a line on the folder's size if stores were
/// removed, or if it has no limit and holds a gigabyte or more; else an empty text.
std::string after_growth(const std::string& folder);

/// Converts bytes to "1.7 GB", and back: "20GB", "1.5 TB", "500M", "1000".
std::string size_text(uint64_t bytes);
Result<uint64_t> parse_size(const std::string& text);
/// Returns the path with ~/ for the home folder.
std::string short_path(const std::string& path);

}  // namespace telesplat::data
