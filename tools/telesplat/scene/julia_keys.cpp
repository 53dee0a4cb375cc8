#include "tools/telesplat/scene/scene_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/julia/flags.h"

namespace telesplat::launcher {
namespace {

bool gives(const std::vector<std::string>& arguments, const std::string& flag) {
  return std::any_of(arguments.begin(), arguments.end(),
                     [&](const std::string& a) { return a == flag || a.starts_with(flag + "="); });
}

class JuliaKeys : public SceneKeys {
 public:
  std::string_view scene() const override { return julia::kSceneWord; }

  bool owns(std::string_view table, std::string_view name, const toml::node& node) const override {
    if (table.empty() && name == "julia") return node.is_table();
    if (table.empty() && name == "keyframe") return true;
    return (table.empty() || table == "scene") && (name == "preset" || name == "c" || name == "animate");
  }

  Status take(std::string_view name, const toml::node& node) override {
    if (name == "julia") return read_parameters(*node.as_table());
    if (name == "keyframe") return read_key_frames(node);
    if (name == "animate") return read_animate(node);
    if (name == "c" && node.is_array()) return read_constant(node);
    const std::string text = flag_text(node);
    if (text.empty()) return wrong(node, fmt::format("{} is neither text nor number", name));
    flags_.push_back(fmt::format("--{}={}", name, text));
    return ok_status();
  }

  Result<std::vector<std::string>> flags() override {
    for (const auto& [name, keys] : tracks_)
      animation_ += fmt::format("{}{}={}", animation_.empty() ? "" : ";", name, keys);
    if (animation_.empty()) return flags_;
    if (const auto timeline = julia::parse_timeline(animation_); !timeline) return timeline.error();
    flags_.push_back("--animate=" + animation_);
    return flags_;
  }

  // A preset makes the whole set anew. The file's animation would move a constant of the command line.
  void give_way(std::vector<std::string>& flags, const std::vector<std::string>& command_line) const override {
    const bool preset = gives(command_line, "--preset"), c = preset || gives(command_line, "--c");
    std::erase_if(flags, [&](const std::string& flag) {
      if (c && (flag.starts_with("--c=") || flag.starts_with("--c.") || flag.starts_with("--animate="))) return true;
      const auto infos = julia::parameter_infos();
      return preset && std::any_of(infos.begin(), infos.end(),
                                   [&](const auto& i) { return flag.starts_with(fmt::format("--{}=", i.name)); });
    });
  }

 private:
  Status read_constant(const toml::node& node) {
    const auto& parts = *node.as_array();
    std::string text;
    for (const auto& part : parts) {
      if (!text.empty()) text += ',';
      text += part.is_number() ? flag_text(part) : "?";
    }
    if (parts.size() != 4 || text.find('?') != std::string::npos)
      return wrong(node, "c is not an array of four numbers i, j, k, real");
    flags_.push_back("--c=" + text);
    return ok_status();
  }

  // Gives each value in the tables below `prefix` to use(parameter's name, value).
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
      const std::string text = flag_text(node);
      if (text.empty()) return wrong(node, fmt::format("{} is neither a number nor a name", name));
      const auto value = julia::read_value(name, text);
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

  // Reads a text, or an array of texts.
  Status read_animate(const toml::node& node) {
    const auto add = [&](const toml::node& part) -> Status {
      const auto text = part.value<std::string>();
      if (!text) return wrong(part, "animate is neither a text nor an array of texts");
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
    const auto* frames = node.as_array();
    if (!frames || !frames->is_array_of_tables()) return wrong(node, "keyframe is not a list of tables [[keyframe]]");
    for (const auto& frame : *frames) {
      const toml::table& table = *frame.as_table();
      const auto t_s = table["t"].value<double>();
      if (!t_s || !std::isfinite(*t_s)) return wrong(frame, "a key frame's t is not a time in seconds");
      if (table.size() < 2) return wrong(frame, "a key frame without parameters");
      const auto use = [&](const std::string& name, double value) {
        tracks_[name] += fmt::format("@{}s:{}", *t_s, value);
      };
      if (const Status s = each_parameter("", table, use); !s) return s;
    }
    return ok_status();
  }

  std::vector<std::string> flags_;
  std::string animation_;
  std::map<std::string, std::string> tracks_;  // key frames by parameter, as a timeline has them
};

}  // namespace

std::unique_ptr<SceneKeys> make_julia_keys() { return std::make_unique<JuliaKeys>(); }

}  // namespace telesplat::launcher
