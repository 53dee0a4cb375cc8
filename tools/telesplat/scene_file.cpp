#include "tools/telesplat/scene_file.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <filesystem>

namespace telesplat::launcher {
namespace {

// Flags that take on or off; the others that a boolean can stand for are either there or not.
bool is_switch(const std::string& flag) {
  return flag == "detail-budget" || flag == "speed-detail" || flag == "finish";
}

Status collect(const std::string& path, const std::string& prefix, const toml::table& table,
               std::vector<std::string>& flags, std::string& file) {
  for (const auto& [key, node] : table) {
    const std::string name(key.str());
    if (const auto* inner = node.as_table()) {
      if (!prefix.empty()) return Error{fmt::format("{}: table {}.{} is nested too deep", path, prefix, name)};
      if (const Status s = collect(path, name, *inner, flags, file); !s) return s;
      continue;
    }
    std::string flag = name;
    if (prefix == "packing")
      flag = "packing." + name;
    else
      std::replace(flag.begin(), flag.end(), '_', '-');
    if (name == "file" && node.is_string()) {
      file = (std::filesystem::path(path).parent_path() / **node.as_string()).string();
    } else if (node.is_boolean()) {
      const bool on = **node.as_boolean();
      if (is_switch(flag))
        flags.push_back(fmt::format("--{}={}", flag, on ? "on" : "off"));
      else if (on)
        flags.push_back("--" + flag);
    } else if (const auto text = node.value<std::string>()) {
      flags.push_back(fmt::format("--{}={}", flag, *text));
    } else if (node.is_integer()) {
      flags.push_back(fmt::format("--{}={}", flag, **node.as_integer()));
    } else if (node.is_floating_point()) {
      flags.push_back(fmt::format("--{}={}", flag, **node.as_floating_point()));
    } else {
      return Error{fmt::format("{}: key {} is neither text, number nor boolean", path, name)};
    }
  }
  return ok_status();
}

}  // namespace

Result<std::vector<std::string>> read_scene_file(const std::string& path) {
  try {
    const toml::table table = toml::parse_file(path);
    std::vector<std::string> flags;
    std::string file;
    if (const Status s = collect(path, "", table, flags, file); !s) return s.error();
    if (file.empty()) return Error{fmt::format("{}: names no data file (key file)", path)};
    flags.push_back(file);
    return flags;
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
  arguments.insert(arguments.begin() + 1, flags->begin(), flags->end());
  return arguments;
}

}  // namespace telesplat::launcher
