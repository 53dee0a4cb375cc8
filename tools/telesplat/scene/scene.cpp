#include "tools/telesplat/scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "common/core/whole_file.h"
#include "services/data/kinds.h"
#include "tools/telesplat/scene/julia_scene.h"
#include "tools/telesplat/scene/mesh_scene.h"
#include "tools/telesplat/scene/scene_keys.h"
#include "tools/telesplat/scene/volume_scene.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

template <class Kind>
std::unique_ptr<Scene> make(data::DataOptions options) {
  return std::make_unique<Kind>(std::move(options));
}

const SceneKind& row_of(scene::Kind kind) {
  return *std::find_if(scene_kinds().begin(), scene_kinds().end(), [&](const auto& row) { return row.kind == kind; });
}

std::string text_of(const toml::node& node) {
  if (const auto* text = node.as_string()) return **text;
  if (const auto* on = node.as_boolean()) return **on ? "true" : "false";
  return fmt::format("{}", node.value_or(0.0));
}

// Reads keys of [scene] that are recorded flags of a data set. Others (kind, file, title) are not.
Status read_options(const std::string& path, const toml::table& scene, data::DataOptions& o) {
  const options::Table table = data::scene_table(o);
  for (const auto& [key, node] : scene) {
    const auto row = std::find_if(table.begin(), table.end(),
                                  [&name = key](const auto& r) { return options::key_of(r) == name.str(); });
    if (row == table.end() || !node.is_value()) continue;
    if (!row->not_in_scene.empty()) continue;  // a stranger's record must not choose where this machine writes
    if (const Status s = options::set(*row, text_of(node)); !s)
      return Error{
          fmt::format("{}:{}: key {} of [scene]: {}", path, node.source().begin.line, key.str(), s.error().text)};
  }
  o.scene = scene["file"].value_or(std::string());
  return ok_status();
}

}  // namespace

const std::vector<SceneKind>& scene_kinds() {
  static const std::vector<SceneKind> rows{
      {scene::Kind::kMesh, make<MeshScene>, nullptr},
      {scene::Kind::kJulia, make<JuliaScene>, make_julia_keys},
      {scene::Kind::kVolume, make<VolumeScene>, nullptr},
  };
  return rows;
}

std::string Scene::name() const { return fs::path(options_.scene).filename().string(); }

Status Scene::check() const {
  std::error_code error;
  if (!fs::exists(options_.scene, error)) return Error{fmt::format("{}: the data file is not there", options_.scene)};
  return ok_status();
}

Status Scene::read_record(const std::string&) { return ok_status(); }

Status Scene::move_to(const std::string& file) {
  options_.scene = file;
  return ok_status();
}

void Scene::use_cache_of(const data::DataOptions& options) {
  if (!options.mesh.cache_dir.empty()) options_.mesh.cache_dir = options.mesh.cache_dir;
  if (!options.mesh.use_cache) options_.mesh.use_cache = false;
}

Result<std::unique_ptr<Scene>> scene_of(const data::DataOptions& options) {
  const auto kind = data::kind_of(options);
  if (!kind) return kind.error();
  return row_of(*kind).make(options);
}

Result<std::unique_ptr<Scene>> recorded_scene(const std::string& run_directory) {
  const std::string path = run_directory + "/session.toml";
  const auto session = read_toml(path, kMostSessionBytes);
  if (!session) return session.error();
  const toml::table nothing;
  const auto* table = (*session)["scene"].as_table();
  // Old runs of meshes have no kind.
  const std::string name = (*session)["scene"]["kind"].value_or(std::string("mesh"));
  const auto kind = scene::kind_named(name);
  if (!kind) return Error{fmt::format("{}: kind of [scene] is \"{}\", which is unknown", path, name.substr(0, 40))};
  data::DataOptions options;
  if (const Status s = read_options(path, table ? *table : nothing, options); !s) return s.error();
  auto scene = row_of(*kind).make(std::move(options));
  if (const Status s = scene->read_record(run_directory); !s) return s.error();
  return scene;
}

}  // namespace telesplat::launcher
