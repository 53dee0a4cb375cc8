// Keys of a scene file that only one kind of scene has, and that do not equal flags: tables, arrays.
#pragma once

#include <toml++/toml.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

/// Reads the keys of one kind of scene.
class SceneKeys {
 public:
  virtual ~SceneKeys() = default;

  /// Returns the word in the data file's place; empty: the kind has a data file.
  virtual std::string_view scene() const = 0;
  /// True if a key belongs to this kind. table: the table around it; "": none. node: a value or a table.
  virtual bool owns(std::string_view table, std::string_view name, const toml::node& node) const = 0;
  /// Takes a key that it owns. Errors name the fault and the node's line, not the file.
  virtual Status take(std::string_view name, const toml::node& node) = 0;
  /// Returns the taken keys as flags. Error: the keys do not go together.
  virtual Result<std::vector<std::string>> flags() = 0;
  /// Drops from a file's flags those that a more general flag on the command line replaces.
  virtual void give_way(std::vector<std::string>& flags, const std::vector<std::string>& command_line) const = 0;

 protected:
  /// "LINE: what"
  static Error wrong(const toml::node& node, const std::string& what) {
    return Error{std::to_string(node.source().begin.line) + ": " + what};
  }
};

/// Returns a text or number as a flag's value. Empty: the node is neither.
std::string flag_text(const toml::node& node);

/// Error: the file cannot be read, is no regular file, has more than `most_bytes`, or is no TOML (names file and line).
Result<toml::table> read_toml(const std::string& path, uint64_t most_bytes);

/// Reads a Julia set's preset, constant and animation, its parameters in [julia], its key frames.
std::unique_ptr<SceneKeys> make_julia_keys();

}  // namespace telesplat::launcher
