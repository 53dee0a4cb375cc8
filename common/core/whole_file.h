// Files that are read or written as a whole: descriptions, settings, tables. They may be anything by now, or a
// stranger's.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>

#include "common/core/result.h"

namespace telesplat {

/// Of a file that people write: a scene, a display's description.
inline constexpr uint64_t kMostDescriptionBytes = uint64_t{1} << 20;
/// Of session.toml, in which everyone who took part in a run stands.
inline constexpr uint64_t kMostSessionBytes = uint64_t{64} << 20;
/// Of a table that a run wrote row by row, or of a trajectory, which may be such a table.
inline constexpr uint64_t kMostTableBytes = uint64_t{4} << 30;

/// All that is in a file. Error: it cannot be opened, it is a folder or no regular file (one that never ends, or a pipe
/// that nobody writes into, is not waited for), or it has more than `most_bytes`, also if it grows while it is read.
Result<std::string> read_whole(const std::string& path, uint64_t most_bytes);

/// The same refusals for a file that is about to be read in pieces.
Status check_readable(const std::string& path, uint64_t most_bytes);

/// Makes a new and empty file beside `path`, to be written and then to take its place: its name, which nobody had. What
/// lay there, a symbolic link too, is left as it is. Error: none can be made.
Result<std::string> new_part(const std::string& path);

/// Writes a file as a whole: whoever looks sees the one before, or all of it. What is written goes into a new file
/// beside it, which takes its place: never through a symbolic link, nor into a file that lay there. mode: of the new
/// file, without what the process' mask takes away. Error: it cannot be written.
Status write_whole(const std::string& path, std::string_view text, unsigned mode = 0666);

/// Mode of files that are for their user alone.
inline constexpr unsigned kPrivate = 0600;
/// Makes a folder, and those above it that are not there, for the user alone. One that is there stays as it is.
std::error_code make_private_folder(const std::string& path);

}  // namespace telesplat
