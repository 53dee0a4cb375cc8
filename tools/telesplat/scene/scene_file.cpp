#include "tools/telesplat/scene/scene_file.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>

#include "common/julia/flags.h"

namespace telesplat::launcher {
namespace {

// Flags that take on or off; the others that a boolean can stand for are either there or not.
bool is_switch(const std::string& flag) {
  return flag == "detail-budget" || flag == "speed-detail" || flag == "finish" || flag == "progressive" ||
         flag == "lighting";
}

// One scene file on its way to flags.
class SceneReader {
 public:
  explicit SceneReader(const std::string& path) : path_(path) {}

  Result<std::vector<std::string>> read(const toml::table& table) {
    if (const Status s = read_table("", table); !s) return s.error();
    if (!kind_.empty() && kind_ != julia::kSceneWord && kind_ != "mesh" && kind_ != "volume")
      return Error{fmt::format("{}: kind is \"{}\", not mesh, julia or volume", path_, kind_)};
    const bool julia = kind_ == julia::kSceneWord;
    if (julia && !file_.empty()) return Error{fmt::format("{}: a Julia set has no data file (key file)", path_)};
    if (!julia && !first_julia_key_.empty())
      return Error{fmt::format("{}: key {} needs kind = \"julia\" in [scene]", path_, first_julia_key_)};
    if (!julia && file_.empty()) return Error{fmt::format("{}: names no data file (key file)", path_)};
    if (const Status s = add_animation(); !s) return s.error();
    flags_.push_back(julia ? std::string(julia::kSceneWord) : file_);
    return flags_;
  }

 private:
  Error wrong(const toml::node& node, const std::string& what) const {
    return Error{fmt::format("{}:{}: {}", path_, node.source().begin.line, what)};
  }

  std::string beside(const std::string& file) const {
    return (std::filesystem::path(path_).parent_path() / file).string();
  }

  Status read_table(const std::string& group, const toml::table& table) {
    for (const auto& [key, node] : table) {
      const std::string name(key.str());
      const auto* inner = node.as_table();
      if (group.empty() && name == "julia" && inner) {
        if (first_julia_key_.empty()) first_julia_key_ = "[julia]";
        if (const Status s = read_parameters(*inner); !s) return s;
      } else if (group.empty() && name == "keyframe") {
        if (const Status s = read_key_frames(node); !s) return s;
      } else if (inner) {
        if (!group.empty()) return Error{fmt::format("{}: table {}.{} is nested too deep", path_, group, name)};
        if (const Status s = read_table(name, *inner); !s) return s;
      } else if (const Status s = read_key(group, name, node); !s) {
        return s;
      }
    }
    return ok_status();
  }

  Status read_key(const std::string& group, const std::string& name, const toml::node& node) {
    std::string flag = name;
    if (group == "packing")
      flag = "packing." + name;
    else
      std::replace(flag.begin(), flag.end(), '_', '-');
    const bool of_scene = group.empty() || group == "scene";
    if (name == "file" && node.is_string()) {
      file_ = beside(**node.as_string());
      return ok_status();
    }
    // Files that a scene names lie beside it. A transfer function may also be a preset, or points.
    if (node.is_string() && (flag == "texture" || flag == "trajectory" || flag == "tf")) {
      const std::string value = **node.as_string();
      std::error_code error;
      const bool file = flag == "texture" || value.ends_with(".json") ||
                        (flag == "trajectory" && std::filesystem::is_regular_file(beside(value), error));
      flags_.push_back(fmt::format("--{}={}", flag, file ? beside(value) : value));
      return ok_status();
    }
    if (of_scene && name == "kind" && node.is_string()) {
      kind_ = **node.as_string();
      return ok_status();
    }
    if (of_scene && (name == "preset" || name == "c" || name == "animate") && first_julia_key_.empty())
      first_julia_key_ = name;
    if (of_scene && name == "animate") return read_animate(node);
    if (of_scene && name == "c" && node.is_array()) return read_constant(node);
    if (node.is_boolean()) {
      const bool on = **node.as_boolean();
      if (is_switch(flag))
        flags_.push_back(fmt::format("--{}={}", flag, on ? "on" : "off"));
      else if (on)
        flags_.push_back("--" + flag);
    } else if (const auto text = text_of(node)) {
      flags_.push_back(fmt::format("--{}={}", flag, *text));
    } else {
      return Error{fmt::format("{}: key {} is neither text, number nor boolean", path_, name)};
    }
    return ok_status();
  }

  static std::optional<std::string> text_of(const toml::node& node) {
    if (node.is_string()) return node.value<std::string>();
    if (node.is_integer()) return fmt::format("{}", **node.as_integer());
    if (node.is_floating_point()) return fmt::format("{}", **node.as_floating_point());
    return std::nullopt;
  }

  Status read_constant(const toml::node& node) {
    std::string text;
    for (const auto& part : *node.as_array()) {
      if (!part.is_number()) return wrong(node, "c is not an array of four numbers i, j, k, real");
      text += (text.empty() ? "" : ",") + *text_of(part);
    }
    if (node.as_array()->size() != 4) return wrong(node, "c is not an array of four numbers i, j, k, real");
    flags_.push_back("--c=" + text);
    return ok_status();
  }

  // The tables below `prefix`: each value goes to a parameter. use(name, value).
  template <class Use>
  Status each_parameter(const std::string& prefix, const toml::table& table, const Use& use) {
    for (const auto& [key, node] : table) {
      std::string name = prefix + std::string(key.str());
      if (name == "t") continue;  // a key frame's time
      if (const auto* inner = node.as_table()) {
        if (const Status s = each_parameter(name + ".", *inner, use); !s) return s;
        continue;
      }
      if (name == "colour.by") name = "colour";
      const auto text = text_of(node);
      if (!text) return wrong(node, fmt::format("{} is neither a number nor a name", name));
      const auto value = julia::read_value(name, *text);
      if (!value) return wrong(node, value.error().text);
      julia::Parameters alone;
      if (const Status s = julia::set(alone, name, *value); !s) return wrong(node, s.error().text);
      use(name, *value);
    }
    return ok_status();
  }

  Status read_parameters(const toml::table& table) {
    if (const auto* time = table.get("t")) return wrong(*time, "t belongs to [[keyframe]]");
    return each_parameter("", table, [&](const std::string& name, double value) {
      flags_.push_back(fmt::format("--{}={}", name, value));
    });
  }

  // A text, or an array of them.
  Status read_animate(const toml::node& node) {
    const auto add = [&](const toml::node& part) -> Status {
      const auto text = part.value<std::string>();
      if (!text) return wrong(part, "animate is neither a text nor an array of them");
      const auto timeline = julia::parse_timeline(*text);
      if (!timeline) return wrong(part, timeline.error().text);
      animation_ += (animation_.empty() ? "" : ";") + *text;
      return ok_status();
    };
    if (!node.is_array()) return add(node);
    for (const auto& part : *node.as_array())
      if (const Status s = add(part); !s) return s;
    return ok_status();
  }

  Status read_key_frames(const toml::node& node) {
    if (first_julia_key_.empty()) first_julia_key_ = "[[keyframe]]";
    const auto* frames = node.as_array();
    if (!frames || !frames->is_array_of_tables()) return wrong(node, "keyframe is not a list of tables [[keyframe]]");
    for (const auto& frame : *frames) {
      const toml::table& table = *frame.as_table();
      const auto t_s = table["t"].value<double>();
      if (!t_s || !std::isfinite(*t_s)) return wrong(frame, "a key frame's t is not a time in seconds");
      if (table.size() < 2) return wrong(frame, "a key frame without parameters");
      if (const Status s = each_parameter(
              "", table,
              [&](const std::string& name, double value) { tracks_[name] += fmt::format("@{}s:{}", *t_s, value); });
          !s)
        return s;
    }
    return ok_status();
  }

  Status add_animation() {
    for (const auto& [name, keys] : tracks_)
      animation_ += fmt::format("{}{}={}", animation_.empty() ? "" : ";", name, keys);
    if (animation_.empty()) return ok_status();
    if (const auto timeline = julia::parse_timeline(animation_); !timeline)
      return Error{fmt::format("{}: {}", path_, timeline.error().text)};
    flags_.push_back("--animate=" + animation_);
    return ok_status();
  }

  std::string path_, file_, kind_, animation_;
  std::string first_julia_key_;                // none of a mesh's
  std::map<std::string, std::string> tracks_;  // key frames by parameter, as a timeline has them
  std::vector<std::string> flags_;
};

bool gives(const std::vector<std::string>& arguments, const std::string& flag) {
  return std::any_of(arguments.begin(), arguments.end(),
                     [&](const std::string& a) { return a == flag || a.starts_with(flag + "="); });
}

// Drops from a file's flags what a more general one on the command line makes anew.
void give_way(std::vector<std::string>& flags, const std::vector<std::string>& arguments) {
  const bool preset = gives(arguments, "--preset"), c = preset || gives(arguments, "--c");
  std::erase_if(flags, [&](const std::string& flag) {
    // An animation of the file would move away what was given here.
    if (c && (flag.starts_with("--c=") || flag.starts_with("--c.") || flag.starts_with("--animate="))) return true;
    const auto infos = julia::parameter_infos();
    return preset && std::any_of(infos.begin(), infos.end(),
                                 [&](const auto& i) { return flag.starts_with(fmt::format("--{}=", i.name)); });
  });
}

}  // namespace

Result<std::vector<std::string>> read_scene_file(const std::string& path) {
  try {
    const toml::table table = toml::parse_file(path);
    return SceneReader(path).read(table);
  } catch (const toml::parse_error& e) {
    return Error{fmt::format("{}:{}: {}", path, e.source().begin.line, e.description())};
  }
}

Result<std::vector<std::string>> expand_scene_file(int argc, char** argv) {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  // The sub-command comes first; the scene is its one argument that ends in .toml.
  const auto scene = std::find_if(arguments.begin(), arguments.end(),
                                  [](const std::string& a) { return a.ends_with(".toml") && !a.starts_with("-"); });
  const bool takes_scene = !arguments.empty() && (arguments.front() == "run" || arguments.front() == "view");
  if (!takes_scene || scene == arguments.end()) return arguments;
  auto flags = read_scene_file(*scene);
  if (!flags) return flags;
  arguments.erase(scene);
  give_way(*flags, arguments);
  arguments.insert(arguments.begin() + 1, flags->begin(), flags->end());
  return arguments;
}

}  // namespace telesplat::launcher
