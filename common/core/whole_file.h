// Reads or writes files as a whole: descriptions, settings, tables. Any content must be expected: files change, and may
// come from strangers.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>

#include "common/core/result.h"

namespace telesplat {

/// Limit of a file that people write: a scene, a display's description.
inline constexpr uint64_t kMostDescriptionBytes = uint64_t{1} << 20;
/// Limit of session.toml, which names every process that took part in a run.
inline constexpr uint64_t kMostSessionBytes = uint64_t{64} << 20;
/// Limit of a table that a run wrote row by row, or of a trajectory, which may be such a table.
inline constexpr uint64_t kMostTableBytes = uint64_t{4} << 30;

/// Returns all bytes of a file. Error: it cannot be opened, it is a folder or no regular file (an endless one, or a
/// pipe without a writer, is not waited for), or it has more than `most_bytes`, also if it grows while it is read.
Result<std::string> read_whole(const std::string& path, uint64_t most_bytes);

/// Makes the same refusals for a file that is about to be read in pieces.
Status check_readable(const std::string& path, uint64_t most_bytes);

/// Makes a new and empty file beside `path` and returns its name, which no file had; the caller fills it and moves it
/// to `path`. Never changes a file or symbolic link that lay there. Error: no file can be made.
Result<std::string> new_part(const std::string& path);

/// Writes a file as a whole: a reader sees the old content, or all of the new. The text goes into a new file beside it,
/// which then takes its place: never through a symbolic link, nor into a file that lay there. mode: permissions of the
/// new file, without those that the process' mask takes away. Error: it cannot be written.
Status write_whole(const std::string& path, std::string_view text, unsigned mode = 0666);

/// Mode of files that are for their user alone.
inline constexpr unsigned kPrivate = 0600;
/// Makes a folder, and those above it that are not there, for the user alone. One that is there stays as it is.
std::error_code make_private_folder(const std::string& path);

}  // namespace telesplat
