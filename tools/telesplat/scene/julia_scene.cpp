#include "tools/telesplat/scene/julia_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/core/whole_file.h"
#include "common/scene/clip_order.h"
#include "services/sampler/julia/sampler.h"
#include "tools/telesplat/scene/scene_keys.h"

namespace telesplat::launcher {
namespace {

class DirectJulia : public DirectScene {
 public:
  DirectJulia(JuliaScene::Record julia, int threads) : julia_(std::move(julia)), threads_(threads) {}

  Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading, EpochId epoch,
                           double footprint_px) override {
    const auto scene = at(epoch);
    if (!scene) return scene.error();
    return sampler::render_julia_directly(*scene, camera, image::Shading(shading, camera), threads_, footprint_px);
  }
  std::string size() const override { return fmt::format("{} iterations", julia_.begin.iterations); }

 private:
  Result<sampler::JuliaScene> at(EpochId epoch) const {
    const auto parameters = julia_.at(epoch);
    if (!parameters) return parameters.error();
    return sampler::JuliaScene(*parameters, julia_.placement, julia_.epochs.clip_at(epoch));
  }

  JuliaScene::Record julia_;
  int threads_;
};

std::map<std::string, double> numbers_of(const toml::node_view<toml::node>& table) {
  std::map<std::string, double> out;
  if (const auto* t = table.as_table())
    for (const auto& [key, node] : *t)
      if (const auto value = node.value<double>()) out[std::string(key.str())] = *value;
  return out;
}

Result<glm::vec3> corner(const std::string& path, toml::table& table, const char* key) {
  const auto* array = table["placement"][key].as_array();
  glm::vec3 out(NAN);
  if (array && array->size() == 3)
    for (int i = 0; i < 3; ++i) out[i] = float(array->get(size_t(i))->value<double>().value_or(NAN));
  if (!array)
    return Error{
        fmt::format("{}: has no {} in [placement], so where the set stood is not known: earlier versions did not "
                    "record it of runs that were started by hand",
                    path, key)};
  if (!std::isfinite(out.x + out.y + out.z))
    return Error{fmt::format("{}: key {} of [placement] is not three numbers", path, key)};
  return out;
}

Status read_session(const std::string& path, JuliaScene::Record& out) {
  auto file = read_toml(path, kMostSessionBytes);
  if (!file) return file.error();
  toml::table& table = *file;
  out.title = table["scene"]["title"].value_or(std::string(julia::kSceneWord));
  auto begin = julia::from_map(numbers_of(table["julia"]));
  if (begin)
    if (const Status s = julia::validate(*begin); !s) begin = s.error();
  if (!begin) return Error{fmt::format("{}: {}", path, begin.error().text)};
  out.begin = *begin;
  const auto lo = corner(path, table, "lo"), hi = corner(path, table, "hi");
  if (!lo) return lo.error();
  if (!hi) return hi.error();
  const auto placement = julia::placement_from_map(numbers_of(table["placement"]), {*lo, *hi});
  if (!placement) return Error{fmt::format("{}: {}", path, placement.error().text)};
  if (placement->box_room.empty())
    return Error{fmt::format("{}: the box of [placement] is empty: lo is not below hi", path)};
  out.placement = *placement;
  return ok_status();
}

// All columns of a row except the clip are parameters.
Status read_epoch(uint64_t epoch, tools::CsvRow& row, Epochs<julia::Parameters>& out) {
  read_clip(epoch, row, out.clips);
  std::map<std::string, double> values;
  for (const std::string& name : row.table().header())
    if (name != scene::kClipFact) values[name] = row.number(name);
  if (!row.status()) return row.status();
  const auto parameters = julia::from_map(values);
  if (parameters)
    out.by_id[epoch] = *parameters;
  else
    row.demand(false, parameters.error().text);
  return ok_status();
}

std::string lines_of(const julia::Parameters& parameters) {
  std::string out;
  for (const auto& info : julia::parameter_infos())
    out += fmt::format("  {:<14} {:<12g} {}\n", info.name, julia::get(parameters, info.name), info.text);
  return out;
}

}  // namespace

Result<JuliaScene::Record> JuliaScene::record() const {
  if (record_) return *record_;
  const auto scene = julia::read_scene(options_.julia);
  if (!scene) return scene.error();
  const auto placement = julia::place(*scene, options_.mesh.room_size_m);
  if (!placement) return placement.error();
  return Record{scene->title, scene->parameters, *placement, {}};
}

std::string JuliaScene::name() const {
  if (record_) return record_->title;
  const auto scene = julia::read_scene(options_.julia);
  return scene ? scene->title : std::string(julia::kSceneWord);
}

Status JuliaScene::check() const {
  if (record_) return ok_status();
  const auto scene = julia::read_scene(options_.julia);
  return scene ? ok_status() : Status(scene.error());
}

Status JuliaScene::read_record(const std::string& run_directory) {
  Record out;
  out.epochs.directory = run_directory;
  if (const Status s = read_session(run_directory + "/session.toml", out); !s) return s;
  const Status read = read_epochs(
      run_directory, {"epoch"}, [&](uint64_t epoch, tools::CsvRow& row) { return read_epoch(epoch, row, out.epochs); });
  if (read) record_ = std::move(out);
  return read;
}

Status JuliaScene::move_to(const std::string& file) {
  return Error{fmt::format("--scene {}: {} is a Julia set, which has no data file", file, name())};
}

Result<std::unique_ptr<DirectScene>> JuliaScene::open_direct(int threads, const data::Progress&) const {
  auto julia = record();
  if (!julia) return julia.error();
  return std::unique_ptr<DirectScene>(std::make_unique<DirectJulia>(std::move(*julia), threads));
}

std::string JuliaScene::summary(uint64_t) const {
  const auto julia = record();
  if (!julia) return {};
  const auto& c = julia->begin.c;
  return fmt::format(": c = ({:.4g}, {:.4g}, {:.4g}, {:.4g}){}", c.x, c.y, c.z, c.w,
                     julia->epochs.by_id.size() > 1 ? fmt::format(", {} epochs", julia->epochs.by_id.size()) : "");
}

std::string JuliaScene::describe_record() const {
  const auto julia = record();
  if (!julia) return {};
  const std::string& animate = options_.julia.animate;
  std::string out =
      fmt::format("{}, {}\n", julia->title, animate.empty() ? "not animated when it began" : "animated: " + animate);
  out += lines_of(julia->begin);
  if (const size_t n = julia->epochs.by_id.size()) out += fmt::format("  {} epochs (epochs.csv)\n", n);
  return out;
}

Result<data::Description> JuliaScene::describe_data(const data::Progress&) const {
  const auto scene = julia::read_scene(options_.julia);
  if (!scene) return scene.error();
  const auto placement = julia::place(*scene, options_.mesh.room_size_m);
  if (!placement) return placement.error();
  data::Description out("julia", scene->title + ": a Julia set");
  out.json["title"] = scene->title;
  for (const auto& info : julia::parameter_infos()) {
    const double value = julia::get(scene->parameters, info.name);
    out.row(std::string(info.name), fmt::format("{:<12g} {}", value, info.text));
    out.json["parameters"][std::string(info.name)] = value;
  }
  const std::string timeline = scene->timeline.text();
  out.row("animation", timeline.empty() ? "none" : timeline);
  out.json["animation"] = timeline;
  data::describe_room(out, placement->box_room, "", "");
  return out;
}

}  // namespace telesplat::launcher
