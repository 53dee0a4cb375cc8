// Keys of a scene file that only one kind of scene has, and that are no flags as they stand: tables, arrays.
#pragma once

#include <toml++/toml.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

/// Of one kind of scene.
class SceneKeys {
 public:
  virtual ~SceneKeys() = default;

  /// What stands where a data file would; empty: a data file.
  virtual std::string_view scene() const = 0;
  /// Whether a key is one of its own. table: the one it stands in; "": in none. node: a value or a table.
  virtual bool owns(std::string_view table, std::string_view name, const toml::node& node) const = 0;
  /// Takes a key that it owns. Errors say what is wrong, and with which node, but do not name the file.
  virtual Status take(std::string_view name, const toml::node& node) = 0;
  /// What was taken, as flags. Error: the keys do not go together.
  virtual Result<std::vector<std::string>> flags() = 0;
  /// Drops from a file's flags what the command line gives more generally.
  virtual void give_way(std::vector<std::string>& flags, const std::vector<std::string>& command_line) const = 0;

 protected:
  /// "LINE: what"
  static Error wrong(const toml::node& node, const std::string& what) {
    return Error{std::to_string(node.source().begin.line) + ": " + what};
  }
};

/// A value as a flag takes it: text or number. Empty: it is neither.
std::string flag_text(const toml::node& node);

/// Error: the file cannot be read, is no regular file, has more than `most_bytes`, or is no TOML: then file and line.
Result<toml::table> read_toml(const std::string& path, uint64_t most_bytes);

/// Of a Julia set: its preset, constant and animation, its parameters in [julia], its key frames.
std::unique_ptr<SceneKeys> make_julia_keys();

}  // namespace telesplat::launcher
