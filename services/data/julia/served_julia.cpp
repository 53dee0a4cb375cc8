#include "services/data/julia/served_julia.h"

#include <fmt/format.h>

#include "common/core/clock.h"
#include "common/options/table.h"
#include "common/scene/placement.h"

namespace telesplat::data {
namespace {

constexpr double kQuiet_s = 2;  // what takes longer tells how far it is

class ServedJulia final : public Served {
 public:
  ServedJulia(julia::Scene scene, const julia::Placement& placement, double room_size_m)
      : scene_(std::move(scene)), placement_(placement), room_size_m_(room_size_m) {}

  scene::Kind kind() const override { return scene::Kind::kJulia; }
  std::string title() const override { return scene_.title; }
  std::string summary() const override {
    const auto& c = scene_.parameters.c;
    return fmt::format("c = ({}, {}, {}, {}), {} iterations, {:.3f} units a metre", c.x, c.y, c.z, c.w,
                       scene_.parameters.iterations, 1 / placement_.scale);
  }
  void describe(wire::Hello& hello) const override {
    if (!scene_.timeline.empty()) hello.facts["animate"] = scene_.timeline.text();
    hello.parameters = julia::to_map(scene_.parameters);
    hello.parameters.merge(julia::to_map(placement_));
    hello.box_room = placement_.box_room;
    const glm::dvec3 lo(placement_.box_room.lo), hi(placement_.box_room.hi);
    scene::Placement placement{
        .data_to_room = glm::dmat4(glm::dmat3(placement_.scale)),
        .box_data = {lo / placement_.scale + placement_.centre, hi / placement_.scale + placement_.centre},
        .unit = {}};
    placement.data_to_room[3] = glm::dvec4(-placement_.centre * placement_.scale, 1);
    hello.facts[scene::kPlacementFact] = scene::to_text(placement);
  }
  std::string record() const override {
    std::string out = fmt::format("\n[scene]\nkind = \"{}\"\ntitle = {}\nroom_size = {}\n", scene::name_of(kind()),
                                  options::quoted(scene_.title), room_size_m_);
    if (!scene_.timeline.empty()) out += fmt::format("animate = {}\n", options::quoted(scene_.timeline.text()));
    out += "\n[julia]\n";
    for (const auto& [name, value] : julia::to_map(scene_.parameters)) out += fmt::format("\"{}\" = {}\n", name, value);
    out += "\n[placement]\n";
    for (const auto& [name, value] : julia::to_map(placement_)) out += fmt::format("\"{}\" = {}\n", name, value);
    const auto& [lo, hi] = placement_.box_room;
    return out + fmt::format("lo = [{}, {}, {}]\nhi = [{}, {}, {}]\n", lo.x, lo.y, lo.z, hi.x, hi.y, hi.z);
  }

 private:
  const julia::Scene scene_;
  const julia::Placement placement_;
  const double room_size_m_;
};

}  // namespace

Result<std::unique_ptr<Served>> serve_julia(const julia::SceneOptions& options, double room_size_m,
                                            const Progress& progress) {
  auto scene = julia::read_scene(options);
  if (!scene) return scene.error();
  const double begin_s = monotonic_s();
  const auto placement = julia::place(*scene, room_size_m, [&](size_t done, size_t of) {
    if (monotonic_s() - begin_s >= kQuiet_s) progress("looking for the set", double(done) / double(of));
  });
  if (!placement) return placement.error();
  return std::unique_ptr<Served>(std::make_unique<ServedJulia>(std::move(*scene), *placement, room_size_m));
}

}  // namespace telesplat::data
