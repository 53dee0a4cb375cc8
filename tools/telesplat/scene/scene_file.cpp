#include "tools/telesplat/scene/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "common/core/whole_file.h"
#include "common/options/suggest.h"
#include "tools/telesplat/scene/scene.h"
#include "tools/telesplat/scene/scene_keys.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

// Turns one scene file into flags.
class SceneReader {
 public:
  SceneReader(const std::string& path, const options::Table& table) : path_(path), table_(table) {
    for (const SceneKind& row : scene_kinds())
      if (row.make_keys) owners_.push_back({row.kind, row.make_keys(), {}});
  }

  Result<std::vector<std::string>> read(const toml::table& table) {
    if (const Status s = read_table("", table); !s) return s.error();
    const auto kind = scene::kind_named(kind_);
    if (!kind_.empty() && !kind) return refuse(fmt::format("kind is \"{}\", not {}", kind_, names_of_kinds()));
    std::string scene = file_;
    for (Owner& o : owners_) {
      const bool chosen = kind == o.kind;
      if (!chosen && !o.first_key.empty())
        return refuse(fmt::format("key {} needs kind = \"{}\" in [scene]", o.first_key, scene::name_of(o.kind)));
      if (!chosen || o.keys->scene().empty()) continue;
      if (!file_.empty())
        return refuse(fmt::format("{} has no data file (key file)", capitalised(scene::described(o.kind))));
      scene = o.keys->scene();
    }
    if (scene.empty()) return refuse("names no data file (key file)");
    for (Owner& o : owners_) {
      const auto flags = o.keys->flags();
      if (!flags) return refuse(flags.error().text);
      flags_.insert(flags_.end(), flags->begin(), flags->end());
    }
    flags_.push_back(scene);
    return flags_;
  }

 private:
  struct Owner {
    scene::Kind kind;
    std::unique_ptr<SceneKeys> keys;
    std::string first_key;  // the first key that it took, for messages
  };

  Error refuse(const std::string& what) const { return Error{fmt::format("{}: {}", path_, what)}; }
  Error wrong(const toml::node& node, const std::string& what) const {
    return Error{fmt::format("{}:{}: {}", path_, node.source().begin.line, what)};
  }
  std::string beside(const std::string& file) const {
    const std::string out = (fs::path(path_).parent_path() / file).string();
    return out.starts_with('-') ? "./" + out : out;  // a file, not a flag
  }

  static std::string names_of_kinds() {
    std::string out;
    const size_t n = scene_kinds().size();
    for (size_t i = 0; i < n; ++i)
      out += fmt::format("{}{}", i == 0 ? "" : i + 1 == n ? " or " : ", ", scene::name_of(scene_kinds()[i].kind));
    return out;
  }
  static std::string capitalised(std::string_view text) {
    std::string out(text);
    out[0] = char(std::toupper(out[0]));
    return out;
  }

  Status read_table(const std::string& group, const toml::table& table) {
    for (const auto& [key, node] : table) {
      const std::string name(key.str());
      if (Owner* owner = owner_of(group, name, node)) {
        if (owner->first_key.empty())
          owner->first_key = node.is_table()             ? fmt::format("[{}]", name)
                             : node.is_array_of_tables() ? fmt::format("[[{}]]", name)
                                                         : name;
        if (const Status s = owner->keys->take(name, node); !s)
          return Error{fmt::format("{}:{}", path_, s.error().text)};
      } else if (const auto* inner = node.as_table()) {
        if (!group.empty()) return wrong(node, fmt::format("table {}.{} is nested too deep", group, name));
        if (const Status s = read_table(name, *inner); !s) return s;
      } else if (const Status s = read_key(group, name, node); !s) {
        return s;
      }
    }
    return ok_status();
  }

  Owner* owner_of(const std::string& group, const std::string& name, const toml::node& node) {
    for (Owner& o : owners_)
      if (o.keys->owns(group, name, node)) return &o;
    return nullptr;
  }

  Status read_key(const std::string& group, const std::string& name, const toml::node& node) {
    if (name == "file" && node.is_string()) {
      file_ = beside(**node.as_string());
      return ok_status();
    }
    if ((group.empty() || group == "scene") && name == "kind" && node.is_string()) {
      kind_ = **node.as_string();
      return ok_status();
    }
    std::string flag = "--packing." + name;
    if (group != "packing") {
      flag = "--" + name;
      std::replace(flag.begin(), flag.end(), '_', '-');
    }
    const options::Row* row = options::find(table_, flag);
    const bool off = node.is_boolean() && !**node.as_boolean();
    if (!row && off) return ok_status();  // a flag of another command, switched off
    if (!row) return wrong(node, fmt::format("key {} is none: there is no flag {}{}", name, flag, meant(group, name)));
    if (!row->not_in_scene.empty())
      return wrong(node, fmt::format("key {}: a scene file does not say {}; give {} on the command line", name,
                                     row->not_in_scene, flag));
    return read_flag(*row, flag, name, node);
  }

  std::string meant(const std::string& group, const std::string& name) const {
    constexpr std::string_view kPacking = "packing.";
    std::vector<std::string> known;
    if (group != "packing") known.emplace_back("file");
    for (const options::Row& row : table_) {
      if (!row.not_in_scene.empty()) continue;
      const std::string key = options::key_of(row);
      if (group != "packing")
        known.push_back(key);
      else if (key.starts_with(kPacking))
        known.push_back(key.substr(kPacking.size()));
    }
    return options::did_you_mean(name, known);
  }

  Status read_flag(const options::Row& row, const std::string& flag, const std::string& name, const toml::node& node) {
    if (const auto* on = node.as_boolean()) {
      const bool plain = std::holds_alternative<bool*>(row.value) && !row.on_off;
      if (!plain) flags_.push_back(fmt::format("{}={}", flag, **on ? "on" : "off"));
      if (plain && **on) flags_.push_back(flag);
      return ok_status();
    }
    std::string text = flag_text(node);
    if (text.empty() && !node.is_string())
      return wrong(node, fmt::format("key {} is neither text, number nor boolean", name));
    if (const Status s = options::check(row, text); !s) return wrong(node, s.error().text);
    if (node.is_string() && names_file(row, text)) text = beside(text);
    flags_.push_back(fmt::format("{}={}", flag, text));
    return ok_status();
  }

  // Files that a scene names lie beside it, or in the working folder. A text that may be a file or a name is a file if
  // one exists.
  bool names_file(const options::Row& row, const std::string& text) const {
    std::error_code error;
    const bool looks_like_file = text.find_first_of(":,") == text.npos && fs::path(text).has_extension();
    if (!row.is_file || fs::is_regular_file(beside(text), error)) return row.is_file;
    return looks_like_file && !fs::is_regular_file(text, error);
  }

  std::string path_, file_, kind_;
  const options::Table& table_;
  std::vector<Owner> owners_;
  std::vector<std::string> flags_;
};

}  // namespace

std::string flag_text(const toml::node& node) {
  if (node.is_string()) return **node.as_string();
  if (node.is_integer()) return fmt::format("{}", **node.as_integer());
  if (node.is_floating_point()) return fmt::format("{}", **node.as_floating_point());
  return {};
}

Result<std::vector<std::string>> read_scene_file(const std::string& path, const options::Table& table) {
  const auto file = read_toml(path, kMostDescriptionBytes);
  if (!file) return file.error();
  return SceneReader(path, table).read(*file);
}

Result<std::vector<std::string>> expand_scene_file(std::vector<std::string> arguments, const options::Table& table) {
  // A flag's value may be a TOML file, too: --wall NAME.toml.
  const auto is_value = [&](const std::string& a) {
    const options::Row* before = &a == arguments.data() ? nullptr : options::find(table, *(&a - 1));
    const bool* const* flag = before ? std::get_if<bool*>(&before->value) : nullptr;
    return before && (!flag || before->on_off);
  };
  const auto scene = std::find_if(arguments.begin(), arguments.end(), [&](const std::string& a) {
    return a.ends_with(".toml") && !a.starts_with("-") && !is_value(a);
  });
  if (scene == arguments.end()) return arguments;
  auto flags = read_scene_file(*scene, table);
  if (!flags) return flags;
  arguments.erase(scene);
  for (const SceneKind& row : scene_kinds())
    if (row.make_keys) row.make_keys()->give_way(*flags, arguments);
  arguments.insert(arguments.begin(), flags->begin(), flags->end());
  return arguments;
}

Result<toml::table> read_toml(const std::string& path, uint64_t most_bytes) {
  const auto text = read_whole(path, most_bytes);
  if (!text) return text.error();
  try {
    return toml::parse(*text, path);
  } catch (const toml::parse_error& e) {
    return Error{fmt::format("{}:{}: {}", path, e.source().begin.line, e.description())};
  }
}

}  // namespace telesplat::launcher
